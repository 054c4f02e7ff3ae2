//! A robot driven by a person: base velocities, and velocities of the hand, which inverse kinematics turns into joint angles.

use orchard_geometry::{Pose, Rotation, Vec3};
use orchard_robot::{Command, JointValues, JointVector, Observation, RobotModel};

use crate::rules::JogRules;

/// Deflections of the controls, each -1 to 1; what lies outside counts as the end.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Wish {
    /// Base: forward, left, turn to the left.
    pub base: [f64; 3],
    /// Hand along the axes of the base frame: forward, left, up.
    pub hand: [f64; 3],
    /// Hand about its own axes: x, y, and z, its approach.
    pub turn: [f64; 3],
    /// True for a closed hand: fingers shut, or the valve of a suction cup open.
    pub closes: bool,
}

/// Steps of inverse kinematics a frame.
const STEPS: u32 = 4;

/// Set points of a robot that is driven by a person.
#[derive(Debug, Clone)]
pub struct Jog {
    /// Deflections of the controls.
    pub wish: Wish,
    rules: JogRules,
    q: JointVector,
    x_base_tcp: Pose,
    /// Deflections as they are obeyed: base, hand, turn. They follow the wished ones.
    obeyed: [f64; 9],
}

impl Jog {
    /// Takes the robot over as an observation finds it, at rest.
    pub fn begin(robot: &RobotModel, observation: &Observation, rules: &JogRules) -> Self {
        let q = robot.kinematics().clamped(&observation.arm_q.vector());
        let x_base_tcp = robot.kinematics().tcp(&q);
        Self { wish: Wish::default(), rules: rules.clone(), q, x_base_tcp, obeyed: [0.0; 9] }
    }

    /// Wished pose of the point between the fingers, base frame.
    pub fn x_base_tcp(&self) -> Pose {
        self.x_base_tcp
    }

    /// The command for the next frame of `dt` \[s\].
    pub fn act(&mut self, robot: &RobotModel, dt: f64) -> Command {
        let Wish { base, hand, turn, closes } = self.wish;
        let wished = base.into_iter().chain(hand).chain(turn);
        let change = dt / self.rules.rise.si();
        for (obeyed, wished) in self.obeyed.iter_mut().zip(wished) {
            let wished = if wished.is_finite() { wished.clamp(-1.0, 1.0) } else { 0.0 };
            *obeyed += (wished - *obeyed).clamp(-change, change);
        }
        let [forward, left, yaw, x, y, z, about_x, about_y, about_z] = self.obeyed;
        let step = Vec3::new(x, y, z) * (self.rules.hand_speed.si() * dt);
        let turned = Vec3::new(about_x, about_y, about_z) * (self.rules.hand_turn.si() * dt);
        let arm = robot.kinematics();
        let dof = arm.dof();
        let before = self.q;
        if step.norm() > 0.0 || turned.norm() > 0.0 {
            self.x_base_tcp.translation.vector += step;
            self.x_base_tcp.rotation *= Rotation::from_scaled_axis(turned);
            self.q = arm.follow(&self.x_base_tcp, &self.q, STEPS);
            let reached = arm.tcp(&self.q);
            if (reached.translation.vector - self.x_base_tcp.translation.vector).norm() > self.rules.lead.si()
            {
                self.x_base_tcp = reached;
            }
        }
        let (base_speed, base_turn) = (self.rules.base_speed.si(), self.rules.base_turn.si());
        Command {
            arm_q: JointValues::of(&self.q, dof),
            arm_v: JointValues::of(&((self.q - before) / dt), dof),
            base_velocity: [forward * base_speed, left * base_speed, yaw * base_turn],
            finger_q: if closes { 0.0 } else { arm.finger_stroke() },
            finger_force: arm.finger_force(),
            vacuum: if closes { 1.0 } else { 0.0 },
        }
    }
}

#[cfg(test)]
#[path = "jog_tests.rs"]
mod tests;
