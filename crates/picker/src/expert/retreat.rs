//! Retreat: bring the empty hand out of the canopy, back along the approach.

use crate::expert::onward::Onward;
use crate::expert::safe::Safe;
use crate::expert::{Caution, ExpertPicker, Next, Phase};
use crate::picker_core::Attempt;
use crate::record::{Alarm, State};
use crate::robot_state::RobotState;
use orchard_geometry::Vec3;

/// Memory of the retreat state.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Retreat {
    /// Time at which the fingers were commanded to open \[s\].
    since: f64,
    stage: Stage,
    /// Place to which the base drives meanwhile.
    onward: Option<Onward>,
    /// Time for which the base has drawn a caught arm out \[s\].
    drawn: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Stage {
    /// Waiting for the fingers, then going back along a direction of the base frame.
    Opening(Vec3),
    /// Going back along the approach.
    Back,
    /// Rising above the bucket, if the hand is in it.
    Up,
    /// Moving to the carrying posture.
    Home,
}

impl Retreat {
    /// Starts the retreat after a failure in a state: back along the approach if the hand is among branches.
    pub fn after_failure(state: State, attempt: Option<&Attempt>, robot: &RobotState) -> Self {
        let stage = match (state, attempt) {
            (State::Grasp | State::Pull, Some(attempt)) => Stage::Opening(-attempt.plan.direction()),
            (State::Deposit, _) => Stage::Up,
            _ => Stage::Home,
        };
        Self { since: robot.time, stage, onward: None, drawn: 0.0 }
    }
}

impl Retreat {
    /// Starts the retreat from the bucket; the arm already moves to the carrying posture.
    pub fn from_bucket(onward: Option<Onward>, robot: &RobotState) -> Self {
        Self { since: robot.time, stage: Stage::Home, onward, drawn: 0.0 }
    }
}

impl ExpertPicker {
    pub(crate) fn retreat(&mut self, mut retreat: Retreat, robot: &RobotState) -> Next {
        // In the bucket, open fingers would press on the fruit there.
        if !self.is_over_bucket(robot) {
            self.core.open_fingers();
        }
        match retreat.stage {
            Stage::Opening(direction) => {
                let open = self.core.fingers_are_open(robot);
                if open || robot.time - retreat.since >= self.config.place.open_time.si() {
                    self.withdraw(direction, Caution::High, robot);
                    retreat.stage = Stage::Back;
                }
            }
            Stage::Back if self.core.motion.is_over() => retreat.stage = Stage::Home,
            Stage::Back => {}
            Stage::Up => {
                self.leave_bucket(robot);
                retreat.stage = Stage::Home;
            }
            Stage::Home if self.has(Alarm::ArmLoaded) && !self.is_over_bucket(robot) => {
                // The arm is caught: it gives way, and the base draws it out.
                self.core.yield_arm(robot);
                retreat.drawn += robot.dt;
                if retreat.drawn > self.config.watch.wait.si() || self.is_blind(robot) {
                    return Next::Enter(Phase::Safe(Safe::at(robot)));
                }
                let speed = self.config.leave.base_speed.si() * self.speed_share(Caution::High);
                return Next::Stay(Phase::Retreat(retreat), [-speed, 0.0, 0.0]);
            }
            Stage::Home => {
                let carry = self.core.postures.carry();
                if *self.core.motion.goal() != carry {
                    self.swing_among(carry, Caution::High);
                }
                let near = (robot.q - carry).amax() <= self.config.swift.blend.si();
                if near || self.core.elapsed(robot) > self.core.config.timeout.transport.si() {
                    let wanted = retreat.onward.as_ref().map(|onward| onward.track);
                    return self.next_target(wanted, robot);
                }
            }
        }
        let velocity = self.drive_onward(&mut retreat.onward, robot);
        Next::Stay(Phase::Retreat(retreat), velocity)
    }
}
