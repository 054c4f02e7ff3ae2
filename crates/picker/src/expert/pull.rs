//! Pull: withdraw until the stem breaks, until it has shown to be too strong, or until wood yields.
//!
//! The hand withdraws fast while the stem is slack, and then as the pull that it allows itself asks for: that pull rises evenly, waits while the hand
//! twists the fruit, and rises on to the largest pull. Meanwhile the hand gives way aside, so that the stem bends into the direction of the pull.

use crate::expert::config::LoadConfig;
use crate::expert::place::Deposit;
use crate::expert::{ExpertPicker, Next, Phase};
use crate::picker_core::STILL;
use crate::record::FailureReason;
use crate::robot_state::RobotState;
use orchard_geometry::Vec3;

/// Memory of the pull state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pull {
    /// Smoothed force of the hand \[N\], base axes.
    force: Vec3,
    /// Part of it along the withdrawal \[N\], and its largest value.
    tension: f64,
    peak: f64,
    travelled: f64,
    /// Time for which the pull has been well below its peak, but not slack \[s\].
    sagging: f64,
    /// Time since the withdrawal ended \[s\]; the smoothed pull lags behind a stem that breaks at the end.
    settled: f64,
    /// Largest pull that the hand allows itself for now \[N\].
    allowed: f64,
    twist: Twist,
    /// Largest smoothed force so far \[N\].
    largest: f64,
    /// Widest gap between the fingers so far \[m\].
    width: f64,
    /// True once the fruit has slipped in the fingers.
    slipped: bool,
    /// Number of failed tries at this target.
    failed: u32,
}

/// Twist of the fruit by the hand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Twist {
    Before,
    During,
    After,
}

impl Pull {
    fn new(failed: u32, allowed: f64, twist: Twist) -> Self {
        Self {
            force: Vec3::zeros(),
            tension: 0.0,
            peak: 0.0,
            travelled: 0.0,
            sagging: 0.0,
            settled: 0.0,
            allowed,
            twist,
            largest: 0.0,
            width: 0.0,
            slipped: false,
            failed,
        }
    }

    /// Returns the force with which the fingers squeeze \[N\]: by the largest force so far, and all they may during the twist and once the fruit
    /// slips. `least` is that of the grasp \[N\], `width` the gap between the fingers \[m\].
    fn squeeze(&mut self, load: &LoadConfig, least: f64, width: f64) -> f64 {
        self.width = self.width.max(width);
        let most = load.squeeze_most.si();
        self.slipped |= self.width - width > load.slip.si();
        if self.slipped || self.twist == Twist::During {
            most
        } else {
            (load.squeeze.si() * self.largest).clamp(least.min(most), most)
        }
    }

    /// Raises the pull that the hand allows itself, and returns the share of its speed at which it withdraws: below 0 where it pulls more than it
    /// may. `dt` is the time since the last frame \[s\].
    fn ease(&mut self, load: &LoadConfig, dt: f64) -> f64 {
        let limit = if self.twist == Twist::After { load.most.si() } else { load.twist_at.si() };
        let short = self.allowed - self.force.norm();
        // It waits for the pull, which rises slowly where wood gives way.
        if short < load.lead.si() {
            self.allowed = (self.allowed + load.rate.si() * dt).min(limit);
        }
        (short / load.band.si()).clamp(-1.0, 1.0)
    }
}

impl ExpertPicker {
    /// Starts the hand back along the approach with the fruit.
    pub(crate) fn start_pull(&mut self, failed: u32) -> Next {
        let Some(attempt) = &self.core.attempt else { return Next::Fail(FailureReason::Slipped) };
        let c = &self.core.config;
        let (distance, speed) = (c.pull.distance.si(), c.arm.withdraw_speed.si());
        self.core.motion.go_straight(&self.core.arm, -attempt.plan.direction(), distance, speed, &c.arm);
        // A cup pulls along the stem; it would slip if it twisted.
        let twist = if self.core.arm.cup().is_some() { Twist::After } else { Twist::Before };
        Next::Enter(Phase::Pull(Pull::new(failed, self.config.load.brisk.si(), twist)))
    }

    pub(crate) fn pull(&mut self, mut pull: Pull, robot: &RobotState) -> Next {
        if !self.still_holds(robot) {
            return self.grasp_again(pull.failed, robot);
        }
        let Some(direction) = self.core.attempt.as_ref().map(|a| a.plan.direction()) else {
            return Next::Fail(FailureReason::Slipped);
        };
        let (c, feel) = (&self.core.config.pull, &self.config.feel);
        pull.force += (self.core.tcp_force(robot) - pull.force) * feel.touch_weight.si();
        pull.tension = -pull.force.dot(&direction);
        pull.peak = pull.peak.max(pull.tension);
        pull.largest = pull.largest.max(pull.force.norm());
        pull.travelled = self.core.motion.travelled().unwrap_or(pull.travelled);
        let slack = pull.tension < c.tension_low.si();
        let share = pull.ease(&self.config.load, robot.dt);
        self.withdraw_gently(&mut pull, share, &direction, robot);
        let (c, feel, load) = (&self.core.config.pull, &self.config.feel, &self.config.load);
        let was_taut = pull.peak > c.tension_high.si();
        let sags = was_taut && !slack && pull.tension < feel.wood_share.si() * pull.peak;
        pull.sagging = if sags { pull.sagging + robot.dt } else { 0.0 };
        let ended = self.core.motion.is_over() && (self.core.arm_arrived(robot) || self.core.arm_stalled())
            || self.core.elapsed(robot) > self.core.config.timeout.pull.si();
        // If the stem was never taut, only the weight tells a fruit from a leaf or nothing.
        if slack && (was_taut || (ended && pull.force.z >= feel.weight_min.si())) {
            self.core.note_release_of_stem(robot, pull.peak);
            self.core.motion.stop_turn();
            self.core.motion.drift_off_line(Vec3::zeros(), load.give_most.si());
            if !pull.slipped {
                self.core.fingers.force = self.core.config.grasp.force.si();
            }
            self.core.motion.set_line_speed(self.config.leave.speed.si());
            return Next::Enter(Phase::Deposit(Deposit::leaving(robot, pull.travelled)));
        }
        if ended && slack {
            return self.grasp_again(pull.failed, robot);
        }
        // Wood yields if the hand travels far with the stem taut, or if the pull falls and does not end.
        let wood_yields = pull.travelled > feel.wood_distance.si() || pull.sagging > feel.wood_time.si();
        let is_too_strong =
            pull.twist == Twist::After && pull.allowed >= load.most.si() && share <= load.last_share.si();
        if ended || ((wood_yields || is_too_strong) && !slack) {
            if self.core.motion.travelled().is_some() {
                self.core.motion.stop();
            }
            pull.settled += robot.dt;
            if pull.settled > feel.settle_time.si() {
                return Next::Fail(FailureReason::StemTooStrong);
            }
        }
        Next::Stay(Phase::Pull(pull), STILL)
    }

    /// Moves the hand on the line of the pull at a share of its speed, giving way aside; twists the fruit once the pull suffices, and squeezes it by need.
    fn withdraw_gently(&mut self, pull: &mut Pull, share: f64, direction: &Vec3, robot: &RobotState) {
        let (load, core) = (&self.config.load, &mut self.core);
        let speed = core.config.arm.withdraw_speed.si();
        core.motion.set_line_speed(share * speed);
        let across = pull.force + direction * pull.tension;
        let give = -across * (speed / load.give_force.si());
        let give = give * (speed / give.norm().max(speed));
        core.motion.drift_off_line(give, load.give_most.si());
        if pull.twist == Twist::Before && pull.allowed >= load.twist_at.si() {
            core.motion.turn_on_line(&core.arm, load.turn.si(), load.turn_speed.si());
            pull.twist = Twist::During;
        } else if pull.twist == Twist::During {
            // A fruit that does not turn with the hand would slip out of it.
            if core.tcp_load(robot).torque.dot(direction).abs() > load.torque_max.si() {
                core.motion.stop_turn();
            }
            if !core.motion.is_turning() {
                pull.twist = Twist::After;
            }
        }
        if core.arm.cup().is_none() {
            core.fingers.force = pull.squeeze(load, core.config.grasp.force.si(), robot.width);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expert::ExpertConfig;

    const DT: f64 = 1.0 / 60.0;

    /// The allowed pull rises at its rate, waits for the pull and for the twist, and ends at the largest; the hand goes back where it pulls more.
    #[test]
    fn the_allowed_pull_rises_evenly_and_waits() {
        let load = ExpertConfig::preset().load;
        let (brisk, lead, rate) = (load.brisk.si(), load.lead.si(), load.rate.si());
        let mut pull = Pull::new(0, brisk, Twist::Before);
        for _ in 0..600 {
            assert!(pull.ease(&load, DT) > 0.0);
        }
        assert_eq!(pull.allowed, brisk, "nothing pulls yet");
        pull.force = Vec3::new(0.0, 0.0, -(brisk - 0.5 * lead));
        pull.ease(&load, DT);
        assert!((pull.allowed - brisk - rate * DT).abs() < 1e-12);
        for _ in 0..600 {
            pull.force = Vec3::x() * pull.allowed;
            pull.ease(&load, DT);
        }
        assert_eq!(pull.allowed, load.twist_at.si());
        pull.twist = Twist::After;
        for _ in 0..600 {
            pull.force = Vec3::x() * pull.allowed;
            pull.ease(&load, DT);
        }
        assert_eq!(pull.allowed, load.most.si());
        assert_eq!(pull.ease(&load, DT), 0.0);
        pull.force = Vec3::y() * (load.most.si() + 0.5 * load.band.si());
        assert!((pull.ease(&load, DT) + 0.5).abs() < 1e-12);
    }

    /// Fingers squeeze by the force felt, never less than at the grasp, and as hard as they may once the gap narrows.
    #[test]
    fn the_squeeze_follows_the_pull() {
        let load = ExpertConfig::preset().load;
        let (least, most) = (30.0, load.squeeze_most.si());
        let mut pull = Pull::new(0, load.brisk.si(), Twist::Before);
        assert_eq!(pull.squeeze(&load, least, 0.07), least);
        pull.largest = 17.0;
        assert_eq!(pull.squeeze(&load, least, 0.07), load.squeeze.si() * 17.0);
        pull.largest = 100.0;
        assert_eq!(pull.squeeze(&load, least, 0.07), most);
        pull.largest = 0.0;
        assert_eq!(pull.squeeze(&load, least, 0.07 - 0.9 * load.slip.si()), least);
        assert_eq!(pull.squeeze(&load, least, 0.07 - 1.1 * load.slip.si()), most);
        assert_eq!(pull.squeeze(&load, least, 0.07), most, "a fruit that slipped may slip again");
        let mut twisting = Pull::new(0, load.brisk.si(), Twist::During);
        assert_eq!(twisting.squeeze(&load, least, 0.07), most);
    }
}
