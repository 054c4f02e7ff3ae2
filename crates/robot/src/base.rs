//! Base of a robot: the joint by which it moves, and the velocities that its steering allows.

use crate::config::Steering;
use orchard_geometry::Vec3;
use orchard_multibody::{BodyId, Data, Model};

/// Joint by which a base moves; `T` identifies its link or body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BaseJoint<T> {
    /// The base stands.
    Fixed,
    /// The base slides on a level rail.
    Rail {
        /// Link or body that slides.
        on: T,
        /// Direction of the rail in the base frame, a unit vector.
        axis_base: Vec3,
    },
    /// The base moves on the ground.
    Planar(T),
}

impl<T> BaseJoint<T> {
    /// Returns the joint with another identification of its link or body.
    pub fn map<U>(self, on: impl FnOnce(T) -> U) -> BaseJoint<U> {
        match self {
            Self::Fixed => BaseJoint::Fixed,
            Self::Rail { on: link, axis_base } => BaseJoint::Rail { on: on(link), axis_base },
            Self::Planar(link) => BaseJoint::Planar(on(link)),
        }
    }

    /// The link or body that moves.
    pub fn moving(&self) -> Option<&T> {
        match self {
            Self::Fixed => None,
            Self::Rail { on, .. } | Self::Planar(on) => Some(on),
        }
    }
}

impl BaseJoint<BodyId> {
    /// Pose of the base in the odom frame: x \[m\], y \[m\], yaw \[rad\].
    pub fn pose(&self, model: &Model, data: &Data) -> [f64; 3] {
        match *self {
            Self::Fixed => [0.0; 3],
            Self::Rail { on, axis_base } => along(&axis_base, data.q[model.qs(on).start]),
            Self::Planar(on) => std::array::from_fn(|k| data.q[model.qs(on).start + k]),
        }
    }

    /// Velocity of the base in the odom frame [m/s, m/s, rad/s].
    pub fn velocity(&self, model: &Model, data: &Data) -> [f64; 3] {
        match *self {
            Self::Fixed => [0.0; 3],
            Self::Rail { on, axis_base } => along(&axis_base, data.v[model.dofs(on).start]),
            Self::Planar(on) => std::array::from_fn(|k| data.v[model.dofs(on).start + k]),
        }
    }
}

fn along(axis: &Vec3, way: f64) -> [f64; 3] {
    [axis.x * way, axis.y * way, 0.0]
}

impl Steering {
    /// Returns the velocity nearest to a wanted one (base frame: forward [m/s], left [m/s], yaw rate [rad/s]) that the steering allows.
    pub fn allowed(&self, [forward, left, yaw_rate]: [f64; 3]) -> [f64; 3] {
        match self {
            Self::Holonomic => [forward, left, yaw_rate],
            Self::Differential => [forward, 0.0, yaw_rate],
            Self::Ackermann { turning_radius } => {
                let most = forward.abs() / turning_radius.si();
                [forward, 0.0, yaw_rate.clamp(-most, most)]
            }
        }
    }
}
