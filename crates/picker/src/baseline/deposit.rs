//! Deposit: over the bucket and let go. Retreat: the empty hand out of the canopy.

use crate::baseline::{BaselinePicker, Next, Phase};
use crate::record::{AttemptEnd, FailureReason, State};
use crate::rig::{Attempt, STILL};
use crate::robot_state::RobotState;
use crate::scan::Scan;
use orchard_geometry::Vec3;

/// Memory of the deposit state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Deposit {
    /// To the carrying posture.
    Carrying,
    /// Round to over the bucket.
    Swinging,
    /// Down into it.
    Lowering,
    /// Fingers opening since a time.
    Opening { since: f64 },
}

/// Memory of the retreat state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Retreat {
    /// Time at which the fingers were told to open.
    since: f64,
    stage: Withdrawal,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Withdrawal {
    /// Wait for the fingers, then go back along a direction of the base frame.
    Back(Vec3),
    /// Going back.
    GoingBack,
    /// Up from the bucket.
    Up,
    /// To the carrying posture.
    Home,
}

impl Retreat {
    /// Out of the canopy after a failure in a state: back along the approach where the hand is among branches.
    pub fn after_failure(state: State, attempt: Option<&Attempt>, robot: &RobotState) -> Self {
        let stage = match (state, attempt) {
            (State::Grasp | State::Pull, Some(attempt)) => Withdrawal::Back(-attempt.plan.direction()),
            _ => Withdrawal::Home,
        };
        Self { since: robot.time, stage }
    }

    fn from_bucket(robot: &RobotState) -> Self {
        Self { since: robot.time, stage: Withdrawal::Up }
    }
}

impl BaselinePicker {
    pub(crate) fn deposit(&mut self, deposit: Deposit, robot: &RobotState) -> Next {
        let c = self.rig.config.deposit.clone();
        let stay = |deposit| Next::Stay(Phase::Deposit(deposit), STILL);
        if let Deposit::Opening { since } = deposit {
            if robot.time - since < c.open_time.si() {
                return stay(deposit);
            }
            self.rig.conclude(robot, AttemptEnd::Deposited);
            return Next::Enter(Phase::Retreat(Retreat::from_bucket(robot)));
        }
        if !self.rig.holds_fruit(robot) {
            return Next::Fail(FailureReason::Slipped);
        }
        let Some([above, low]) = self.rig.postures.bucket else {
            return Next::Fail(FailureReason::MissedBucket);
        };
        if self.rig.elapsed(robot) > self.rig.config.timeout.transport.si() {
            return Next::Fail(FailureReason::MissedBucket);
        }
        if self.rig.arm_stalled() {
            return Next::Fail(FailureReason::Blocked);
        }
        if !self.rig.motion.is_over() {
            return stay(deposit);
        }
        match deposit {
            // No need to stop exactly at the way-points.
            Deposit::Carrying => {
                self.rig.motion.go(above, &self.rig.config.arm, 1.0);
                stay(Deposit::Swinging)
            }
            Deposit::Swinging => {
                self.rig.motion.go(low, &self.rig.config.arm, 1.0);
                stay(Deposit::Lowering)
            }
            Deposit::Lowering | Deposit::Opening { .. } => {
                let off = self.rig.arm.tcp(&robot.q).translation.vector - self.rig.postures.p_bucket;
                let centred = off.xy().norm() <= c.centred.si();
                if !(self.rig.arm_arrived(robot) && centred && robot.v.amax() <= c.slow.si()) {
                    return stay(deposit);
                }
                self.rig.open_fingers();
                stay(Deposit::Opening { since: robot.time })
            }
        }
    }

    pub(crate) fn retreat(&mut self, mut retreat: Retreat, robot: &RobotState) -> Next {
        self.rig.open_fingers();
        let (back, open_time) = (self.rig.config.approach.look.si(), self.rig.config.deposit.open_time.si());
        match retreat.stage {
            Withdrawal::Back(direction) => {
                if robot.time - retreat.since >= open_time {
                    // What the hand touches may have held it off its command: start from where it is.
                    self.rig.motion = crate::motion::ArmMotion::new(self.rig.arm.clamped(&robot.q));
                    let speed = self.rig.config.arm.approach_speed.si();
                    self.rig.motion.go_straight(&self.rig.arm, direction, back, speed, &self.rig.config.arm);
                    retreat.stage = Withdrawal::GoingBack;
                }
            }
            Withdrawal::GoingBack if self.rig.motion.is_over() => retreat.stage = Withdrawal::Home,
            Withdrawal::GoingBack => {}
            Withdrawal::Up => {
                if let Some([above, _]) = self.rig.postures.bucket
                    && *self.rig.motion.goal() != above
                {
                    self.rig.motion.go(above, &self.rig.config.arm, 1.0);
                }
                // The rest of the way back leads over the robot itself: the base may move meanwhile.
                if self.rig.motion.is_over() {
                    return Next::Enter(Phase::Scan(Scan::here()));
                }
            }
            Withdrawal::Home => {
                let carry = self.rig.postures.carry();
                if *self.rig.motion.goal() != carry {
                    self.rig.motion.go(carry, &self.rig.config.arm, 1.0);
                }
                let patience = self.rig.config.timeout.transport.si();
                if self.rig.arm_arrived(robot) || self.rig.elapsed(robot) > patience {
                    return Next::Enter(Phase::Scan(Scan::here()));
                }
            }
        }
        Next::Stay(Phase::Retreat(retreat), STILL)
    }
}
