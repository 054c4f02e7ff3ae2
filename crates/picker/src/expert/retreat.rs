//! Retreat: bring the empty hand out of the canopy, back along the approach.

use crate::drive::StallWatch;
use crate::expert::safe::Safe;
use crate::expert::{Caution, ExpertPicker, Next, Phase};
use crate::picker_core::{Attempt, STILL};
use crate::record::{Alarm, State};
use crate::robot_state::RobotState;
use orchard_geometry::Vec3;

/// Memory of the retreat state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Retreat {
    /// Time at which the fingers were commanded to open \[s\].
    since: f64,
    stage: Stage,
    /// Time for which the base has drawn a caught arm out \[s\].
    drawn: f64,
    /// Way that the base goes back as it came, until something holds it \[m\].
    left: f64,
    stall: StallWatch,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Stage {
    /// Waiting for the fingers, then going back along a direction of the base frame.
    Opening(Vec3),
    /// Going back along that direction.
    Back(Vec3),
    /// Rising above the bucket, if the hand is in it.
    Up,
    /// Moving to the carrying posture.
    Home,
}

impl Retreat {
    /// Starts the retreat after a failure in a state: back along the approach if the hand is among branches, and `way_back` \[m\] on the base's trail if it drove.
    pub fn after_failure(state: State, attempt: Option<&Attempt>, way_back: f64, robot: &RobotState) -> Self {
        let stage = match (state, attempt) {
            (State::Grasp | State::Pull, Some(attempt)) => Stage::Opening(-attempt.plan.direction()),
            (State::Deposit, _) => Stage::Up,
            _ => Stage::Home,
        };
        Self::of(stage, if state == State::Align { way_back } else { 0.0 }, robot)
    }

    /// Starts the retreat from a contact while the robot looks around; the base goes `way_back` \[m\] on its trail.
    pub fn from_contact(way_back: f64, robot: &RobotState) -> Self {
        Self::of(Stage::Home, way_back, robot)
    }

    /// Starts the retreat from the bucket; the arm already moves to the carrying posture.
    pub fn from_bucket(robot: &RobotState) -> Self {
        Self::of(Stage::Home, 0.0, robot)
    }

    fn of(stage: Stage, left: f64, robot: &RobotState) -> Self {
        Self { since: robot.time, stage, drawn: 0.0, left, stall: StallWatch::default() }
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
                    self.withdraw(direction, robot);
                    retreat.stage = Stage::Back(direction);
                }
            }
            Stage::Back(_) if self.core.motion.is_over() => retreat.stage = Stage::Home,
            Stage::Back(direction) => {
                self.slip_out(&direction, self.core.config.arm.approach_speed.si());
            }
            Stage::Up => {
                self.leave_bucket(robot);
                retreat.stage = Stage::Home;
            }
            Stage::Home if self.has(Alarm::ArmLoaded) && !self.is_over_bucket(robot) => {
                if !self.give_way(&mut retreat.drawn, robot) {
                    return Next::Enter(Phase::Safe(Safe::at(robot)));
                }
                return Next::Stay(Phase::Retreat(retreat), self.draw_out(robot));
            }
            Stage::Home => {
                let may_draw = retreat.drawn <= self.config.watch.draw.si() && self.is_pressed();
                if may_draw && !self.is_over_bucket(robot) && self.give_way(&mut retreat.drawn, robot) {
                    return Next::Stay(Phase::Retreat(retreat), self.draw_out(robot));
                }
                let carry = self.core.postures.carry();
                if self.is_stopped() && !self.is_over_bucket(robot) {
                    // It does not press on what it cannot pass.
                    self.core.yield_arm(robot);
                } else if *self.core.motion.goal() != carry {
                    self.swing_among(carry, Caution::High);
                }
                let back = self.go_back(&mut retreat.left, robot);
                let (drive, patience) = (&self.core.config.drive, self.core.patience());
                if retreat.stall.is_stalled(robot, &back.unwrap_or(STILL), drive, patience) {
                    retreat.left = 0.0;
                }
                let near = (robot.q - carry).amax() <= self.config.swift.blend.si() && back.is_none();
                if near || self.core.elapsed(robot) > self.core.config.timeout.transport.si() {
                    return self.next_target(robot);
                }
                return Next::Stay(Phase::Retreat(retreat), back.unwrap_or(STILL));
            }
        }
        Next::Stay(Phase::Retreat(retreat), STILL)
    }

    /// Velocity at which the base draws out an arm that gives way: back as it came, or straight at the end of its trail [m/s, m/s, rad/s].
    fn draw_out(&mut self, robot: &RobotState) -> [f64; 3] {
        let mut left = f64::INFINITY;
        self.go_back(&mut left, robot).unwrap_or_else(|| self.draw_straight())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expert::ExpertConfig;
    use crate::scan::Scan;
    use orchard_perception::DetectorConfig;
    use orchard_robot::RobotModel;

    /// An arm that is pressed on its way home gives way while the base draws it out, for some time at most; then it folds.
    #[test]
    fn an_arm_that_is_pressed_gives_way() {
        let model = RobotModel::paper();
        let mut picker = ExpertPicker::new(&model, DetectorConfig::paper(), ExpertConfig::preset());
        let mut robot = RobotState { q: picker.core.arm.home(), dt: 1.0 / 60.0, ..RobotState::still(0.0) };
        let most = picker.config.watch.draw.si();
        picker.core.perception.blind = false;
        for force in [0.5, 1.5].map(|share| Vec3::x() * (share * picker.config.feel.touch_max.si())) {
            picker.force = force;
            let mut retreat = Retreat::after_failure(State::Reach, None, 0.0, &robot);
            let (mut gave_way, steps) = (0, (2.0 * most / robot.dt) as usize);
            for _ in 0..steps {
                robot.time += robot.dt;
                let next = picker.retreat(retreat, &robot);
                let Next::Stay(Phase::Retreat(after), velocity) = next else { break };
                gave_way += usize::from(velocity[0] < 0.0 && picker.core.motion.is_over());
                retreat = after;
            }
            let time = gave_way as f64 * robot.dt;
            if picker.is_pressed() {
                assert!(time > 0.5 * most && time < most + 0.1, "{time}");
                assert!(!picker.core.motion.is_over(), "it folds in the end");
            } else {
                assert_eq!(gave_way, 0);
            }
        }
    }

    /// A hard contact ends looking around: the base does not drive on, and the arm goes home.
    #[test]
    fn a_contact_ends_the_scan() {
        let model = RobotModel::paper();
        let mut picker = ExpertPicker::new(&model, DetectorConfig::paper(), ExpertConfig::preset());
        let robot = RobotState { q: picker.core.arm.home(), dt: 1.0 / 60.0, ..RobotState::still(1.0) };
        for (share, stops) in [(0.9, false), (1.1, true)] {
            picker.force = Vec3::x() * (share * picker.config.feel.drive_max.si());
            let next = picker.scan(Scan::here(), &robot);
            assert_eq!(matches!(next, Next::Enter(Phase::Retreat(_))), stops, "{share}");
        }
    }
}
