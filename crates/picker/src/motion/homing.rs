//! The hand's way onto a fruit: sideways first, then straight along the approach; the goal may be corrected on the way.

use crate::expert::HomingConfig;
use crate::motion::stopping_speed;
use orchard_geometry::{Pose, Vec3};
use orchard_robot::{ArmKinematics, IkTarget, JointVector};

/// Distance from the goal at which the hand is there [m]: what the inverse kinematics leaves.
const ARRIVED: f64 = 1e-3;

/// On the way to a pose of the TCP, base frame.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Homing {
    x_goal: Pose,
    /// Velocity of the TCP [m/s].
    v: Vec3,
    speed: f64,
    lateral_speed: f64,
    lateral_tolerance: f64,
    acceleration: f64,
    /// The last stretch before the goal, on which the hand goes straight [m].
    straight: f64,
    branch_jump: f64,
    over: bool,
}

impl Homing {
    pub fn new(x_goal: Pose, config: &HomingConfig, branch_jump: f64) -> Self {
        Self {
            x_goal,
            v: Vec3::zeros(),
            speed: config.speed.si(),
            lateral_speed: config.lateral_speed.si(),
            lateral_tolerance: config.lateral_tolerance.si(),
            acceleration: config.acceleration.si(),
            straight: config.straight.si(),
            branch_jump,
            over: false,
        }
    }

    pub fn correct(&mut self, x_goal: Pose) {
        self.x_goal = x_goal;
    }

    pub fn is_over(&self) -> bool {
        self.over
    }

    /// The posture after `dt` [s]; `None` where none continues the last.
    pub fn step(&mut self, arm: &ArmKinematics, q: &JointVector, dt: f64) -> Option<JointVector> {
        let p = arm.tcp(q).translation.vector;
        let z = self.x_goal.rotation * Vec3::z();
        let left = self.x_goal.translation.vector - p;
        let along = left.dot(&z);
        let lateral = left - z * along;
        let stop = |distance: f64| stopping_speed(self.acceleration, distance, dt);
        let off = lateral.norm();
        let sideways = self.lateral_speed.min(stop(off));
        let mut forward = self.speed.min(stop(along.abs())) * along.signum();
        if off > self.lateral_tolerance {
            // What is left before the straight stretch lasts as long as the way sideways.
            let time = off / self.lateral_speed;
            forward = forward.min((along - self.straight).max(0.0) / time);
        }
        let aside = if off > 0.0 { lateral * (sideways / off) } else { Vec3::zeros() };
        let change = (z * forward + aside - self.v).cap_magnitude(self.acceleration * dt);
        self.v += change;
        self.over = left.norm() <= ARRIVED;
        let p_next = if self.over { self.x_goal.translation.vector } else { p + self.v * dt };
        let target = IkTarget::Pose(Pose::from_parts(p_next.into(), self.x_goal.rotation));
        arm.solve_near(&target, q).ok().filter(|next| (next - q).amax() <= self.branch_jump)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expert::ExpertConfig;
    use orchard_robot::RobotModel;

    /// From beside the line the hand comes onto it before the straight stretch, then arrives.
    #[test]
    fn the_last_stretch_is_straight() {
        let (robot, config) = (RobotModel::paper(), ExpertConfig::preset());
        let arm = robot.kinematics();
        let mut q = arm.home();
        let x_start = arm.tcp(&q);
        let offset = x_start.rotation * Vec3::new(0.03, -0.02, 0.22);
        let x_goal = Pose::from_parts((x_start.translation.vector + offset).into(), x_start.rotation);
        let c = &config.homing;
        let mut homing = Homing::new(x_goal, c, config.shared.arm.branch_jump.si());
        let z = x_goal.rotation * Vec3::z();
        let (dt, mut frames) = (1.0 / 60.0, 0);
        while !homing.is_over() && frames < 600 {
            q = homing.step(arm, &q, dt).expect("within reach");
            frames += 1;
            let left = x_goal.translation.vector - arm.tcp(&q).translation.vector;
            let along = left.dot(&z);
            // The hand brakes over a few frames after it has come onto the line.
            if along < 0.8 * c.straight.si() {
                assert!((left - z * along).norm() <= 2.0 * c.lateral_tolerance.si(), "{along} {left}");
            }
        }
        // A trapezoid over the way at both speeds, and the way sideways at worst before it.
        assert!(homing.is_over() && f64::from(frames) * dt < 2.0, "{frames}");
        assert!((arm.tcp(&q).translation.vector - x_goal.translation.vector).norm() < 2.0 * ARRIVED);
    }
}
