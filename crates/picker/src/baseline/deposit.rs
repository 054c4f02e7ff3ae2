//! Deposit: carry the fruit above the bucket and let go. Retreat: bring the empty hand out of the canopy.

use crate::baseline::{BaselinePicker, Next, Phase};
use crate::picker_core::{Attempt, STILL};
use crate::record::{AttemptEnd, FailureReason, State};
use crate::robot_state::RobotState;
use crate::scan::Scan;
use orchard_geometry::Vec3;

/// Memory of the deposit state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Deposit {
    /// Moving to the carrying posture.
    Carrying,
    /// Swinging round to above the bucket.
    Swinging,
    /// Lowering into the bucket.
    Lowering,
    /// Fingers opening since a time \[s\].
    Opening { since: f64 },
}

/// Memory of the retreat state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Retreat {
    /// Time at which the fingers were commanded to open \[s\].
    since: f64,
    stage: Withdrawal,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Withdrawal {
    /// Waiting for the fingers, then going back along a direction of the base frame.
    Back(Vec3),
    /// Going back along the approach.
    GoingBack,
    /// Rising from the bucket.
    Up,
    /// Moving to the carrying posture.
    Home,
}

impl Retreat {
    /// Starts the retreat after a failure in a state: back along the approach if the hand is among branches.
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
        let c = self.core.config.deposit.clone();
        let stay = |deposit| Next::Stay(Phase::Deposit(deposit), STILL);
        if let Deposit::Opening { since } = deposit {
            if robot.time - since < c.open_time.si() {
                return stay(deposit);
            }
            self.core.conclude(robot, AttemptEnd::Deposited);
            return Next::Enter(Phase::Retreat(Retreat::from_bucket(robot)));
        }
        if !self.core.holds_fruit(robot) {
            return Next::Fail(FailureReason::Slipped);
        }
        let Some([above, low]) = self.core.postures.bucket else {
            return Next::Fail(FailureReason::MissedBucket);
        };
        if self.core.elapsed(robot) > self.core.config.timeout.transport.si() {
            return Next::Fail(FailureReason::MissedBucket);
        }
        if self.core.arm_stalled() {
            return Next::Fail(FailureReason::Blocked);
        }
        if !self.core.motion.is_over() {
            return stay(deposit);
        }
        match deposit {
            // The arm need not arrive exactly at the way-points.
            Deposit::Carrying => {
                self.core.motion.go(above, &self.core.config.arm, 1.0);
                stay(Deposit::Swinging)
            }
            Deposit::Swinging => {
                self.core.motion.go(low, &self.core.config.arm, 1.0);
                stay(Deposit::Lowering)
            }
            Deposit::Lowering | Deposit::Opening { .. } => {
                let off = self.core.arm.tcp(&robot.q).translation.vector - self.core.postures.p_bucket;
                let centred = off.xy().norm() <= c.centred.si();
                if !(self.core.arm_arrived(robot) && centred && robot.v.amax() <= c.slow.si()) {
                    return stay(deposit);
                }
                self.core.open_fingers();
                stay(Deposit::Opening { since: robot.time })
            }
        }
    }

    pub(crate) fn retreat(&mut self, mut retreat: Retreat, robot: &RobotState) -> Next {
        self.core.open_fingers();
        let (back, open_time) =
            (self.core.config.approach.look.si(), self.core.config.deposit.open_time.si());
        match retreat.stage {
            Withdrawal::Back(direction) => {
                if robot.time - retreat.since >= open_time {
                    // An obstacle may have held the hand off its command, so the motion starts at its actual posture.
                    self.core.motion = crate::motion::ArmMotion::new(self.core.arm.clamped(&robot.q));
                    let speed = self.core.config.arm.approach_speed.si();
                    self.core.motion.go_straight(
                        &self.core.arm,
                        direction,
                        back,
                        speed,
                        &self.core.config.arm,
                    );
                    retreat.stage = Withdrawal::GoingBack;
                }
            }
            Withdrawal::GoingBack if self.core.motion.is_over() => retreat.stage = Withdrawal::Home,
            Withdrawal::GoingBack => {}
            Withdrawal::Up => {
                if let Some([above, _]) = self.core.postures.bucket
                    && *self.core.motion.goal() != above
                {
                    self.core.motion.go(above, &self.core.config.arm, 1.0);
                }
                // The rest of the motion leads over the robot itself: the base may move meanwhile.
                if self.core.motion.is_over() {
                    return Next::Enter(Phase::Scan(Scan::here()));
                }
            }
            Withdrawal::Home => {
                let carry = self.core.postures.carry();
                if *self.core.motion.goal() != carry {
                    self.core.motion.go(carry, &self.core.config.arm, 1.0);
                }
                let patience = self.core.config.timeout.transport.si();
                if self.core.arm_arrived(robot) || self.core.elapsed(robot) > patience {
                    return Next::Enter(Phase::Scan(Scan::here()));
                }
            }
        }
        Next::Stay(Phase::Retreat(retreat), STILL)
    }
}
