//! Deposit: bring the fruit out of the canopy and above the bucket, lower it onto the floor or the pile, and let go.

use crate::expert::retreat::Retreat;
use crate::expert::slots::Slot;
use crate::expert::{ExpertPicker, Next, Phase};
use crate::motion::WayPoint;
use crate::picker_core::STILL;
use crate::record::{Alarm, AttemptEnd, FailureReason};
use crate::robot_state::RobotState;
use orchard_geometry::{Vec3, math};
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
    /// Length of the way down from above the bucket \[m\]; 0 before.
    way_down: f64,
    stage: Stage,
    /// Time for which a load on the arm has held it up \[s\].
    held_up: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Stage {
    /// Moving straight out of the canopy.
    Leaving,
    /// Swinging above the bucket.
    Swinging,
    /// Going straight down until the fruit lands.
    Lowering,
    /// Fingers opening since a time \[s\].
    Opening { since: f64 },
}

impl Deposit {
    pub fn leaving(robot: &RobotState, withdrawn: f64) -> Self {
        let [x, y, _] = robot.base_pose;
        Self { base_start: [x, y], withdrawn, press: 0.0, way_down: 0.0, stage: Stage::Leaving, held_up: 0.0 }
    }

    fn backed(&self, robot: &RobotState) -> f64 {
        math::hypot(robot.base_pose[0] - self.base_start[0], robot.base_pose[1] - self.base_start[1])
    }
}

impl ExpertPicker {
    pub(crate) fn deposit(&mut self, mut deposit: Deposit, robot: &RobotState) -> Next {
        let backed = deposit.backed(robot);
        let leave = &self.config.leave;
        let leave_distance = leave.distance.si();
        let backing = backed < leave.base_distance.si() && !self.is_blind(robot);
        let mut velocity = if backing { [-leave.base_speed.si(), 0.0, 0.0] } else { STILL };
        if let Stage::Opening { since } = deposit.stage {
            if robot.time - since < self.config.place.open_time.si() {
                return Next::Stay(Phase::Deposit(deposit), velocity);
            }
            return self.deposited(robot);
        }
        if !self.still_holds(robot) {
            if deposit.stage != Stage::Lowering {
                self.core.tell(Alarm::FruitLost, true, robot.time);
            }
            return Next::Fail(FailureReason::Slipped);
        }
        let Some(Slot { above, low, unsure }) = self.slots.next() else {
            return Next::Fail(FailureReason::MissedBucket);
        };
        if self.has(Alarm::ArmLoaded) {
            // It keeps the fruit, however long it lasts.
            self.core.restart_clock(robot);
            let may_draw = self.give_way(&mut deposit.held_up, robot);
            let velocity = if may_draw { self.draw_straight() } else { STILL };
            return Next::Stay(Phase::Deposit(deposit), velocity);
        }
        if deposit.held_up > 0.0 {
            let by_carry = (!self.is_over_bucket(robot)).then(|| self.by_carry());
            self.swing_through(by_carry.into_iter().chain([WayPoint { q: above, blend: 0.0 }]));
            (deposit.held_up, deposit.stage) = (0.0, Stage::Swinging);
        }
        if self.core.elapsed(robot) > self.core.config.timeout.transport.si() {
            return Next::Fail(FailureReason::MissedBucket);
        }
        let weight = self.config.feel.touch_weight.si();
        deposit.press -= (self.core.tcp_force(robot).z + deposit.press) * weight;
        if deposit.stage == Stage::Lowering {
            let landed = deposit.press > self.config.place.touch.si() || self.core.arm_stalled();
            if landed {
                // Stops the hand from pressing on the pile.
                self.core.yield_arm(robot);
            }
            if landed || self.core.motion.is_over() {
                return self.let_go(deposit, velocity, robot);
            }
            self.slow_down(deposit.way_down, unsure);
        }
        if self.core.arm_stalled() {
            return Next::Fail(FailureReason::Blocked);
        }
        if deposit.stage == Stage::Leaving {
            let direction = self.core.attempt.as_ref().map_or(Vec3::zeros(), |a| -a.plan.direction());
            let share = self.slip_out(&direction, self.config.leave.speed.si());
            velocity = velocity.map(|v| v * share);
            deposit.withdrawn = self.core.motion.travelled().unwrap_or(deposit.withdrawn);
            if self.core.motion.is_over() || deposit.withdrawn + backed >= leave_distance {
                self.core.motion.stop();
                self.swing_through([self.by_carry(), WayPoint { q: above, blend: 0.0 }]);
                deposit.stage = Stage::Swinging;
            }
        } else if self.core.motion.is_over() && (robot.q - above).amax() <= self.config.place.arrived.si() {
            deposit.way_down = self.lower_from(&above, &low);
            self.core.fingers.force = self.config.place.hold.si();
            (deposit.press, deposit.stage) = (0.0, Stage::Lowering);
        }
        Next::Stay(Phase::Deposit(deposit), velocity)
    }

    /// Starts the hand straight down from one posture to the height of another. Returns the length of the way \[m\].
    fn lower_from(&mut self, above: &JointVector, low: &JointVector) -> f64 {
        let height = |q: &JointVector| self.core.arm.tcp(q).translation.vector.z;
        let way = height(above) - height(low);
        let (arm, c) = (&self.core.config.arm, &self.config.place);
        self.core.motion.go_straight(&self.core.arm, -Vec3::z(), way, c.brisk.si(), arm);
        self.core.motion.set_line_acceleration(self.config.leave.acceleration.si());
        way
    }

    /// Limits the speed of the way down so that the hand is as slow as it lands once the fruit may touch something, `unsure` \[m\] earlier than at a place on known layers.
    fn slow_down(&mut self, way_down: f64, unsure: f64) {
        let c = &self.config.place;
        let travelled = self.core.motion.travelled().unwrap_or(way_down);
        let before = (way_down - c.near.si() - unsure - travelled).max(0.0);
        let (landing, braking) = (c.speed.si(), 2.0 * self.config.leave.acceleration.si() * before);
        let speed = (landing * landing + braking).sqrt().min(c.brisk.si().max(landing));
        self.core.motion.set_line_speed(speed);
    }

    fn let_go(&mut self, mut deposit: Deposit, base_velocity: [f64; 3], robot: &RobotState) -> Next {
        let c = &self.config.place;
        self.core.open_by(0.5 * robot.width + c.opening.si(), c.force.si());
        deposit.stage = Stage::Opening { since: robot.time };
        Next::Stay(Phase::Deposit(deposit), base_velocity)
    }

    /// Ends the attempt: the fruit is in the bucket, and the arm rises.
    fn deposited(&mut self, robot: &RobotState) -> Next {
        if let Some(attempt) = self.core.conclude(robot, AttemptEnd::Deposited) {
            self.core.blacklist.free_around(&attempt.target.p, self.config.homing.freed.si());
        }
        self.leave_bucket(robot);
        let height = |q: &JointVector| self.core.arm.tcp(q).translation.vector.z;
        let above_low = self.slots.next().map_or(0.0, |slot| height(&robot.q) - height(&slot.low));
        self.slots.fill(above_low);
        Next::Enter(Phase::Retreat(Retreat::from_bucket(robot)))
    }

    /// True if the hand is above or in the bucket.
    pub(crate) fn is_over_bucket(&self, robot: &RobotState) -> bool {
        self.slots.covers(&self.core.arm.tcp(&robot.q).translation.vector)
    }

    /// Starts the arm to the carrying posture, over the bucket's rim first if the hand is over the bucket.
    pub(crate) fn leave_bucket(&mut self, robot: &RobotState) {
        let in_bucket = self.is_over_bucket(robot);
        let over = self.slots.next().map(|slot| slot.above).filter(|_| in_bucket);
        let up = over.map(|q| WayPoint { q, blend: self.config.place.blend.si() });
        let carry = self.core.postures.carry();
        self.swing_through(up.into_iter().chain([WayPoint { q: carry, blend: 0.0 }]));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expert::ExpertConfig;
    use orchard_perception::DetectorConfig;
    use orchard_robot::RobotModel;

    /// On the way out of the canopy base and hand are the slower the harder the hand presses, and the hand gives way aside.
    #[test]
    fn the_way_out_is_slower_where_the_hand_presses() {
        let model = RobotModel::paper();
        let mut picker = ExpertPicker::new(&model, DetectorConfig::paper(), ExpertConfig::preset());
        picker.core.perception.blind = false;
        let robot = RobotState { q: picker.core.arm.home(), width: 0.06, ..RobotState::still(1.0) };
        let (most, band) = (picker.config.load.most.si(), picker.config.load.band.si());
        let least = picker.config.homing.pace_min.si();
        for (force, share) in [(0.0, 1.0), (most - 0.5 * band, 0.5), (2.0 * most, least)] {
            picker.force = Vec3::y() * force;
            let next = picker.deposit(Deposit::leaving(&robot, 0.0), &robot);
            let Next::Stay(_, velocity) = next else { panic!("it has left") };
            let full = picker.config.leave.base_speed.si();
            assert!((velocity[0] + share * full).abs() < 1e-12, "{force}: {velocity:?}");
        }
    }

    /// In the bucket the fingers open by little more than the fruit and with little force, and stay so until the hand has left it.
    #[test]
    fn fingers_open_little_in_the_bucket() {
        let model = RobotModel::paper();
        let mut picker = ExpertPicker::new(&model, DetectorConfig::paper(), ExpertConfig::preset());
        let low = picker.slots.next().expect("within reach").low;
        let in_bucket = RobotState { q: low, width: 0.06, ..RobotState::still(1.0) };
        let _ = picker.let_go(Deposit::leaving(&in_bucket, 0.0), STILL, &in_bucket);
        let (opening, force) = (picker.config.place.opening.si(), picker.config.place.force.si());
        let fingers = picker.core.fingers;
        assert!((fingers.opening - 0.03 - opening).abs() < 1e-12 && fingers.force == force);
        let _ = picker.retreat(Retreat::from_bucket(&in_bucket), &in_bucket);
        assert_eq!(picker.core.fingers, fingers);
        let outside = RobotState { q: picker.core.postures.carry(), ..in_bucket };
        let _ = picker.retreat(Retreat::from_bucket(&outside), &outside);
        assert_eq!(picker.core.fingers.opening, picker.core.config.grasp.opening.si());
    }
}
