//! Scenes that the device keeps, at numbered places of one size.

use std::sync::Arc;

use orchard_camera::{Item, MovingScene};
use rayon::prelude::*;

use super::buffers::SOLID_BYTES;
use super::solids::{Meshes, WORDS, of_bodies};

/// Room of a place beyond the largest scene so far, our own choice: a share, so that the next larger one does not move all others.
const MORE: usize = 4;

/// Scenes at their places.
#[derive(Debug, Default)]
pub(super) struct Kept {
    places: Vec<Option<Place>>,
    /// Solids that a place has room for.
    stride: usize,
    /// True if the room has changed since everything was sent.
    is_moved: bool,
}

#[derive(Debug)]
struct Place {
    scene: Arc<MovingScene>,
    /// Number of bodies that its items are fixed to: the last one of them, and one more.
    bodies: usize,
    /// Solids in the frames of bodies; empty until they are packed.
    solids: Vec<[u32; WORDS]>,
    is_sent: bool,
}

impl Kept {
    /// Puts a scene at a place, unless it is there.
    pub fn put(&mut self, place: usize, scene: &Arc<MovingScene>) {
        if self.places.len() <= place {
            self.places.resize_with(place + 1, || None);
            self.is_moved = true;
        }
        let there = &mut self.places[place];
        if there.as_ref().is_none_or(|there| !Arc::ptr_eq(&there.scene, scene)) {
            let bodies = scene.bodies().iter().max().map_or(0, |last| *last as usize + 1);
            *there = Some(Place { scene: scene.clone(), bodies, solids: Vec::new(), is_sent: false });
        }
    }

    /// Items of the scene at a place.
    pub fn items(&self, place: usize) -> &[Item] {
        self.at(place).scene.items()
    }

    /// Number of its solids.
    pub fn solids(&self, place: usize) -> usize {
        self.at(place).solids.len()
    }

    /// Number of its bodies.
    pub fn bodies(&self, place: usize) -> usize {
        self.at(place).bodies
    }

    /// First solid of a place.
    pub fn first(&self, place: usize) -> usize {
        self.stride * place
    }

    /// Solids that all places have room for.
    pub fn room(&self) -> usize {
        self.stride * self.places.len()
    }

    fn at(&self, place: usize) -> &Place {
        self.places.get(place).and_then(Option::as_ref).expect("a scene is kept at the place of a view")
    }

    /// Packs the solids of new scenes, whose meshes join the others.
    pub fn pack(&mut self, meshes: &mut Meshes) {
        let mut new: Vec<&mut Place> =
            self.places.iter_mut().flatten().filter(|place| place.solids.is_empty()).collect();
        for place in &new {
            meshes.add(place.scene.items());
        }
        let meshes = &*meshes;
        new.par_iter_mut().for_each(|place| place.solids = of_bodies(&place.scene, meshes));
        let most = self.places.iter().flatten().map(|place| place.solids.len()).max().unwrap_or(0);
        if most > self.stride {
            self.stride = most + most / MORE;
            self.is_moved = true;
        }
    }

    /// Sends what the device does not have; `all`: everything.
    pub fn send(&mut self, queue: &wgpu::Queue, buffer: &wgpu::Buffer, all: bool) {
        let (all, stride) = (all || self.is_moved, self.stride);
        self.places.par_iter_mut().enumerate().for_each(|(number, place)| {
            if let Some(place) = place.as_mut().filter(|place| all || !place.is_sent) {
                let first = (SOLID_BYTES * stride * number) as u64;
                queue.write_buffer(buffer, first, bytemuck::cast_slice(&place.solids));
                place.is_sent = true;
            }
        });
        self.is_moved = false;
    }
}
