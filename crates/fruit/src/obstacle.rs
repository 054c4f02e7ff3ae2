//! Obstacles of loose fruit, as shapes of the rigid-body engine.

use crate::bruise::Partner;
use orchard_geometry::{Aabb, HeightField, Pose, Shape, Vec3};
use rapier3d_f64::math::{Pose as EnginePose, Vector};
use rapier3d_f64::prelude::{SharedShape, TriMeshFlags};
use std::collections::BTreeMap;
use std::fmt;

/// Body that loose fruit collides with and cannot move.
#[derive(Clone)]
pub struct Obstacle {
    pub(crate) shape: SharedShape,
    pub(crate) partner: Partner,
    pub(crate) friction: f64,
    pub(crate) x_world: Pose,
    pub(crate) moves: bool,
}

impl Obstacle {
    /// A ball whose pose is given to [`crate::Engine::step`]: a fruit at rest or in the hand.
    pub fn ball(fruit: usize, radius: f64, friction: f64, p_world: &Vec3) -> Self {
        Self {
            shape: SharedShape::ball(radius),
            partner: Partner::Fruit(fruit),
            friction,
            x_world: Pose::translation(p_world.x, p_world.y, p_world.z),
            moves: true,
        }
    }
}

/// The colliders of a model as shapes of the engine, made once: its `Clone` shares them.
#[derive(Clone)]
pub struct Shapes(Vec<Option<SharedShape>>);

impl fmt::Debug for Shapes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Shapes({})", self.0.len())
    }
}

impl Shapes {
    /// Shapes of colliders, in their order.
    pub fn new<'a>(shapes: impl Iterator<Item = &'a Shape>) -> Self {
        Self(shapes.map(shared).collect())
    }

    /// Collider `index` as an obstacle at a pose; `moves`: it moves in the frame. `None` for terrain: see
    /// [`Shapes::terrain`].
    pub fn obstacle(
        &self,
        index: usize,
        partner: Partner,
        friction: f64,
        x_world: Pose,
        moves: bool,
    ) -> Option<Obstacle> {
        let shape = self.0[index].clone()?;
        Some(Obstacle { shape, partner, friction, x_world, moves })
    }

    /// The part of a height field under some boxes; `None` where they are off it.
    pub fn terrain(field: &HeightField, reaches: &[Aabb], friction: f64) -> Option<Obstacle> {
        let cells = reaches.iter().filter_map(|reach| field.cells_under(reach));
        let cells: std::collections::BTreeSet<_> = cells.flat_map(|cells| cells.iter()).collect();
        let (mut index_of, mut vertices, mut triangles) = (BTreeMap::new(), Vec::new(), Vec::new());
        for triangle in cells.into_iter().flat_map(HeightField::triangles_of) {
            let mut corners = [0; 3];
            for (corner, node) in corners.iter_mut().zip(triangle) {
                let p = field.node(node)?;
                *corner = *index_of.entry(node).or_insert_with(|| {
                    vertices.push(vector(&p));
                    (vertices.len() - 1) as u32
                });
            }
            triangles.push(corners);
        }
        let shape =
            SharedShape::trimesh_with_flags(vertices, triangles, TriMeshFlags::FIX_INTERNAL_EDGES).ok()?;
        Some(Obstacle { shape, partner: Partner::Ground, friction, x_world: Pose::identity(), moves: false })
    }
}

fn shared(shape: &Shape) -> Option<SharedShape> {
    Some(match shape {
        Shape::Sphere { radius } => SharedShape::ball(*radius),
        Shape::Capsule { radius, length } => {
            SharedShape::capsule(Vector::ZERO, Vector::new(0.0, 0.0, *length), *radius)
        }
        Shape::Box { half } => SharedShape::cuboid(half.x, half.y, half.z),
        Shape::HalfSpace => SharedShape::halfspace(Vector::Z),
        Shape::ConvexHull(hull) => SharedShape::new(hull.parry().clone()),
        Shape::HeightField(_) => return None,
    })
}

pub(crate) fn vector(v: &Vec3) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

pub(crate) fn vec3(v: Vector) -> Vec3 {
    Vec3::new(v.x, v.y, v.z)
}

pub(crate) fn engine_pose(x: &Pose) -> EnginePose {
    let [i, j, k, w] = x.rotation.coords.into();
    EnginePose::from_parts(vector(&x.translation.vector), rapier3d_f64::math::Rotation::from_xyzw(i, j, k, w))
}
