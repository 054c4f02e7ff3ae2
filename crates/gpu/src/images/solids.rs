//! Solids of scenes as the kernels read them.

use std::sync::Arc;

use orchard_camera::blade::{BladeMesh, TRIANGLES, triangles};
use orchard_camera::{Exposure, Geometry, Item, MovingScene, Scene, Solid};
use orchard_geometry::{Intrinsics, Pose, Vec3};

use crate::layout::QUAD;

/// Corners of the triangles of a blade.
pub(super) const CORNERS: usize = 3 * TRIANGLES;
/// Words of a solid.
pub(super) const WORDS: usize = 12;
/// First bits of a solid's mesh and of its body in its first word, behind its kind.
const MESH_BIT: u32 = 4;
const BODY_BIT: u32 = 16;
/// Number of meshes and of bodies that there is room for.
pub(super) const MOST_MESHES: usize = 1 << (BODY_BIT - MESH_BIT);
pub(super) const MOST_BODIES: usize = 1 << (u32::BITS - BODY_BIT);

/// Kinds, as `kernels/image.wgsl` numbers them.
const BALL: u32 = 0;
const CAPSULE: u32 = 1;
const BOX: u32 = 2;
const PLANE: u32 = 3;
const TRIANGLE: u32 = 4;
const BLADE: u32 = 5;

/// Meshes of blades, each once.
#[derive(Debug, Default)]
pub(super) struct Meshes(Vec<Arc<BladeMesh>>);

impl Meshes {
    /// Adds those of some items that are not there.
    pub fn add(&mut self, items: &[Item]) {
        let mut latest = None;
        for item in items {
            // The leaves of a tree share their mesh.
            if let Geometry::Blade { mesh, .. } = &item.geometry
                && latest != Some(Arc::as_ptr(mesh))
            {
                latest = Some(Arc::as_ptr(mesh));
                if !self.0.contains(mesh) {
                    self.0.push(mesh.clone());
                }
            }
        }
    }

    /// Number of meshes.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Finds numbers of meshes.
    fn finder(&self) -> impl FnMut(&Arc<BladeMesh>) -> u32 {
        let mut latest = (std::ptr::null(), 0);
        move |mesh| {
            if latest.0 != Arc::as_ptr(mesh) {
                let number = self.0.iter().position(|known| known == mesh);
                latest = (Arc::as_ptr(mesh), number.unwrap_or(0) as u32);
            }
            latest.1
        }
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

/// Adds the solids of a scene before a camera to a list, and returns their number. They have one body, which is the camera's.
pub(super) fn push(
    list: &mut Vec<[u32; WORDS]>,
    scene: &Scene,
    exposure: &Exposure,
    meshes: &Meshes,
) -> usize {
    let (before, mut mesh_of) = (list.len(), meshes.finder());
    scene.for_each_solid(&exposure.intrinsics, &exposure.x_world_camera, exposure.far, |item, solid| {
        list.push(words(item, 0, &solid, &mut mesh_of));
    });
    list.len() - before
}

/// Solids of a moving scene in the frames of their bodies.
pub(super) fn of_bodies(scene: &MovingScene, meshes: &Meshes) -> Vec<[u32; WORDS]> {
    of_items(scene.still(), |item| scene.bodies()[item as usize], meshes)
}

/// Solids of the items of a scene, each of which has a body.
pub(super) fn of_items(scene: &Scene, body_of: impl Fn(u32) -> u32, meshes: &Meshes) -> Vec<[u32; WORDS]> {
    let (mut list, mut mesh_of) = (Vec::with_capacity(scene.items.len()), meshes.finder());
    // Every place is wanted: no camera, and no end.
    let anywhere = Intrinsics { width: 0, height: 0, fx: 1.0, fy: 1.0, cx: 0.0, cy: 0.0 };
    scene.for_each_solid(&anywhere, &Pose::identity(), f64::INFINITY, |item, solid| {
        list.push(words(item, body_of(item), &solid, &mut mesh_of));
    });
    list
}

/// Rotation and place of a body, as the kernels read them.
pub(super) fn pose_quads(x_camera_body: &Pose) -> [[f32; QUAD]; 2] {
    let q = x_camera_body.rotation.coords;
    [[q.x as f32, q.y as f32, q.z as f32, q.w as f32], quad(&x_camera_body.translation.vector)]
}

fn words(
    item: u32,
    body: u32,
    solid: &Solid<'_>,
    mut mesh_of: impl FnMut(&Arc<BladeMesh>) -> u32,
) -> [u32; WORDS] {
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
            BLADE | mesh_of(mesh) << MESH_BIT
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
    (words[0], words[1]) = (kind | body << BODY_BIT, item);
    words
}

pub(super) fn quad(v: &Vec3) -> [f32; QUAD] {
    [v.x as f32, v.y as f32, v.z as f32, 0.0]
}
