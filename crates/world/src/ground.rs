//! What a world stands on: a plane, or bumps that the chassis is carried over.

use crate::terrain::{TerrainError, height_field};
use orchard_geometry::{Aabb, Footprint, HeightField, Pose, Shape, Vec3};
use orchard_robot::RobotModel;
use orchard_spec::Spec;
use std::sync::Arc;

/// The ground and the part of it that carries the robot.
#[derive(Debug, Clone)]
pub(crate) struct Ground {
    /// `None` is the plane z = 0.
    field: Option<Arc<HeightField>>,
    /// Chassis in the base frame.
    chassis: Aabb,
    /// How far ahead the height servo looks, to all sides [m].
    look_ahead: f64,
}

impl Ground {
    pub fn new(spec: &Spec, robot: &RobotModel, seed: u64, world: u32) -> Result<Self, TerrainError> {
        let terrain = &spec.terrain;
        let made = terrain
            .enabled
            .then(|| height_field(terrain, spec.sim.plausible_extent.si(), seed, world))
            .transpose()?;
        Ok(Self {
            field: made.map(Arc::new),
            chassis: robot.chassis(),
            look_ahead: robot.config().base.speed_max.si() * robot.height_lag(),
        })
    }

    /// As a collider or a thing to see, in the world frame.
    pub fn shape(&self) -> Shape {
        self.field.clone().map_or(Shape::HalfSpace, Shape::HeightField)
    }

    pub fn field(&self) -> Option<&HeightField> {
        self.field.as_deref()
    }

    /// Height at which the ground carries the chassis of a base at a place and heading [m]: that of the highest ground
    /// under it, so that no bump comes through its flat underside, or so near that the height servo would be late for
    /// it at the base's top speed.
    pub fn ride_height(&self, x_world_base: &Pose) -> f64 {
        let Some(field) = &self.field else { return 0.0 };
        let Aabb { min, max } = self.chassis;
        let middle = orchard_geometry::transform(x_world_base, &(0.5 * (min + max)));
        let ahead = x_world_base.rotation * Vec3::x();
        let half = 0.5 * (max - min) + Vec3::repeat(self.look_ahead);
        let footprint =
            Footprint { centre: [middle.x, middle.y], ahead: [ahead.x, ahead.y], half: [half.x, half.y] };
        field.highest_under(&footprint).unwrap_or(0.0)
    }
}
