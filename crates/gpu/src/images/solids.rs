//! Solids of scenes as the kernels read them.

use std::sync::Arc;

use orchard_camera::blade::{BladeMesh, TRIANGLES, triangles};
use orchard_camera::{Geometry, Scene, Solid};
use orchard_geometry::{Pose, Vec3};

use super::View;
use crate::layout::QUAD;

/// Corners of the triangles of a blade.
pub(super) const CORNERS: usize = 3 * TRIANGLES;
/// Words of a solid.
pub(super) const WORDS: usize = 12;
/// Bits of a solid's first word that hold its kind; its mesh is in the others.
const KIND_BITS: u32 = 8;

/// Kinds, as `kernels/image.wgsl` numbers them.
const BALL: u32 = 0;
const CAPSULE: u32 = 1;
const BOX: u32 = 2;
const PLANE: u32 = 3;
const TRIANGLE: u32 = 4;
const BLADE: u32 = 5;

/// Meshes of all blades of some scenes, each once.
#[derive(Debug, Default)]
pub(super) struct Meshes(Vec<Arc<BladeMesh>>);

impl Meshes {
    /// Collects them.
    pub fn of<'a>(scenes: impl Iterator<Item = &'a Scene>) -> Self {
        let mut meshes = Self::default();
        for item in scenes.flat_map(|scene| &scene.items) {
            if let Geometry::Blade { mesh, .. } = &item.geometry
                && meshes.find(mesh).is_none()
            {
                meshes.0.push(mesh.clone());
            }
        }
        meshes
    }

    /// Number of a mesh; none if it is not there.
    fn find(&self, mesh: &Arc<BladeMesh>) -> Option<usize> {
        self.0.iter().position(|known| Arc::ptr_eq(known, mesh) || known == mesh)
    }

    /// Corners of the triangles of every unit blade: what length and width multiply.
    pub fn corners(&self) -> Vec<[f32; QUAD]> {
        let of_mesh = |mesh: &Arc<BladeMesh>| {
            let (along, across) = (mesh.vertices(1.0, 0.0), mesh.vertices(0.0, 1.0));
            let corners = triangles().into_iter().flatten();
            corners.flat_map(move |k| [quad(&along[k]), quad(&across[k])]).collect::<Vec<_>>()
        };
        self.0.iter().flat_map(of_mesh).collect()
    }
}

/// Adds the solids of a view to a list, and returns their number.
pub(super) fn push(list: &mut Vec<[u32; WORDS]>, view: &View<'_>, meshes: &Meshes) -> usize {
    let before = list.len();
    let exposure = &view.exposure;
    view.scene.for_each_solid(&exposure.intrinsics, &exposure.x_world_camera, exposure.far, |item, solid| {
        list.push(words(item, &solid, meshes));
    });
    list.len() - before
}

fn words(item: u32, solid: &Solid<'_>, meshes: &Meshes) -> [u32; WORDS] {
    let mut words = [0; WORDS];
    let mut numbers = words[2..].iter_mut();
    let mut write = |values: &[f64]| {
        // The values first: the list that ends must not take a word along.
        for (value, word) in values.iter().zip(numbers.by_ref()) {
            *word = (*value as f32).to_bits();
        }
    };
    let mut write_pose = |x: &Pose, rest: &[f64]| {
        write(x.translation.vector.as_slice());
        write(x.rotation.coords.as_slice());
        write(rest);
    };
    let kind = match solid {
        Solid::Box { x_camera_box, half } => {
            write_pose(x_camera_box, half.as_slice());
            BOX
        }
        Solid::Blade { x_camera_blade, mesh, length, width } => {
            write_pose(x_camera_blade, &[*length, *width]);
            BLADE | (meshes.find(mesh).unwrap_or(0) as u32) << KIND_BITS
        }
        Solid::Ball { p_camera, radius } => {
            write(p_camera.as_slice());
            write(&[*radius]);
            BALL
        }
        Solid::Capsule { p_camera, axis, length, radius } => {
            write(p_camera.as_slice());
            write(axis.as_slice());
            write(&[*length, *radius]);
            CAPSULE
        }
        Solid::Plane { p_camera, normal } => {
            write(normal.as_slice());
            write(&[normal.dot(p_camera)]);
            PLANE
        }
        Solid::Triangle(corners) => {
            corners.iter().for_each(|corner| write(corner.as_slice()));
            TRIANGLE
        }
    };
    (words[0], words[1]) = (kind, item);
    words
}

fn quad(v: &Vec3) -> [f32; QUAD] {
    [v.x as f32, v.y as f32, v.z as f32, 0.0]
}
