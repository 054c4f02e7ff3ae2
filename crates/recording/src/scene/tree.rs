//! The tree: wood and leaves in the frames of their segments, fruit in their own.

use foxglove::messages::{SceneEntity, SceneUpdate};
use orchard_camera::blade::{self, BladeMesh};
use orchard_geometry::{Pose, Shape, Vec3, rotation_from_z, transform};
use orchard_treegen::Spur;
use orchard_world::World;
use orchard_world::truth::{FruitState, FruitTruth};

use super::primitives::{push, push_triangles};
use super::{Ball, entity, update};
use crate::transforms::{fruit_frame, segment_frame};

/// Colours, sRGB with opacity.
const BARK: [f64; 4] = [0.42, 0.31, 0.22, 1.0];
const DEBRIS: [f64; 4] = [0.95, 0.45, 0.05, 1.0];
const LEAF: [f64; 4] = [0.24, 0.47, 0.16, 1.0];

/// Scene of the wood, redrawn when some of it breaks.
#[derive(Debug, Clone, Default)]
pub struct Wood {
    /// By segment, true if it was drawn as broken off; empty before the first drawing.
    debris: Vec<bool>,
}

impl Wood {
    /// The drawing that is due: an entity a segment, with its spurs.
    pub fn due(&mut self, now: u64, world: &World) -> Option<SceneUpdate> {
        let skeleton = world.skeleton();
        let debris: Vec<bool> = (0..skeleton.segments.len()).map(|i| world.rupture().is_debris(i)).collect();
        if debris == self.debris {
            return None;
        }
        self.debris = debris;
        let color = |i: usize| if self.debris[i] { DEBRIS } else { BARK };
        let mut entities: Vec<SceneEntity> = Vec::with_capacity(skeleton.segments.len());
        for (i, segment) in skeleton.segments.iter().enumerate() {
            let mut entity = entity(now, segment_frame(i), i.to_string());
            let shape = Shape::Capsule { radius: segment.radius, length: segment.length };
            push(&mut entity, &shape, &Pose::identity(), color(i));
            entities.push(entity);
        }
        for Spur { segment, p_segment, heading_segment, length, .. } in &skeleton.spurs {
            let pose = Pose::from_parts((*p_segment).into(), rotation_from_z(heading_segment));
            push(
                &mut entities[*segment],
                &Shape::Capsule { radius: world.spec().tree.spur_radius.si(), length: *length },
                &pose,
                color(*segment),
            );
        }
        Some(update(now, entities))
    }
}

/// Leaves: an entity a segment that bears some, and one list of triangles in it.
pub fn leaves(now: u64, world: &World) -> SceneUpdate {
    let skeleton = world.skeleton();
    let mut meshes: Vec<(Vec<Vec3>, Vec<u32>)> = vec![Default::default(); skeleton.segments.len()];
    let mesh = BladeMesh::from_spec(&world.spec().foliage);
    for leaf in &skeleton.leaves {
        let (points, indices) = &mut meshes[leaf.segment];
        let first = points.len() as u32;
        let corners = mesh.vertices(leaf.length, leaf.width);
        points.extend(corners.iter().map(|p| transform(&leaf.x_segment_leaf, p)));
        indices.extend(blade::triangles().into_iter().flatten().map(|i| first + i as u32));
    }
    let leafy = meshes.into_iter().enumerate().filter(|(_, (points, _))| !points.is_empty());
    let drawn = leafy.map(|(i, (points, indices))| {
        let mut entity = entity(now, segment_frame(i), i.to_string());
        push_triangles(&mut entity, &Pose::identity(), &points, indices, LEAF);
        entity
    });
    update(now, drawn.collect())
}

/// Scene of the fruit, redrawn when the state of one changes.
#[derive(Debug, Clone, Default)]
pub struct Crop {
    states: Vec<FruitState>,
    drawn: bool,
}

impl Crop {
    /// The drawing that is due: an entity a fruit, coloured by its state.
    pub fn due(&mut self, now: u64, world: &World) -> Option<SceneUpdate> {
        let fruit = world.fruit_truth();
        let states: Vec<FruitState> = fruit.iter().map(|fruit| fruit.state).collect();
        if self.drawn && states == self.states {
            return None;
        }
        (self.states, self.drawn) = (states, true);
        let drawn = |(i, fruit): (usize, &FruitTruth)| {
            let mut entity = entity(now, fruit_frame(i), i.to_string());
            let ball = Ball { p: Vec3::zeros(), radius: fruit.radius, color: color(fruit.state) };
            entity.spheres.push(ball.primitive());
            entity
        };
        Some(update(now, fruit.iter().enumerate().map(drawn).collect()))
    }
}

fn color(state: FruitState) -> [f64; 4] {
    match state {
        FruitState::OnTree => [0.80, 0.12, 0.10, 1.0],
        FruitState::OnBrokenLimb => [0.60, 0.20, 0.45, 1.0],
        FruitState::Held => [1.00, 0.85, 0.10, 1.0],
        FruitState::Loose => [1.00, 0.55, 0.10, 1.0],
        FruitState::Deposited => [0.25, 0.65, 0.95, 1.0],
        FruitState::Dropped => [0.35, 0.10, 0.08, 1.0],
    }
}
