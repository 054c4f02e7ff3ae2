//! Faults: what the expert does about the alarms of its watch. Safe: stand still with the arm folded until they are over.

use crate::expert::{Caution, ExpertPicker, Next, Phase};
use crate::picker_core::STILL;
use crate::record::{Alarm, FailureReason, State};
use crate::robot_state::RobotState;
use crate::scan::Scan;

/// Memory of the safe state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Safe {
    /// Time since which the hand has rested \[s\].
    since: f64,
    /// Time at which the fingers were commanded to close, for a test \[s\].
    testing: Option<f64>,
}

impl Safe {
    pub fn at(robot: &RobotState) -> Self {
        Self { since: robot.time, testing: None }
    }
}

impl ExpertPicker {
    /// True while an alarm lasts.
    pub(crate) fn has(&self, alarm: Alarm) -> bool {
        self.core.watch.as_ref().is_some_and(|watch| watch.has(alarm))
    }

    /// True while the camera gives no image that could be used.
    pub(crate) fn is_unsighted(&self) -> bool {
        self.core.watch.as_ref().is_some_and(|watch| watch.is_unsighted())
    }

    /// Begins a lasting alarm and tells it.
    pub(crate) fn raise(&mut self, alarm: Alarm, time: f64) {
        if self.core.watch.as_mut().is_some_and(|watch| watch.raise(alarm)) {
            self.core.tell(alarm, true, time);
        }
    }

    /// Ends a lasting alarm and tells it.
    pub(crate) fn call_off(&mut self, alarm: Alarm, time: f64) {
        if self.core.watch.as_mut().is_some_and(|watch| watch.end(alarm)) {
            self.core.tell(alarm, false, time);
        }
    }

    /// Watches camera and load in one frame, and tells what begins and ends.
    pub(crate) fn watch(&mut self, robot: &RobotState) {
        // In grasp and pull, and over the bucket, the hand presses on purpose.
        let presses = matches!(self.state(), State::Grasp | State::Pull) || self.is_over_bucket(robot);
        let force = if presses { 0.0 } else { self.force.z };
        if self.has(Alarm::ReadingNotFinite) {
            self.call_off(Alarm::ReadingNotFinite, robot.time);
            // Nothing could be done in the time that has passed.
            self.core.restart_clock(robot);
        }
        let Some(watch) = &mut self.core.watch else { return };
        let (sight, load) = (watch.look(robot.dt), watch.feel(force, robot.dt));
        if watch.is_unsighted() {
            self.core.perception.blind = true;
        }
        let load = load.map(|begins| (Alarm::ArmLoaded, begins));
        for (alarm, begins) in sight.into_iter().chain(load) {
            self.core.tell(alarm, begins, robot.time);
        }
    }

    /// Returns why a state cannot go on under the present alarms. A hand that holds a fruit needs no camera; an assigned task has its own ends.
    pub(crate) fn interruption(&self, phase: &Phase) -> Option<FailureReason> {
        if self.core.task.is_some() {
            return None;
        }
        let (approaches, homes) = match phase {
            Phase::Align(_) | Phase::Reach(_) => (true, false),
            Phase::Grasp(grasp) => (false, grasp.is_homing()),
            _ => (false, false),
        };
        if approaches && self.has(Alarm::ArmLoaded) {
            return Some(FailureReason::ArmLoaded);
        }
        ((approaches || homes) && self.is_unsighted()).then_some(FailureReason::NoSight)
    }

    /// True if the robot cannot go on.
    pub(crate) fn is_unsafe(&self) -> bool {
        self.is_unsighted() || self.has(Alarm::HandStuck) || self.has(Alarm::ArmLoaded)
    }

    /// Lets the arm give way to what lies on it, while the base may draw it out slowly. False once it has done so for long, `drawn` \[s\], or where it cannot see.
    pub(crate) fn give_way(&mut self, drawn: &mut f64, robot: &RobotState) -> bool {
        self.core.yield_arm(robot);
        *drawn += robot.dt;
        *drawn <= self.config.watch.draw.si() && !self.is_blind(robot)
    }

    /// Velocity of the base straight back, slowly [m/s, m/s, rad/s].
    pub(crate) fn draw_straight(&self) -> [f64; 3] {
        [-self.draw_speed(), 0.0, 0.0]
    }

    /// Velocity of the base back as it came, slowly [m/s, m/s, rad/s]; `None` once no way is `left` \[m\], or at the end of its trail.
    pub(crate) fn go_back(&mut self, left: &mut f64, robot: &RobotState) -> Option<[f64; 3]> {
        let speed = self.draw_speed();
        self.core.trail.back(robot, speed, left)
    }

    /// Speed at which the base draws the arm out of what it touches [m/s].
    fn draw_speed(&self) -> f64 {
        self.config.leave.base_speed.si() * self.speed_share(Caution::High)
    }

    pub(crate) fn safe(&mut self, mut safe: Safe, robot: &RobotState) -> Next {
        if self.has(Alarm::ArmLoaded) {
            // The arm gives way to what lies on it.
            self.core.yield_arm(robot);
            return Next::Stay(Phase::Safe(safe), STILL);
        }
        let carry = self.core.postures.carry();
        if self.core.motion.is_over() && *self.core.motion.q() != carry {
            self.swing_among(carry, Caution::High);
        }
        if !self.is_unsafe() {
            return Next::Enter(Phase::Scan(Scan::here()));
        }
        if !self.has(Alarm::HandStuck) {
            return Next::Stay(Phase::Safe(safe), STILL);
        }
        let (rest, closing) = (self.config.watch.self_test.si(), self.core.config.grasp.close_time.si());
        match safe.testing {
            None if robot.time - safe.since >= rest && self.core.arm_arrived(robot) => {
                self.core.close_hand();
                safe.testing = Some(robot.time);
            }
            Some(since) if robot.time - since >= closing => {
                if !self.core.fingers_are_open(robot) {
                    self.call_off(Alarm::HandStuck, robot.time);
                }
                self.core.open_fingers();
                safe = Safe::at(robot);
            }
            _ => {}
        }
        Next::Stay(Phase::Safe(safe), STILL)
    }
}
