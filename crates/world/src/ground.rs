//! Ground of a world: a plane, or bumps that the chassis rides over.

use crate::terrain::{TerrainError, height_field};
use orchard_geometry::{Aabb, Footprint, HeightField, Pose, Shape, Vec3};
use orchard_robot::RobotModel;
use orchard_spec::Spec;
use std::sync::Arc;

/// Look-ahead of the chassis, in lags of its height servo: at the top of a bump that is climbed evenly, the servo
/// with its two time constants is then short by less than 5 ms of climb.
const LAGS_AHEAD: f64 = 2.0;

/// The ground, and the chassis that it carries.
#[derive(Debug, Clone)]
pub(crate) struct Ground {
    /// `None` is the plane z = 0.
    field: Option<Arc<HeightField>>,
    /// Chassis in the base frame.
    chassis: Aabb,
    /// Look-ahead of the chassis \[s\].
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
            look_ahead: LAGS_AHEAD * robot.height_lag(),
        })
    }

    /// Shape of the ground in the world frame, for contact and for the camera.
    pub fn shape(&self) -> Shape {
        self.field.clone().map_or(Shape::HalfSpace, Shape::HeightField)
    }

    pub fn field(&self) -> Option<&HeightField> {
        self.field.as_deref()
    }

    /// Height of the highest ground within a distance of a point, measured along both axes \[m\].
    pub fn highest_near(&self, p_world: &Vec3, distance: f64) -> f64 {
        let Some(field) = &self.field else { return 0.0 };
        let around =
            Footprint { centre: [p_world.x, p_world.y], ahead: [1.0, 0.0], half: [distance, distance] };
        field.highest_under(&around).unwrap_or(0.0)
    }

    /// Ride height of the chassis of a base at a place and heading \[m\]: the height of the
    /// highest ground under it, so that no bump comes through its flat underside.
    pub fn ride_height(&self, x_world_base: &Pose) -> f64 {
        self.ride_height_ahead(x_world_base, &Vec3::zeros(), 0.0)
    }

    /// Ride height \[m\] of a base that moves (velocity of its origin [m/s], turn rate [rad/s]): the highest ground that the
    /// chassis is over or will soon be over, since the height servo lags.
    pub fn ride_height_ahead(&self, x_world_base: &Pose, v_world: &Vec3, turn_rate: f64) -> f64 {
        let Some(field) = &self.field else { return 0.0 };
        let Aabb { min, max } = self.chassis;
        let half = 0.5 * (max - min);
        let way = x_world_base.rotation.inverse() * v_world * self.look_ahead;
        let turn = (turn_rate * self.look_ahead).abs();
        let middle = orchard_geometry::transform(x_world_base, &(0.5 * (min + max + way)));
        let ahead = x_world_base.rotation * Vec3::x();
        let footprint = Footprint {
            centre: [middle.x, middle.y],
            ahead: [ahead.x, ahead.y],
            half: [half.x + 0.5 * way.x.abs() + turn * half.y, half.y + 0.5 * way.y.abs() + turn * half.x],
        };
        field.highest_under(&footprint).unwrap_or(0.0)
    }
}
