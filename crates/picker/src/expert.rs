//! State machine of the expert: the baseline's cycle without its pauses, with more sensing.
//!
//! The states are in `expert/` (`machine.rs` runs them): `approach.rs` (align, reach), `grasp.rs`, `pull.rs`, `place.rs` (deposit),
//! `retreat.rs`; `scan.rs` is shared with the baseline. `docs/computation/robot.md` describes them.

mod approach;
mod config;
mod finish;
mod grasp;
mod place;
mod pull;
mod retreat;
mod safe;
mod slots;
mod views;

pub use config::{EXPERT_TOML, ExpertConfig};

use crate::Controller;
use crate::expert::approach::{Align, Reach};
use crate::expert::grasp::Grasp;
use crate::expert::place::Deposit;
use crate::expert::pull::Pull;
use crate::expert::retreat::Retreat;
use crate::expert::safe::Safe;
use crate::expert::slots::Slots;
use crate::machine::{self, Machine, Phase as _};
use crate::motion::{Pace, WayPoint};
use crate::picker_core::{Attempt, PickerCore, STILL};
use crate::record::{Alarm, FailureReason, Record, State};
use crate::robot_state::RobotState;
use crate::scan::Scan;
use crate::task::AssignedTask;
use crate::watch::Watch;
use orchard_geometry::Vec3;
use orchard_perception::DetectorConfig;
use orchard_robot::{Command, JointVector, Observation, RobotModel};

/// The expert picker: looks while it moves, corrects the hand as it approaches, senses contact by the arm's torques, and fills the bucket in
/// layers.
#[derive(Debug, Clone)]
pub struct ExpertPicker {
    core: PickerCore,
    config: ExpertConfig,
    slots: Slots,
    phase: Phase,
    /// Smoothed force that the hand exerts \[N\], base axes, without what the motion of arm and base takes.
    force: Vec3,
    /// Time at which the run ends \[s\]; infinite if nobody has told it.
    run_end: f64,
}

/// State of the state machine, with the memory of that state.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Phase {
    Scan(Scan),
    Align(Align),
    Reach(Reach),
    Grasp(Grasp),
    Pull(Pull),
    Deposit(Deposit),
    Retreat(Retreat),
    Safe(Safe),
}

/// Caution of the hand's motion among branches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Caution {
    /// Full speed: no contact so far.
    Normal,
    /// Reduced speed: back from a contact, and on further tries.
    High,
}

impl Caution {
    /// Caution for a target after a number of failed tries.
    fn after(failed: u32) -> Self {
        if failed == 0 { Caution::Normal } else { Caution::High }
    }
}

impl machine::Phase for Phase {
    fn state(&self) -> State {
        match self {
            Phase::Scan(_) => State::Scan,
            Phase::Align(_) => State::Align,
            Phase::Reach(_) => State::Reach,
            Phase::Grasp(_) => State::Grasp,
            Phase::Pull(_) => State::Pull,
            Phase::Deposit(_) => State::Deposit,
            Phase::Retreat(_) => State::Retreat,
            Phase::Safe(_) => State::Safe,
        }
    }
}

/// Result of one frame of a state.
pub(crate) type Next = machine::Next<Phase>;

impl ExpertPicker {
    /// Makes a picker for one robot, in its state at the start of an episode.
    pub fn new(robot: &RobotModel, detector: DetectorConfig, config: ExpertConfig) -> Self {
        let phase = Phase::Scan(Scan::at_start());
        let mut core = PickerCore::new(robot, detector, config.shared.clone(), phase.state());
        core.watch = Some(Watch::new(&config.watch));
        let slots = Slots::new(&core.arm, &robot.bucket(), &core.postures.carry(), &config.place);
        Self { core, slots, config, phase, force: Vec3::zeros(), run_end: f64::INFINITY }
    }

    /// Returns the picker without its watch, to measure what the watch is worth: it tells no fault but a fruit lost on the way to the bucket.
    #[must_use]
    pub fn without_watch(mut self) -> Self {
        self.core.watch = None;
        self
    }

    /// Makes a picker for an assigned task.
    pub(crate) fn with_task(
        robot: &RobotModel,
        detector: DetectorConfig,
        config: ExpertConfig,
        task: AssignedTask,
    ) -> Self {
        let mut picker = Self::new(robot, detector, config);
        picker.core.task = Some(task);
        picker
    }

    /// Present state.
    pub fn state(&self) -> State {
        self.phase.state()
    }

    /// Starts the arm through way-points, the last of which is the goal.
    fn swing_through(&mut self, way_points: impl IntoIterator<Item = WayPoint>) {
        let pace =
            Pace { speed: self.config.swift.speed.si(), acceleration: self.config.swift.acceleration.si() };
        self.core.motion.go_through(way_points, pace);
    }

    /// Starts the arm to a posture.
    fn swing_to(&mut self, q: JointVector) {
        self.swing_through([WayPoint { q, blend: 0.0 }]);
    }

    /// Starts the arm to a posture among branches: slower, so that it stops soon after a contact.
    fn swing_among(&mut self, q: JointVector, caution: Caution) {
        let speed = self.config.unfold.speed.si() * self.speed_share(caution);
        let pace = Pace { speed, acceleration: self.config.swift.acceleration.si() };
        self.core.motion.go_through([WayPoint { q, blend: 0.0 }], pace);
    }

    /// Share of its speeds at which the hand moves among branches.
    fn speed_share(&self, caution: Caution) -> f64 {
        match caution {
            Caution::Normal => 1.0,
            Caution::High => self.config.homing.careful.si(),
        }
    }

    /// True if something presses on the empty hand.
    fn is_pressed(&self) -> bool {
        self.force.norm() > self.config.feel.touch_max.si()
    }

    /// True if something presses on the arm so hard that a drive, or a look around, must end.
    fn is_stopped(&self) -> bool {
        self.force.norm() > self.config.feel.drive_max.si()
    }

    /// Moves the hand on along its straight way out of the canopy. It is the slower the harder the hand presses, at most `speed` [m/s], and the hand gives way
    /// aside. Returns the share of the speed.
    fn slip_out(&mut self, direction: &Vec3, speed: f64) -> f64 {
        let load = &self.config.load;
        let share = (load.most.si() - self.force.norm()) / load.band.si();
        let share = share.clamp(self.config.homing.pace_min.si(), 1.0);
        self.core.motion.set_line_speed(share * speed);
        let across = self.force - direction * self.force.dot(direction);
        let give = -across * (speed / load.give_force.si());
        self.core.motion.drift_off_line(give.cap_magnitude(speed), load.give_most.si());
        share
    }

    /// True if fingers or cup still hold the fruit; a fruit held off its middle may turn, and the gap may shrink.
    fn still_holds(&self, robot: &RobotState) -> bool {
        if self.core.arm.cup().is_some() {
            return self.core.holds_fruit(robot);
        }
        robot.width >= self.config.feel.held_width_min.si()
    }

    /// Way-point at the carrying posture, passed outside the canopy.
    fn by_carry(&self) -> WayPoint {
        WayPoint { q: self.core.postures.carry(), blend: self.config.swift.blend.si() }
    }

    /// True if images have had no sight for long. With the hand in the bucket the camera is too close to everything in view.
    fn is_blind(&self, robot: &RobotState) -> bool {
        let perception = &self.core.perception;
        let is_dark =
            perception.blind && robot.time - perception.last_sight > self.config.feel.blind_time.si();
        is_dark || self.is_unsighted()
    }

    /// Starts an attempt at the next known target; without one, scans from the present place.
    fn next_target(&mut self, robot: &RobotState) -> Next {
        if self.is_unsafe() {
            return Next::Enter(Phase::Safe(Safe::at(robot)));
        }
        if self.is_too_late(robot) {
            return Next::Enter(Phase::Scan(Scan::here()));
        }
        let stays = !self.is_blind(robot) && !self.core.leave_in_vain(robot);
        match stays.then(|| self.core.choose(robot)).flatten() {
            Some(choice) => {
                self.core.commit(robot, choice.track, choice.target, choice.plan);
                Next::Enter(Phase::Align(Align::towards(choice.goal)))
            }
            None if self.core.side.barred.is_empty() => Next::Enter(Phase::Scan(Scan::here())),
            None => Next::Enter(Phase::Scan(Scan::elsewhere())),
        }
    }

    fn scan(&mut self, mut scan: Scan, robot: &RobotState) -> Next {
        if self.is_unsafe() {
            return Next::Enter(Phase::Safe(Safe::at(robot)));
        }
        if self.is_stopped() {
            self.core.bar_view(&scan, robot);
            return Next::Enter(Phase::Retreat(Retreat::from_contact(
                self.core.config.drive.wall_back.si(),
                robot,
            )));
        }
        if self.is_too_late(robot) {
            return Next::Stay(Phase::Scan(scan), STILL);
        }
        let (velocity, choice) = self.core.look_around(&mut scan, robot);
        let Some(choice) = choice else { return Next::Stay(Phase::Scan(scan), velocity) };
        self.core.commit(robot, choice.track, choice.target, choice.plan);
        Next::Enter(Phase::Align(Align::towards(choice.goal)))
    }
}

impl Machine for ExpertPicker {
    type Phase = Phase;

    fn core(&mut self) -> &mut PickerCore {
        &mut self.core
    }

    fn phase(&mut self) -> &mut Phase {
        &mut self.phase
    }

    fn take_in(&mut self, robot: &RobotState) {
        let force = self.core.tcp_force_in_motion(robot);
        if force.iter().all(|x| x.is_finite()) {
            self.force += (force - self.force) * self.config.feel.touch_weight.si();
        }
        self.watch(robot);
    }

    fn miss(&mut self) {
        self.raise(Alarm::ReadingNotFinite, self.core.last_time());
    }

    fn run(&mut self, phase: Phase, robot: &RobotState) -> Next {
        if let Some(reason) = self.interruption(&phase).or_else(|| self.cut_off(&phase, robot)) {
            if reason == FailureReason::ArmLoaded && matches!(phase, Phase::Align(_)) {
                self.core.meet_wall(robot);
            }
            return Next::Fail(reason);
        }
        match phase {
            Phase::Scan(state) => self.scan(state, robot),
            Phase::Align(state) => self.align(state, robot),
            Phase::Reach(state) => self.reach(state, robot),
            Phase::Grasp(state) => self.grasp(state, robot),
            Phase::Pull(state) => self.pull(state, robot),
            Phase::Deposit(state) => self.deposit(state, robot),
            Phase::Retreat(state) => self.retreat(state, robot),
            Phase::Safe(state) => self.safe(state, robot),
        }
    }

    fn after_failure(&mut self, state: State, attempt: Option<&Attempt>, robot: &RobotState) -> Phase {
        self.core.yield_arm(robot);
        Phase::Retreat(Retreat::after_failure(state, attempt, self.core.config.drive.wall_back.si(), robot))
    }
}

impl Controller for ExpertPicker {
    fn act(&mut self, observation: &Observation) -> Command {
        Machine::act(self, observation)
    }

    fn run_ends_at(&mut self, time: f64) {
        self.run_end = time;
    }

    fn record(&self) -> &Record {
        self.core.record()
    }
}
