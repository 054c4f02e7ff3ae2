//! The expert: the baseline's cycle without its pauses, with more senses.
//!
//! One file a group of states in `expert/` (`machine.rs` runs them): `approach.rs` (align, reach), `grasp.rs`, `pull.rs`, `place.rs` (deposit),
//! `retreat.rs`; scanning is shared (`scan.rs`). The states are described in `docs/computation/robot.md`.

mod approach;
mod config;
mod grasp;
mod place;
mod pull;
mod retreat;
mod slots;

pub use config::{EXPERT_TOML, ExpertConfig};

use crate::Controller;
use crate::errand::Errand;
use crate::expert::approach::{Align, Reach};
use crate::expert::grasp::Grasp;
use crate::expert::place::Deposit;
use crate::expert::pull::Pull;
use crate::expert::retreat::Retreat;
use crate::expert::slots::Slots;
use crate::machine::{self, Machine, Phase as _};
use crate::motion::{Pace, WayPoint};
use crate::record::{Record, State};
use crate::rig::{Attempt, Rig};
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
    /// Smoothed force on the hand [N].
    touch: f64,
}

/// What the picker is doing, with what the state remembers.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Phase {
    Scan(Scan),
    Align(Align),
    Reach(Reach),
    Grasp(Grasp),
    Pull(Pull),
    Deposit(Deposit),
    Retreat(Retreat),
}

/// How the hand moves among branches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Care {
    /// Where nothing has been met.
    Usual,
    /// Back from what was met, and on a further try.
    Much,
}

impl Care {
    /// For a target at which so many tries came to nothing.
    fn after(failed: u32) -> Self {
        if failed == 0 { Care::Usual } else { Care::Much }
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
        }
    }
}

/// What a state wants next.
pub(crate) type Next = machine::Next<Phase>;

impl ExpertPicker {
    /// A picker for one robot.
    pub fn new(robot: &RobotModel, detector: DetectorConfig, config: ExpertConfig) -> Self {
        let phase = Phase::Scan(Scan::at_start());
        let rig = Rig::new(robot, detector, config.shared.clone(), phase.state());
        let slots = Slots::new(&rig.arm, &robot.bucket(), &rig.postures.carry(), &config.place);
        Self { rig, slots, config, phase, touch: 0.0 }
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

    /// Starts the arm to a posture among branches: slower, so that it stops soon where it meets one. What the hand feels
    /// counts from here.
    fn swing_among(&mut self, q: JointVector, care: Care) {
        self.touch = 0.0;
        let speed = self.config.unfold.speed.si() * self.share_of_speed(care);
        let pace = Pace { speed, acceleration: self.config.swift.acceleration.si() };
        self.rig.motion.go_through([WayPoint { q, blend: 0.0 }], pace);
    }

    /// Share of its speeds with which the hand moves among branches.
    fn share_of_speed(&self, care: Care) -> f64 {
        match care {
            Care::Usual => 1.0,
            Care::Much => self.config.homing.careful.si(),
        }
    }

    /// Whether something presses on the empty hand.
    fn is_pressed(&self) -> bool {
        self.touch > self.config.feel.touch_max.si()
    }

    /// Whether the fingers still hold what they closed on: held off its middle a fruit may turn and the gap shrink.
    fn still_holds(&self, robot: &RobotState) -> bool {
        robot.width >= self.config.feel.held_width_min.si()
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
}

impl Machine for ExpertPicker {
    type Phase = Phase;

    fn rig(&mut self) -> &mut Rig {
        &mut self.rig
    }

    fn phase(&mut self) -> &mut Phase {
        &mut self.phase
    }

    fn take_in(&mut self, robot: &RobotState) {
        let force = self.rig.tcp_force(robot).norm();
        if force.is_finite() {
            self.touch += (force - self.touch) * self.config.feel.touch_weight.si();
        }
    }

    fn run(&mut self, phase: Phase, robot: &RobotState) -> Next {
        match phase {
            Phase::Scan(state) => self.scan(state, robot),
            Phase::Align(state) => self.align(state, robot),
            Phase::Reach(state) => self.reach(state, robot),
            Phase::Grasp(state) => self.grasp(state, robot),
            Phase::Pull(state) => self.pull(state, robot),
            Phase::Deposit(state) => self.deposit(state, robot),
            Phase::Retreat(state) => self.retreat(state, robot),
        }
    }

    fn after_failure(&mut self, state: State, attempt: Option<&Attempt>, robot: &RobotState) -> Phase {
        self.rig.yield_arm(robot);
        Phase::Retreat(Retreat::after_failure(state, attempt, robot))
    }
}

impl Controller for ExpertPicker {
    fn act(&mut self, observation: &Observation) -> Command {
        Machine::act(self, observation)
    }

    fn record(&self) -> &Record {
        self.rig.record()
    }
}
