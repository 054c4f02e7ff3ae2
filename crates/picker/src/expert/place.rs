//! Deposit: bring the fruit out of the canopy and above the bucket, lower it onto the floor or the pile, and let go.

use crate::expert::retreat::Retreat;
use crate::expert::{ExpertPicker, Next, Phase};
use crate::motion::WayPoint;
use crate::picker_core::STILL;
use crate::record::{AttemptEnd, FailureReason};
use crate::robot_state::RobotState;
use orchard_geometry::math;
use orchard_robot::JointVector;

/// Memory of the deposit state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Deposit {
    /// Position of the base when the stem broke, odom \[m\].
    base_start: [f64; 2],
    /// Withdrawal of the hand so far \[m\].
    withdrawn: f64,
    /// Smoothed force with which the hand presses down \[N\].
    press: f64,
    stage: Stage,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Stage {
    /// Moving straight out of the canopy.
    Leaving,
    /// Swinging above the bucket and lowering.
    Swinging,
    /// Fingers opening since a time \[s\].
    Opening { since: f64 },
}

impl Deposit {
    pub fn leaving(robot: &RobotState, withdrawn: f64) -> Self {
        let [x, y, _] = robot.base_pose;
        Self { base_start: [x, y], withdrawn, press: 0.0, stage: Stage::Leaving }
    }

    fn backed(&self, robot: &RobotState) -> f64 {
        math::hypot(robot.base_pose[0] - self.base_start[0], robot.base_pose[1] - self.base_start[1])
    }
}

impl ExpertPicker {
    pub(crate) fn deposit(&mut self, mut deposit: Deposit, robot: &RobotState) -> Next {
        let backed = deposit.backed(robot);
        let leave = &self.config.leave;
        let backing = backed < leave.base_distance.si() && !self.is_blind(robot);
        let velocity = if backing { [-leave.base_speed.si(), 0.0, 0.0] } else { STILL };
        if let Stage::Opening { since } = deposit.stage {
            if robot.time - since < self.config.place.open_time.si() {
                return Next::Stay(Phase::Deposit(deposit), velocity);
            }
            return self.deposited(robot);
        }
        if !self.still_holds(robot) {
            return Next::Fail(FailureReason::Slipped);
        }
        let Some([above, low]) = self.slots.next() else {
            return Next::Fail(FailureReason::MissedBucket);
        };
        if self.core.elapsed(robot) > self.core.config.timeout.transport.si() {
            return Next::Fail(FailureReason::MissedBucket);
        }
        let weight = self.core.config.pull.tension_weight.si();
        deposit.press -= (self.core.tcp_force(robot).z + deposit.press) * weight;
        if deposit.stage == Stage::Swinging && self.landed(&deposit, [&above, &low], robot) {
            // Stops the hand from pressing on the pile.
            self.core.yield_arm(robot);
            return self.let_go(deposit, velocity, robot);
        }
        if self.core.arm_stalled() {
            return Next::Fail(FailureReason::Blocked);
        }
        if deposit.stage == Stage::Leaving {
            deposit.withdrawn = self.core.motion.travelled().unwrap_or(deposit.withdrawn);
            if self.core.motion.is_over() || deposit.withdrawn + backed >= leave.distance.si() {
                let over = WayPoint { q: above, blend: self.config.place.blend.si() };
                self.core.motion.stop();
                self.swing_through([self.by_carry(), over, WayPoint { q: low, blend: 0.0 }]);
                deposit.stage = Stage::Swinging;
            }
        } else if self.core.motion.is_over() && (robot.q - low).amax() <= self.config.place.arrived.si() {
            return self.let_go(deposit, velocity, robot);
        }
        Next::Stay(Phase::Deposit(deposit), velocity)
    }

    /// True if the fruit has landed on floor or pile: in the lower half of the descent, where the arm only brakes, something holds the hand
    /// up.
    fn landed(&self, deposit: &Deposit, [above, low]: [&JointVector; 2], robot: &RobotState) -> bool {
        let height = |q: &JointVector| self.core.arm.tcp(q).translation.vector.z;
        let in_bucket = height(&robot.q) < 0.5 * (height(above) + height(low));
        in_bucket && (deposit.press > self.config.place.touch.si() || self.core.arm_stalled())
    }

    fn let_go(&mut self, mut deposit: Deposit, base_velocity: [f64; 3], robot: &RobotState) -> Next {
        let opening = self.config.place.opening.si();
        self.core.open_by(opening);
        deposit.stage = Stage::Opening { since: robot.time };
        Next::Stay(Phase::Deposit(deposit), base_velocity)
    }

    /// Ends the attempt: the fruit is in the bucket, and the arm rises.
    fn deposited(&mut self, robot: &RobotState) -> Next {
        self.core.conclude(robot, AttemptEnd::Deposited);
        self.core.open_fingers();
        self.leave_bucket(robot);
        self.slots.fill();
        Next::Enter(Phase::Retreat(Retreat::from_bucket(robot)))
    }

    /// Starts the arm to the carrying posture, over the bucket's rim first if the hand is over the bucket.
    pub(crate) fn leave_bucket(&mut self, robot: &RobotState) {
        let in_bucket = self.slots.covers(&self.core.arm.tcp(&robot.q).translation.vector);
        let over = self.slots.next().map(|[above, _]| above).filter(|_| in_bucket);
        let up = over.map(|q| WayPoint { q, blend: self.config.place.blend.si() });
        let carry = self.core.postures.carry();
        self.swing_through(up.into_iter().chain([WayPoint { q: carry, blend: 0.0 }]));
    }
}
