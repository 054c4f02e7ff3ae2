//! Pull: withdraw until the stem breaks, until it has shown to be too strong, or until wood yields.
//!
//! The hand withdraws fast while the stem is slack, and then as the pull that it allows itself asks for: that pull rises evenly, waits while the hand
//! twists the fruit, and rises on to the largest pull. Meanwhile the hand gives way aside, so that the stem bends into the direction of the pull.

use crate::expert::config::{ExpertConfig, LoadConfig};
use crate::expert::place::Deposit;
use crate::expert::{ExpertPicker, Next, Phase};
use crate::picker_core::STILL;
use crate::plan::Target;
use crate::record::FailureReason;
use crate::robot_state::RobotState;
use orchard_geometry::{Rotation, Vec3, math};
use orchard_quantity::Quantity;
use std::f64::consts::TAU;

/// Share of the circle of a bend after which the hand has its radius.
const RAMP: f64 = 0.15;

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
    limits: Limits,
    /// Largest pull that the hand allows itself for now \[N\].
    allowed: f64,
    twist: Twist,
    /// Share of the circle on which the hand bends the stem, 0 before it does.
    bent: f64,
    /// Largest smoothed force so far \[N\].
    largest: f64,
    /// Widest gap between the fingers so far \[m\].
    width: f64,
    /// True once the fruit has slipped in the fingers.
    slipped: bool,
    /// Largest pull that fruit and wood have shown to bear \[N\]; without an end until one gives way.
    bearable: f64,
    /// Number of failed tries at this target.
    failed: u32,
}

/// Pull at which the hand twists the fruit, the largest pull, and the largest squeeze \[N\].
#[derive(Debug, Clone, Copy, PartialEq)]
struct Limits {
    twist_at: f64,
    most: f64,
    squeeze: f64,
}

impl Limits {
    /// Those of the load; beside other fruit no more than theirs.
    fn of(config: &ExpertConfig, has_beside: bool) -> Self {
        let (load, beside) = (&config.load, &config.beside);
        let limit = |own: &Quantity, theirs: &Quantity| {
            let own = own.si();
            if has_beside { own.min(theirs.si()) } else { own }
        };
        Self {
            twist_at: limit(&load.twist_at, &beside.twist_at),
            most: limit(&load.most, &beside.most),
            squeeze: limit(&load.squeeze_most, &beside.squeeze_most),
        }
    }
}

/// Twist of the fruit by the hand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Twist {
    Before,
    During,
    After,
}

impl Pull {
    fn new(failed: u32, allowed: f64, twist: Twist, limits: Limits) -> Self {
        Self {
            limits,
            force: Vec3::zeros(),
            tension: 0.0,
            peak: 0.0,
            travelled: 0.0,
            sagging: 0.0,
            settled: 0.0,
            allowed,
            twist,
            bent: 0.0,
            largest: 0.0,
            width: 0.0,
            slipped: false,
            bearable: f64::INFINITY,
            failed,
        }
    }

    /// True once the hand has begun to bend the stem.
    fn is_bending(&self) -> bool {
        self.bent > 0.0
    }

    /// Returns the force with which the fingers squeeze \[N\]: by the largest force so far, and all they may during the twist and once the fruit
    /// slips. `least` is that of the grasp \[N\], `width` the gap between the fingers \[m\].
    fn squeeze(&mut self, load: &LoadConfig, least: f64, width: f64) -> f64 {
        self.width = self.width.max(width);
        let most = self.limits.squeeze;
        if !self.slipped && self.width - width > load.slip.si() {
            self.slipped = true;
            self.bear_no_more_than(load.slip_share.si() * self.largest);
        }
        if self.slipped || self.twist == Twist::During {
            most
        } else {
            (load.squeeze.si() * self.largest).clamp(least.min(most), most)
        }
    }

    /// Ends the rise of the pull at a force \[N\]; no twist begins any more.
    fn bear_no_more_than(&mut self, force: f64) {
        self.bearable = self.bearable.min(force);
        self.allowed = self.allowed.min(force);
        if self.twist == Twist::Before {
            self.twist = Twist::After;
        }
    }

    /// Largest pull \[N\].
    fn most(&self) -> f64 {
        self.bearable.min(self.limits.most)
    }

    /// Raises the pull that the hand allows itself, and returns the share of its speed at which it withdraws: below 0 where it pulls more than it
    /// may. `dt` is the time since the last frame \[s\].
    fn ease(&mut self, load: &LoadConfig, dt: f64) -> f64 {
        let limit = if self.twist == Twist::After { self.most() } else { self.limits.twist_at };
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
    pub(crate) fn start_pull(&mut self, failed: u32, robot: &RobotState) -> Next {
        let Some(attempt) = &self.core.attempt else { return Next::Fail(FailureReason::Slipped) };
        let c = &self.core.config;
        let (distance, speed) = (c.pull.distance.si(), c.arm.withdraw_speed.si());
        self.core.motion.go_straight(&self.core.arm, -attempt.plan.direction(), distance, speed, &c.arm);
        // A cup pulls along the stem; it would slip if it twisted.
        let twist = if self.core.arm.cup().is_some() { Twist::After } else { Twist::Before };
        let limits = Limits::of(&self.config, self.has_fruit_beside(robot));
        let allowed = self.config.load.brisk.si().min(limits.twist_at);
        Next::Enter(Phase::Pull(Pull::new(failed, allowed, twist, limits)))
    }

    /// True if fruit hang beside the target.
    fn has_fruit_beside(&self, robot: &RobotState) -> bool {
        let Some(target) = self.core.target_base(robot) else { return false };
        let gap = self.config.beside.gap.si();
        let is_beside = |other: &Target| (other.p - target.p).norm() < target.radius + other.radius + gap;
        self.core.others_than_target(&robot.x_odom_base).iter().any(is_beside)
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
        // A bent stem pulls aside.
        let pulls = if pull.is_bending() { pull.force.norm() } else { pull.tension };
        let slack = pulls < c.tension_low.si();
        let share = pull.ease(&self.config.load, robot.dt);
        self.withdraw_gently(&mut pull, share, &direction, robot);
        let (c, feel, load) = (&self.core.config.pull, &self.config.feel, &self.config.load);
        let was_taut = pull.peak > c.tension_high.si();
        let sags = was_taut && !slack && pull.tension < feel.wood_share.si() * pull.peak;
        pull.sagging = if sags { pull.sagging + robot.dt } else { 0.0 };
        let late = self.core.elapsed(robot) > self.core.config.timeout.pull.si();
        let ended =
            self.core.motion.is_over() && (self.core.arm_arrived(robot) || self.core.arm_stalled()) || late;
        // If the stem was never taut, only the weight tells a fruit from a leaf or nothing.
        if slack && (was_taut || (ended && pull.force.z >= feel.weight_min.si())) {
            self.core.note_release_of_stem(robot, pull.peak);
            self.core.motion.stop_turn();
            self.core.motion.drift_off_line(Vec3::zeros(), load.give_most.si() + load.bend.si());
            if !pull.slipped {
                self.core.fingers.force = self.core.config.grasp.force.si();
            }
            self.core.motion.set_line_speed(self.config.leave.speed.si());
            return Next::Enter(Phase::Deposit(Deposit::leaving(robot, pull.travelled)));
        }
        if ended && slack {
            return self.grasp_again(pull.failed, robot);
        }
        // A limb that follows the hand would break sooner than the stem.
        let follows = was_taut && pull.travelled > feel.bend_distance.si();
        if follows && pull.bearable.is_infinite() {
            pull.bear_no_more_than(pull.force.norm());
        }
        let bears =
            pull.twist == Twist::After && pull.allowed >= pull.most() && share <= load.last_share.si();
        let may_bend = self.core.arm.cup().is_none() && pull.bent < 1.0 && !ended;
        if may_bend && (bears || pull.is_bending()) {
            self.bend(&mut pull, &direction, robot.dt);
            return Next::Stay(Phase::Pull(pull), STILL);
        }
        // Wood yields if the hand travels far with the stem taut, or if the pull falls and does not end.
        let wood_yields = pull.travelled > feel.wood_distance.si() || pull.sagging > feel.wood_time.si();
        if ended || ((wood_yields || bears || pull.bent >= 1.0) && !slack) {
            let settle_time = feel.settle_time.si();
            if self.core.motion.travelled().is_some() {
                self.core.motion.stop();
            }
            pull.settled += robot.dt;
            if pull.settled > settle_time {
                return Next::Fail(FailureReason::StemTooStrong);
            }
        }
        Next::Stay(Phase::Pull(pull), STILL)
    }

    /// Moves the hand on by a frame on a circle across the line of the pull, up first: the stem bends at its zone to all sides, and an angle to its axis
    /// halves the pull that it bears. The motion along the line keeps the pull meanwhile.
    fn bend(&mut self, pull: &mut Pull, direction: &Vec3, dt: f64) {
        let load = &self.config.load;
        let aside = (Vec3::z() - direction * direction.z).normalize();
        let axes = [aside, direction.cross(&aside)];
        let at = |share: f64| {
            let (sin, cos) = math::sin_cos(TAU * share);
            (axes[0] * cos + axes[1] * sin) * (load.bend.si() * (share / RAMP).min(1.0))
        };
        let next = pull.bent + dt / load.bend_time.si();
        let drift = (at(next) - at(pull.bent)) / dt;
        pull.bent = next;
        let most = load.give_most.si() + load.bend.si();
        self.core.motion.drift_off_line(drift, most);
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
        if pull.twist == Twist::Before && pull.allowed >= pull.limits.twist_at {
            // Fruit beside the held one hang with it: as they lay about the target, so the turned fingers meet them.
            let others = core.others_than_target(&robot.x_odom_base);
            let held = core.target_base(robot).zip(core.attempt.as_ref().map(|a| a.plan.rotation));
            let is_free = |turn: f64| {
                let Some((target, rotation)) = &held else { return true };
                let search = core.search(target, &[], &others);
                let turned = rotation * Rotation::from_axis_angle(&Vec3::z_axis(), turn);
                search.brushed(&turned) <= search.brushed(rotation)
            };
            let turn = core.motion.room_to_turn(&core.arm, load.turn.si(), is_free);
            core.motion.turn_on_line(turn, load.turn_speed.si());
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
    use orchard_perception::{DetectorConfig, Sighting};
    use orchard_robot::RobotModel;

    const DT: f64 = 1.0 / 60.0;

    /// The allowed pull rises at its rate, waits for the pull and for the twist, and ends at the largest; the hand goes back where it pulls more.
    #[test]
    fn the_allowed_pull_rises_evenly_and_waits() {
        let config = ExpertConfig::preset();
        let (load, limits) = (&config.load, Limits::of(&config, false));
        let (brisk, lead, rate) = (load.brisk.si(), load.lead.si(), load.rate.si());
        let mut pull = Pull::new(0, brisk, Twist::Before, limits);
        for _ in 0..600 {
            assert!(pull.ease(load, DT) > 0.0);
        }
        assert_eq!(pull.allowed, brisk, "nothing pulls yet");
        pull.force = Vec3::new(0.0, 0.0, -(brisk - 0.5 * lead));
        pull.ease(load, DT);
        assert!((pull.allowed - brisk - rate * DT).abs() < 1e-12);
        for _ in 0..600 {
            pull.force = Vec3::x() * pull.allowed;
            pull.ease(load, DT);
        }
        assert_eq!(pull.allowed, limits.twist_at);
        pull.twist = Twist::After;
        for _ in 0..600 {
            pull.force = Vec3::x() * pull.allowed;
            pull.ease(load, DT);
        }
        assert_eq!(pull.allowed, limits.most);
        assert_eq!(pull.ease(load, DT), 0.0);
        pull.force = Vec3::y() * (limits.most + 0.5 * load.band.si());
        assert!((pull.ease(load, DT) + 0.5).abs() < 1e-12);
    }

    /// Fruit that hang beside the target, and no others, make the pull a gentler one.
    #[test]
    fn fruit_beside_the_target_make_the_pull_gentler() {
        let model = RobotModel::paper();
        let target = Target { p: Vec3::new(0.7, 0.0, 0.9), radius: 0.03 };
        for (off, is_beside) in [(0.075, true), (0.09, false)] {
            let mut picker = ExpertPicker::new(&model, DetectorConfig::paper(), ExpertConfig::preset());
            let robot = RobotState { q: *picker.core.motion.q(), ..RobotState::still(1.0) };
            let plan = picker.core.search(&target, &[], &[]).best().expect("within reach");
            picker.core.commit(&robot, u32::MAX, target, plan);
            let sighting = Sighting { p_odom: target.p + Vec3::y() * off, radius: 0.03, score: 1.0 };
            picker.core.perception.tracker.update(1.0, &[sighting]);
            let Next::Enter(Phase::Pull(pull)) = picker.start_pull(0, &robot) else { panic!("no pull") };
            assert_eq!(pull.limits, Limits::of(&picker.config, is_beside));
            assert!((pull.limits.most < picker.config.load.most.si()) == is_beside);
            assert!((pull.limits.squeeze < picker.config.load.squeeze_most.si()) == is_beside);
        }
    }

    /// Fingers squeeze by the force felt, never less than at the grasp, and as hard as they may once the gap narrows.
    #[test]
    fn the_squeeze_follows_the_pull() {
        let config = ExpertConfig::preset();
        let (load, limits) = (&config.load, Limits::of(&config, false));
        let (least, most) = (30.0, limits.squeeze);
        let mut pull = Pull::new(0, load.brisk.si(), Twist::Before, limits);
        assert_eq!(pull.squeeze(load, least, 0.07), least);
        pull.largest = 17.0;
        assert_eq!(pull.squeeze(load, least, 0.07), load.squeeze.si() * 17.0);
        pull.largest = 100.0;
        assert_eq!(pull.squeeze(load, least, 0.07), most);
        pull.largest = 0.0;
        assert_eq!(pull.squeeze(load, least, 0.07 - 0.9 * load.slip.si()), least);
        assert_eq!(pull.squeeze(load, least, 0.07 - 1.1 * load.slip.si()), most);
        assert_eq!(pull.squeeze(load, least, 0.07), most, "a fruit that slipped may slip again");
        let mut twisting = Pull::new(0, load.brisk.si(), Twist::During, limits);
        assert_eq!(twisting.squeeze(load, least, 0.07), most);
    }

    /// A fruit that slips ends the rise of the pull below what it bore, before a twist that would free it; the hand then bends the stem.
    #[test]
    fn a_slip_ends_the_rise_of_the_pull() {
        let config = ExpertConfig::preset();
        let (load, limits) = (&config.load, Limits::of(&config, false));
        let mut pull = Pull::new(0, load.brisk.si(), Twist::Before, limits);
        pull.largest = 20.0;
        let _ = pull.squeeze(load, 30.0, 0.07);
        assert_eq!(pull.most(), limits.most);
        let _ = pull.squeeze(load, 30.0, 0.07 - 1.1 * load.slip.si());
        let bearable = load.slip_share.si() * 20.0;
        assert_eq!((pull.most(), pull.twist), (bearable, Twist::After));
        pull.force = Vec3::x() * bearable;
        for _ in 0..600 {
            pull.ease(load, DT);
        }
        assert_eq!(pull.allowed, bearable);
    }

    /// The hand goes round the line of the pull once, up first, at the radius of the bend.
    #[test]
    fn a_bend_goes_round_the_pull() {
        let robot = RobotModel::paper();
        let mut picker = ExpertPicker::new(&robot, DetectorConfig::paper(), ExpertConfig::preset());
        let (arm, direction) = (robot.kinematics(), Vec3::x());
        let core = &mut picker.core;
        core.motion.go_straight(arm, -direction, 0.3, 0.0, &core.config.arm);
        let start = arm.tcp(core.motion.q()).translation.vector;
        let radius = picker.config.load.bend.si();
        let mut pull = Pull::new(0, 0.0, Twist::After, Limits::of(&ExpertConfig::preset(), false));
        let (mut lowest, mut highest) = (Vec3::zeros(), Vec3::zeros());
        let mut first_up = 0.0_f64;
        while pull.bent < 1.0 {
            picker.bend(&mut pull, &direction, DT);
            picker.core.motion.advance(arm, DT);
            let off = arm.tcp(picker.core.motion.q()).translation.vector - start;
            assert!(off.norm() < radius + 5e-3, "{off}");
            (lowest, highest) = (lowest.inf(&off), highest.sup(&off));
            if pull.bent < 0.25 {
                first_up = first_up.max(off.z);
            }
        }
        assert!(first_up > 0.5 * radius && pull.is_bending());
        for (low, high) in [(lowest.y, highest.y), (lowest.z, highest.z)] {
            assert!(low < -0.9 * radius && high > 0.5 * radius, "{low} {high}");
        }
    }
}
