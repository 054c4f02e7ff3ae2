//! The expert: the baseline's cycle without its pauses, with more senses.
//!
//! One file a group of states in `expert/`: `approach.rs` (align, reach), `grasp.rs`, `pull.rs`, `place.rs` (deposit),
//! `retreat.rs`; scanning is shared (`scan.rs`). The states are described in `docs/computation/robot.md`.

mod approach;
mod config;
mod grasp;
mod place;
mod pull;
mod retreat;
mod slots;

pub(crate) use config::HomingConfig;
pub use config::{EXPERT_TOML, ExpertConfig};

use crate::Controller;
use crate::errand::Errand;
use crate::expert::approach::{Align, Reach};
use crate::expert::grasp::Grasp;
use crate::expert::place::Deposit;
use crate::expert::pull::Pull;
use crate::expert::retreat::Retreat;
use crate::expert::slots::Slots;
use crate::motion::{Pace, WayPoint};
use crate::record::{AttemptEnd, FailureReason, Record, State};
use crate::rig::{Rig, STILL};
use crate::robot_state::RobotState;
use crate::scan::Scan;
use orchard_perception::DetectorConfig;
use orchard_robot::{Command, JointVector, Observation, RobotModel};

/// The expert picker: looks while it moves, corrects the hand on its way, feels wood, stem and fruit, places.
#[derive(Debug, Clone)]
pub struct ExpertPicker {
    rig: Rig,
    config: ExpertConfig,
    slots: Slots,
    phase: Phase,
}

/// What the picker is doing, with what the state remembers.
#[derive(Debug, Clone, PartialEq)]
enum Phase {
    Scan(Scan),
    Align(Align),
    Reach(Reach),
    Grasp(Grasp),
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
            Phase::Grasp(_) => State::Grasp,
            Phase::Pull(_) => State::Pull,
            Phase::Deposit(_) => State::Deposit,
            Phase::Retreat(_) => State::Retreat,
        }
    }
}

/// What a state wants next.
#[derive(Debug, Clone, PartialEq)]
enum Next {
    /// Stay in this state, base velocity as given.
    Stay(Phase, [f64; 3]),
    /// Go over to another state.
    Enter(Phase),
    /// Give the target up.
    Fail(FailureReason),
}

impl ExpertPicker {
    /// A picker for one robot.
    pub fn new(robot: &RobotModel, detector: DetectorConfig, config: ExpertConfig) -> Self {
        let phase = Phase::Scan(Scan::at_start());
        let rig = Rig::new(robot, detector, config.shared.clone(), phase.state());
        let slots = Slots::new(&rig.arm, &robot.bucket(), &rig.postures.carry(), &config.place);
        Self { rig, slots, config, phase }
    }

    /// A picker that does one thing in place of a harvest.
    pub(crate) fn on_errand(
        robot: &RobotModel,
        detector: DetectorConfig,
        config: ExpertConfig,
        errand: Errand,
    ) -> Self {
        let mut picker = Self::new(robot, detector, config);
        picker.rig.errand = Some(errand);
        picker
    }

    /// What the picker is doing.
    pub fn state(&self) -> State {
        self.phase.state()
    }

    /// Starts the arm through way-points, the last of which is the goal.
    fn swing_through(&mut self, way_points: impl IntoIterator<Item = WayPoint>) {
        let pace =
            Pace { speed: self.config.swift.speed.si(), acceleration: self.config.swift.acceleration.si() };
        self.rig.motion.go_through(way_points, pace);
    }

    /// Starts the arm to a posture.
    fn swing_to(&mut self, q: JointVector) {
        self.swing_through([WayPoint { q, blend: 0.0 }]);
    }

    /// The carrying posture, passed in the open.
    fn by_carry(&self) -> WayPoint {
        WayPoint { q: self.rig.postures.carry(), blend: self.config.swift.blend.si() }
    }

    /// Whether there has been no sight for long. With the hand in the bucket the camera is too near to all that it sees.
    fn is_blind(&self, robot: &RobotState) -> bool {
        let eyes = &self.rig.eyes;
        eyes.blind && robot.time - eyes.last_sight > self.config.feel.blind_time.si()
    }

    /// The next target, if one is known; else looks around from here.
    fn next_target(&mut self, robot: &RobotState) -> Next {
        let choice = if self.is_blind(robot) { None } else { self.rig.choose(robot) };
        match choice {
            Some(choice) => {
                self.rig.commit(robot, choice.track, choice.target, choice.plan);
                Next::Enter(Phase::Align(Align::towards(choice.goal)))
            }
            None => Next::Enter(Phase::Scan(Scan::here())),
        }
    }

    fn scan(&mut self, mut scan: Scan, robot: &RobotState) -> Next {
        let (velocity, choice) = self.rig.look_around(&mut scan, robot);
        let Some(choice) = choice else { return Next::Stay(Phase::Scan(scan), velocity) };
        self.rig.commit(robot, choice.track, choice.target, choice.plan);
        Next::Enter(Phase::Align(Align::towards(choice.goal)))
    }

    fn step(&mut self, robot: &RobotState) -> [f64; 3] {
        let next = match self.phase.clone() {
            Phase::Scan(state) => self.scan(state, robot),
            Phase::Align(state) => self.align(state, robot),
            Phase::Reach(state) => self.reach(state, robot),
            Phase::Grasp(state) => self.grasp(state, robot),
            Phase::Pull(state) => self.pull(state, robot),
            Phase::Deposit(state) => self.deposit(state, robot),
            Phase::Retreat(state) => self.retreat(state, robot),
        };
        let phase = match next {
            Next::Stay(phase, base_velocity) => {
                self.phase = phase;
                return base_velocity;
            }
            Next::Enter(phase) => phase,
            Next::Fail(reason) => {
                self.rig.motion.stop();
                let attempt = self.rig.conclude(robot, AttemptEnd::Failed(reason));
                Phase::Retreat(Retreat::after_failure(self.phase.state(), attempt.as_ref(), robot))
            }
        };
        self.rig.enter(phase.state(), robot);
        self.phase = phase;
        STILL
    }
}

impl Controller for ExpertPicker {
    fn act(&mut self, observation: &Observation) -> Command {
        let Some(robot) = self.rig.sense(observation) else { return self.rig.hold() };
        let base_velocity = self.step(&robot);
        self.rig.command(base_velocity)
    }

    fn record(&self) -> &Record {
        self.rig.record()
    }
}
