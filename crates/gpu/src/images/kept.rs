//! Scenes that the device keeps, as records at numbered places of one size.

use std::sync::Arc;

use bytemuck::Pod;
use orchard_camera::{Item, MovingScene};
use rayon::prelude::*;

/// Room of a place beyond the largest scene so far, our own choice: a share, so that the next larger one does not move all others.
const MORE: usize = 4;

/// Scenes at their places, of which a buffer has records.
#[derive(Debug)]
pub(super) struct Kept<T> {
    places: Vec<Option<Place<T>>>,
    /// Records that a place has room for.
    stride: usize,
    /// True if the room has changed since everything was sent.
    is_moved: bool,
}

#[derive(Debug)]
struct Place<T> {
    scene: Arc<MovingScene>,
    /// Number of bodies that its items are fixed to: the last one of them, and one more.
    bodies: usize,
    /// Empty until they are packed.
    records: Vec<T>,
    /// Number of the first ones, which are of one kind: solids that cast shadow, or quads of tints before items.
    first_count: usize,
    is_sent: bool,
}

impl<T> Default for Kept<T> {
    fn default() -> Self {
        Self { places: Vec::new(), stride: 0, is_moved: false }
    }
}

impl<T: Pod + Send + Sync> Kept<T> {
    /// Puts a scene at a place, unless it is there.
    pub fn put(&mut self, place: usize, scene: &Arc<MovingScene>) {
        if self.places.len() <= place {
            self.places.resize_with(place + 1, || None);
            self.is_moved = true;
        }
        let there = &mut self.places[place];
        if there.as_ref().is_none_or(|there| !Arc::ptr_eq(&there.scene, scene)) {
            let bodies = scene.bodies().iter().max().map_or(0, |last| *last as usize + 1);
            let records = Vec::new();
            *there = Some(Place { scene: scene.clone(), bodies, records, first_count: 0, is_sent: false });
        }
    }

    /// The scene at a place.
    pub fn scene(&self, place: usize) -> &MovingScene {
        &self.at(place).scene
    }

    /// Items of the scene at a place.
    pub fn items(&self, place: usize) -> &[Item] {
        self.at(place).scene.items()
    }

    /// Number of records of the scene at a place.
    pub fn len(&self, place: usize) -> usize {
        self.at(place).records.len()
    }

    /// Number of its first records, which are of one kind, as they were packed.
    pub fn first_count(&self, place: usize) -> usize {
        self.at(place).first_count
    }

    /// Number of bodies of the scene at a place.
    pub fn bodies(&self, place: usize) -> usize {
        self.at(place).bodies
    }

    /// First record of a place.
    pub fn first(&self, place: usize) -> usize {
        self.stride * place
    }

    /// Records that all places have room for.
    pub fn room(&self) -> usize {
        self.stride * self.places.len()
    }

    fn at(&self, place: usize) -> &Place<T> {
        self.places.get(place).and_then(Option::as_ref).expect("a scene is kept at the place of a view")
    }

    /// Scenes that have no records yet.
    pub fn unpacked(&self) -> impl Iterator<Item = &MovingScene> {
        let new = self.places.iter().flatten().filter(|place| place.records.is_empty());
        new.map(|place| &*place.scene)
    }

    /// Packs new scenes into records; `of` tells how many of them come first.
    pub fn pack(&mut self, of: impl Fn(&MovingScene) -> (Vec<T>, usize) + Sync) {
        let new = self.places.par_iter_mut().flatten().filter(|place| place.records.is_empty());
        new.for_each(|place| (place.records, place.first_count) = of(&place.scene));
        let most = self.places.iter().flatten().map(|place| place.records.len()).max().unwrap_or(0);
        if most > self.stride {
            self.stride = most + most / MORE;
            self.is_moved = true;
        }
    }

    /// Sends what the device does not have, to a buffer behind some bytes; `all`: everything.
    pub fn send(&mut self, queue: &wgpu::Queue, buffer: &wgpu::Buffer, behind: usize, all: bool) {
        let (all, stride) = (all || self.is_moved, self.stride);
        self.places.par_iter_mut().enumerate().for_each(|(number, place)| {
            if let Some(place) = place.as_mut().filter(|place| all || !place.is_sent) {
                let first = (behind + size_of::<T>() * stride * number) as u64;
                queue.write_buffer(buffer, first, bytemuck::cast_slice(&place.records));
                place.is_sent = true;
            }
        });
        self.is_moved = false;
    }
}
