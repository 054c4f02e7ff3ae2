//! The paper's harvest cycle as a state machine (its Algorithm 1): scan, align, reach, grasp, pull, deposit.
//!
//! One file a group of states in `baseline/`: `scan.rs`, `approach.rs` (align, reach), `grasp.rs` (grasp, pull), `deposit.rs`
//! (deposit, retreat). The table of states is in `docs/computation/robot.md`.

mod approach;
mod deposit;
mod grasp;
mod push;
mod scan;

pub(crate) use push::{Errand, Shove};

use crate::Controller;
use crate::baseline::approach::{Align, Reach};
use crate::baseline::deposit::{Deposit, Retreat};
use crate::baseline::grasp::{Grasp, Pull};
use crate::baseline::push::Push;
use crate::baseline::scan::Scan;
use crate::blacklist::Blacklist;
use crate::config::PickerConfig;
use crate::eyes::Eyes;
use crate::motion::ArmMotion;
use crate::plan::{GraspPlan, Target};
use crate::postures::Postures;
use crate::record::{AttemptEnd, AttemptId, Event, FailureReason, Record, State};
use crate::robot_state::{Memory, RobotState};
use orchard_geometry::{Vec3, inverse_transform};
use orchard_perception::DetectorConfig;
use orchard_robot::{ArmKinematics, Command, Observation, RobotModel};

/// The baseline picker: geometric perception, damped-least-squares arm, dead-reckoned grasp.
#[derive(Debug, Clone)]
pub struct BaselinePicker {
    pub(crate) arm: ArmKinematics,
    pub(crate) config: PickerConfig,
    pub(crate) eyes: Eyes,
    pub(crate) motion: ArmMotion,
    pub(crate) postures: Postures,
    pub(crate) blacklist: Blacklist,
    pub(crate) fingers: Fingers,
    pub(crate) attempt: Option<Attempt>,
    /// What it was sent for in place of a harvest.
    pub(crate) errand: Option<Errand>,
    /// Whether this frame brought an image from where the arm is now.
    pub(crate) fresh_image: bool,
    phase: Phase,
    phase_start: f64,
    held_for: f64,
    next_attempt: AttemptId,
    last_time: Option<f64>,
    memory: Memory,
    last_command: Command,
    record: Record,
}

/// Finger command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Fingers {
    pub opening: f64,
    pub force: f64,
}

/// A committed target.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Attempt {
    pub id: AttemptId,
    pub track: u32,
    /// Images that showed the track.
    pub hits: u32,
    /// Best estimate of the fruit, odom.
    pub target: Target,
    /// How it is going to be grasped, base frame.
    pub plan: GraspPlan,
}

/// What the picker is doing, with what the state remembers.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Phase {
    Scan(Scan),
    Align(Align),
    Reach(Reach),
    Grasp(Grasp),
    Push(Push),
    Pull(Pull),
    Deposit(Deposit),
    Retreat(Retreat),
}

impl Phase {
    fn state(&self) -> State {
        match self {
            Phase::Scan(_) => State::Scan,
            Phase::Align(_) => State::Align,
            Phase::Reach(_) => State::Reach,
            Phase::Grasp(_) | Phase::Push(_) => State::Grasp,
            Phase::Pull(_) => State::Pull,
            Phase::Deposit(_) => State::Deposit,
            Phase::Retreat(_) => State::Retreat,
        }
    }
}

/// What a state wants next.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Next {
    /// Stay in this state, base velocity as given.
    Stay(Phase, [f64; 3]),
    /// Go over to another state.
    Enter(Phase),
    /// Give the target up.
    Fail(FailureReason),
}

/// A base that stands.
pub(crate) const STILL: [f64; 3] = [0.0; 3];

impl BaselinePicker {
    /// A picker for one robot.
    pub fn new(robot: &RobotModel, detector: DetectorConfig, config: PickerConfig) -> Self {
        let arm = robot.kinematics().clone();
        let start = robot.start_command();
        let room = &config.align;
        let deck = Vec3::new(room.body_half_x.si(), room.body_half_y.si(), f64::INFINITY);
        Self {
            postures: Postures::new(&arm, &robot.bucket(), &config),
            eyes: Eyes::new(detector, &config, deck),
            motion: ArmMotion::new(arm.home()),
            blacklist: Blacklist::new(&config.blacklist),
            fingers: Fingers { opening: config.grasp.opening.si(), force: config.grasp.force.si() },
            attempt: None,
            errand: None,
            fresh_image: false,
            phase: Phase::Scan(Scan::at_start()),
            phase_start: 0.0,
            held_for: 0.0,
            next_attempt: 0,
            last_time: None,
            memory: Memory::new(&config.sensors),
            last_command: start,
            record: Record::default(),
            arm,
            config,
        }
    }

    /// What the picker is doing.
    pub fn state(&self) -> State {
        self.phase.state()
    }

    /// Where it believes the tree's axis to be, odom.
    pub fn believed_tree_odom(&self) -> Vec3 {
        self.eyes.belief.p_odom()
    }

    /// Time since the present state began [s].
    pub(crate) fn elapsed(&self, robot: &RobotState) -> f64 {
        robot.time - self.phase_start
    }

    /// Whether the arm follows its command: close, and not told to move.
    pub(crate) fn arm_arrived(&self, robot: &RobotState) -> bool {
        self.motion.is_over() && (robot.q - self.motion.q()).amax() <= self.config.arm.arrived.si()
    }

    /// Time without progress after which something is held [s].
    pub(crate) fn patience(&self) -> f64 {
        self.config.timeout.stall.si()
    }

    /// Whether something has been holding the arm off its command.
    pub(crate) fn arm_stalled(&self) -> bool {
        self.held_for >= self.patience()
    }

    fn watch_arm(&mut self, robot: &RobotState) {
        let c = &self.config.arm;
        let off = (robot.q - self.motion.q()).amax() > c.stall_error.si();
        let held = off && robot.v.amax() < c.stall_speed.si();
        self.held_for = if held { self.held_for + robot.dt } else { 0.0 };
    }

    /// The attempt's target in the base frame.
    pub(crate) fn target_base(&self, robot: &RobotState) -> Option<Target> {
        self.attempt.as_ref().map(|a| to_base(&a.target, robot))
    }

    /// Starts an attempt.
    pub(crate) fn commit(&mut self, robot: &RobotState, track: u32, target: Target, plan: GraspPlan) {
        let id = self.next_attempt;
        self.next_attempt = self.next_attempt.wrapping_add(1);
        let (p_odom, radius) = (target.p, target.radius);
        self.record.events.push(Event::AttemptStarted { time: robot.time, id, p_odom, radius });
        self.attempt = Some(Attempt { id, track, hits: 0, target, plan });
    }

    /// The fingers hold something.
    pub(crate) fn note_grasp(&mut self, robot: &RobotState) {
        if let Some(attempt) = &self.attempt {
            let RobotState { time, width, .. } = *robot;
            self.record.events.push(Event::Grasped { time, id: attempt.id, width });
        }
    }

    /// The stem has given way, after a largest pull [N].
    pub(crate) fn note_release_of_stem(&mut self, robot: &RobotState, pull: f64) {
        if let Some(attempt) = &self.attempt {
            self.record.events.push(Event::StemGaveWay { time: robot.time, id: attempt.id, pull });
        }
    }

    /// Ends the attempt, if there is one, and remembers where not to try again.
    pub(crate) fn conclude(&mut self, robot: &RobotState, end: AttemptEnd) -> Option<Attempt> {
        let attempt = self.attempt.take()?;
        self.record.events.push(Event::AttemptEnded { time: robot.time, id: attempt.id, end });
        self.eyes.tracker.forget(attempt.track);
        if let AttemptEnd::Failed(reason) = end {
            self.blacklist.add(attempt.target.p, reason, robot.time);
        }
        Some(attempt)
    }

    fn enter(&mut self, phase: Phase, robot: &RobotState) {
        if phase.state() != self.phase.state() {
            let state = phase.state();
            self.record.events.push(Event::StateChanged { time: robot.time, state });
        }
        self.phase = phase;
        self.phase_start = robot.time;
        self.held_for = 0.0;
    }

    fn step(&mut self, robot: &RobotState) -> [f64; 3] {
        let next = match self.phase.clone() {
            Phase::Scan(state) => self.scan(state, robot),
            Phase::Align(state) => self.align(state, robot),
            Phase::Reach(state) => self.reach(state, robot),
            Phase::Grasp(state) => self.grasp(state, robot),
            Phase::Push(state) => self.push(state, robot),
            Phase::Pull(state) => self.pull(state, robot),
            Phase::Deposit(state) => self.deposit(state, robot),
            Phase::Retreat(state) => self.retreat(state, robot),
        };
        match next {
            Next::Stay(phase, base_velocity) => {
                self.phase = phase;
                base_velocity
            }
            Next::Enter(phase) => {
                self.enter(phase, robot);
                STILL
            }
            Next::Fail(reason) => {
                let attempt = self.conclude(robot, AttemptEnd::Failed(reason));
                let retreat = Retreat::after_failure(self.phase.state(), attempt.as_ref(), robot);
                self.enter(Phase::Retreat(retreat), robot);
                STILL
            }
        }
    }
}

/// A target of the odom frame in the base frame.
pub(crate) fn to_base(target: &Target, robot: &RobotState) -> Target {
    Target { p: inverse_transform(&robot.x_odom_base, &target.p), radius: target.radius }
}

impl Controller for BaselinePicker {
    fn act(&mut self, observation: &Observation) -> Command {
        let Some(robot) = RobotState::read(observation, self.last_time, &self.config.sensors) else {
            return Command { base_velocity: STILL, ..self.last_command };
        };
        if self.last_time.is_none() {
            self.motion = ArmMotion::new(self.arm.clamped(&robot.q));
            let state = self.phase.state();
            self.record.events.push(Event::StateChanged { time: robot.time, state });
            self.phase_start = robot.time;
        }
        self.last_time = Some(robot.time);
        self.memory.keep(&robot);
        self.fresh_image = false;
        if let Some(depth) = &observation.depth
            && let Some(then) = self.memory.at(observation.depth_time)
        {
            let report = self.eyes.see(depth, &observation.intrinsics, then, &self.arm);
            self.record.images.push(report);
            self.fresh_image = (then.q - robot.q).amax() <= self.config.arm.arrived.si();
        }
        self.motion.advance(&self.arm, robot.dt);
        self.watch_arm(&robot);
        let base_velocity = self.step(&robot);
        self.last_command = Command {
            arm_q: (*self.motion.q()).into(),
            base_velocity,
            finger_q: self.fingers.opening,
            finger_force: self.fingers.force,
        };
        self.last_command
    }

    fn record(&self) -> &Record {
        &self.record
    }
}
