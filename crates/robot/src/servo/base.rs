//! Velocity drive of the base.

use super::{Input, toward, write};
use crate::articulation::Limit;
use crate::base::BaseJoint;
use crate::braking::velocity_range;
use crate::config::{BaseDrive, Steering};
use nalgebra::Vector2;
use orchard_geometry::{Vec3, math};
use orchard_multibody::{BodyId, Data, Model};

/// Drive of a base.
#[derive(Debug, Clone, PartialEq)]
pub struct BaseServo {
    /// Steering.
    pub steering: Steering,
    /// Drive forward and aside \[m, N\].
    pub travel: VelocityDrive,
    /// Drive about the vertical [rad, N m].
    pub turn: VelocityDrive,
    /// Mass that the drive moves \[kg\].
    pub mass: f64,
    /// Yaw inertia that it turns [kg m^2].
    pub yaw_inertia: f64,
    /// Limits of the joint, for a base on a rail.
    pub rail: Option<Limit>,
}

/// A servo that holds a velocity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VelocityDrive {
    /// Effort for each unit of velocity that is missing.
    pub damping: f64,
    /// Largest effort.
    pub effort_max: f64,
    /// Largest velocity.
    pub speed_max: f64,
    /// Largest acceleration of the set point.
    pub acceleration_max: f64,
}

impl BaseServo {
    /// Makes the drive of a base that moves a mass \[kg\] with a yaw inertia [kg m^2].
    pub(super) fn new(config: &BaseDrive, mass: f64, yaw_inertia: f64, rail: Option<Limit>) -> Self {
        Self {
            steering: config.steering.clone(),
            travel: VelocityDrive {
                damping: config.damping.si(),
                effort_max: config.force_max.si(),
                speed_max: config.speed_max.si(),
                acceleration_max: config.acceleration_max.si(),
            },
            turn: VelocityDrive {
                damping: config.turn_damping.si(),
                effort_max: config.torque_max.si(),
                speed_max: config.turn_speed_max.si(),
                acceleration_max: config.turn_acceleration_max.si(),
            },
            mass,
            yaw_inertia,
            rail,
        }
    }

    /// Moves the velocity set point `set` (base frame: forward, left, yaw rate) towards the commanded one and sets the forces of the next
    /// substep of length `h` \[s\].
    pub(super) fn apply(
        &self,
        model: &Model,
        data: &mut Data,
        joint: &BaseJoint<BodyId>,
        set: &mut [f64; 3],
        command: &[f64; 3],
        h: f64,
    ) {
        // A command that is not finite leaves the set point as it is.
        let command = Some(command).filter(|command| command.iter().all(|v| v.is_finite()));
        match *joint {
            BaseJoint::Fixed => {}
            BaseJoint::Planar(on) => {
                if let Some(command) = command {
                    self.steer(set, self.steering.allowed(*command), h);
                }
                self.drive(model, data, on, set, h);
            }
            BaseJoint::Rail { on, axis_base } => {
                let wanted = command.map(|[forward, left, _]| forward * axis_base.x + left * axis_base.y);
                self.slide(model, data, on, &axis_base, set, wanted, h);
            }
        }
    }

    fn steer(&self, set: &mut [f64; 3], [x, y, yaw]: [f64; 3], h: f64) {
        let Self { travel, turn, .. } = self;
        let step = travel.acceleration_max * h;
        let wanted = Vector2::new(x, y).map(|v| v.clamp(-travel.speed_max, travel.speed_max));
        let now = Vector2::new(set[0], set[1]);
        let next = now + (wanted - now).cap_magnitude(step);
        let yaw = yaw.clamp(-turn.speed_max, turn.speed_max);
        let yaw_rate = toward(set[2], yaw, turn.acceleration_max * h);
        *set = self.steering.allowed([next.x, next.y, yaw_rate]);
    }

    fn drive(&self, model: &Model, data: &mut Data, on: BodyId, set: &[f64; 3], h: f64) {
        let Self { travel, turn, .. } = self;
        let (dof, yaw) = (model.dofs(on).start, data.q[model.qs(on).start + 2]);
        let (sin, cos) = math::sin_cos(yaw);
        let [forward, left, yaw_rate] = *set;
        // The planar joint's x and y are along axes of odom; the set point is in the base frame.
        let set = Vector2::new(cos * forward - sin * left, sin * forward + cos * left);
        let now = Vector2::new(data.v[dof], data.v[dof + 1]);
        // The force is constant over the substep, so that a collision within it meets no more than the bound.
        let force = (set - now) * (travel.damping / (1.0 + h * travel.damping / self.mass));
        let force = force.cap_magnitude(travel.effort_max);
        let factor = turn.damping / (1.0 + h * turn.damping / self.yaw_inertia);
        let torque = ((yaw_rate - data.v[dof + 2]) * factor).clamp(-turn.effort_max, turn.effort_max);
        for (k, effort) in [force.x, force.y, torque].into_iter().enumerate() {
            write(data, dof + k, Input::constant(effort));
        }
    }

    #[expect(clippy::too_many_arguments, reason = "a world's model and state, and one substep's inputs")]
    fn slide(
        &self,
        model: &Model,
        data: &mut Data,
        on: BodyId,
        axis: &Vec3,
        set: &mut [f64; 3],
        wanted: Option<f64>,
        h: f64,
    ) {
        let travel = &self.travel;
        let (dof, q) = (model.dofs(on).start, data.q[model.qs(on).start]);
        let mut speed = set[0] * axis.x + set[1] * axis.y;
        if let Some(wanted) = wanted {
            let limit = self.rail.unwrap_or(Limit::NONE);
            let limit = Limit { velocity: limit.velocity.min(travel.speed_max), ..limit };
            let (slowest, fastest) = velocity_range(q, speed, &limit, travel.acceleration_max, h);
            speed = wanted.max(slowest).min(fastest);
            *set = [axis.x * speed, axis.y * speed, 0.0];
        }
        let force = (speed - data.v[dof]) * (travel.damping / (1.0 + h * travel.damping / self.mass));
        write(data, dof, Input::constant(force.clamp(-travel.effort_max, travel.effort_max)));
    }
}
