//! Retreat: the empty hand out of the canopy, the way it came.

use crate::expert::{Care, ExpertPicker, Next, Phase};
use crate::record::State;
use crate::rig::{Attempt, STILL};
use crate::robot_state::RobotState;
use orchard_geometry::Vec3;

/// Memory of the retreat state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Retreat {
    /// Time at which the fingers were told to open.
    since: f64,
    stage: Stage,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Stage {
    /// Wait for the fingers, then go back along a direction of the base frame.
    Opening(Vec3),
    /// Going back.
    Back,
    /// Over the bucket, if the hand is in it.
    Up,
    /// To the carrying posture.
    Home,
}

impl Retreat {
    /// After a failure in a state: back along the approach where the hand is among branches.
    pub fn after_failure(state: State, attempt: Option<&Attempt>, robot: &RobotState) -> Self {
        let stage = match (state, attempt) {
            (State::Grasp | State::Pull, Some(attempt)) => Stage::Opening(-attempt.plan.direction()),
            (State::Deposit, _) => Stage::Up,
            _ => Stage::Home,
        };
        Self { since: robot.time, stage }
    }
}

impl Retreat {
    /// From the bucket; the arm is on its way to the carrying posture.
    pub fn from_bucket(robot: &RobotState) -> Self {
        Self { since: robot.time, stage: Stage::Home }
    }
}

impl ExpertPicker {
    pub(crate) fn retreat(&mut self, mut retreat: Retreat, robot: &RobotState) -> Next {
        self.rig.open_fingers();
        match retreat.stage {
            Stage::Opening(direction) => {
                let open = self.rig.fingers_are_open(robot);
                if open || robot.time - retreat.since >= self.config.place.open_time.si() {
                    self.withdraw(direction, robot);
                    retreat.stage = Stage::Back;
                }
            }
            Stage::Back if self.rig.motion.is_over() => retreat.stage = Stage::Home,
            Stage::Back => {}
            Stage::Up => {
                self.leave_bucket(robot);
                retreat.stage = Stage::Home;
            }
            Stage::Home => {
                let carry = self.rig.postures.carry();
                if *self.rig.motion.goal() != carry {
                    self.swing_among(carry, Care::Much);
                }
                let near = (robot.q - carry).amax() <= self.config.swift.blend.si();
                if near || self.rig.elapsed(robot) > self.rig.config.timeout.transport.si() {
                    return self.next_target(robot);
                }
            }
        }
        Next::Stay(Phase::Retreat(retreat), STILL)
    }
}
