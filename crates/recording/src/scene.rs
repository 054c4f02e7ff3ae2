//! Scene entities for display, each in the frame of the body that it belongs to.
//!
//! Every message replaces all that its topic drew before, so that the last one before any moment is enough to show it.

mod primitives;
mod tree;

use foxglove::messages::scene_entity_deletion::Type;
use foxglove::messages::{Duration, SceneEntity, SceneEntityDeletion, SceneUpdate, SpherePrimitive};
use orchard_camera::{Geometry, Label};
use orchard_geometry::{Pose, Rotation, Vec3};
use orchard_world::World;

use crate::clock::timestamp;
use crate::transforms::{WORLD, link_frame};

pub use primitives::message_pose;
use primitives::{color, message_vector};
pub use tree::{Crop, Wood, leaves};

/// Colours, sRGB with opacity.
const GROUND: [f64; 4] = [0.42, 0.36, 0.26, 1.0];
const SCENERY: [f64; 4] = [0.55, 0.55, 0.55, 1.0];
const ROBOT: [f64; 4] = [0.86, 0.87, 0.88, 1.0];
const BUCKET: [f64; 4] = [0.20, 0.42, 0.75, 0.55];
/// Half a side of the square that is drawn of level ground \[m\].
const PLAIN: f64 = 5.0;

/// A message that sets the entities of a topic from now on.
fn update(now: u64, entities: Vec<SceneEntity>) -> SceneUpdate {
    let all =
        SceneEntityDeletion { timestamp: Some(timestamp(now)), r#type: Type::All.into(), id: String::new() };
    SceneUpdate { deletions: vec![all], entities }
}

/// An entity without anything in it, which moves with its frame.
fn entity(now: u64, frame: String, id: String) -> SceneEntity {
    SceneEntity {
        timestamp: Some(timestamp(now)),
        frame_id: frame,
        id,
        // None: it stays until it is replaced.
        lifetime: Some(Duration::new(0, 0)),
        frame_locked: true,
        ..SceneEntity::default()
    }
}

/// A sphere to draw.
#[derive(Debug, Clone, Copy)]
pub struct Ball {
    /// Centre \[m\].
    pub p: Vec3,
    /// Radius \[m\].
    pub radius: f64,
    /// Red, green, blue, opacity.
    pub color: [f64; 4],
}

impl Ball {
    fn primitive(&self) -> SpherePrimitive {
        let pose = Pose::from_parts(self.p.into(), Rotation::identity());
        SpherePrimitive {
            pose: Some(message_pose(&pose)),
            size: Some(message_vector(&Vec3::repeat(2.0 * self.radius))),
            color: Some(color(self.color)),
        }
    }
}

/// Spheres in one frame, which may be none.
pub fn balls(now: u64, frame: &str, id: &str, balls: &[Ball]) -> SceneUpdate {
    let mut entity = entity(now, frame.to_owned(), id.to_owned());
    entity.spheres = balls.iter().map(Ball::primitive).collect();
    update(now, vec![entity])
}

/// Ground, posts and wires.
pub fn ground(now: u64, world: &World) -> SceneUpdate {
    let mut ground = entity(now, WORLD.to_owned(), "ground".to_owned());
    match world.terrain() {
        None => primitives::push_square(&mut ground, PLAIN, GROUND),
        Some(field) => primitives::push_terrain(&mut ground, field, GROUND),
    }
    let mut scenery = entity(now, WORLD.to_owned(), "scenery".to_owned());
    for item in world.scene().items.iter().filter(|item| item.label == Label::Scenery) {
        if let Geometry::Shape(shape) = &item.geometry {
            primitives::push(&mut scenery, shape, &item.x_world_item, SCENERY);
        }
    }
    update(now, vec![ground, scenery])
}

/// The robot: an entity a link that has a shape.
pub fn robot(now: u64, world: &World) -> SceneUpdate {
    let robot = world.robot();
    let bucket = &robot.config().parts.bucket_link;
    let links = robot.articulation().links.iter().filter(|link| !link.shapes.is_empty());
    let entity = |link: &orchard_robot::Link| {
        let mut entity = entity(now, link_frame(&link.name), link.name.clone());
        for shape in &link.shapes {
            let color = if shape.part == *bucket { BUCKET } else { ROBOT };
            primitives::push(&mut entity, &shape.shape, &shape.x_link_shape, color);
        }
        entity
    };
    update(now, links.map(entity).collect())
}
