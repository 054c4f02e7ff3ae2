//! State machine of the paper's harvest cycle (Algorithm 1 of the paper): scan, align, reach, grasp, pull, deposit.
//!
//! The states are in `baseline/`: `approach.rs` (align, reach), `grasp.rs` (grasp, pull), `deposit.rs` (deposit, retreat), `push.rs` (push);
//! `scan.rs` (scan) is shared with the expert. `docs/computation/robot.md` has the table of states.

mod approach;
mod deposit;
mod grasp;
mod push;

use crate::Controller;
use crate::baseline::approach::{Align, Reach};
use crate::baseline::deposit::{Deposit, Retreat};
use crate::baseline::grasp::{Grasp, Pull};
use crate::baseline::push::Push;
use crate::config::PickerConfig;
use crate::machine::{self, Machine, Phase as _};
use crate::picker_core::{Attempt, PickerCore};
use crate::record::{Record, State};
use crate::robot_state::RobotState;
use crate::scan::Scan;
use orchard_geometry::Vec3;
use orchard_perception::DetectorConfig;
use orchard_robot::{Command, Observation, RobotModel};

/// The baseline picker: geometric perception, arm by damped least squares, dead-reckoned grasp. Its config makes it controller
/// `baseline` or controller `paper`.
#[derive(Debug, Clone)]
pub struct BaselinePicker {
    pub(crate) core: PickerCore,
    phase: Phase,
}

/// State of the state machine, with the memory of that state.
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

impl machine::Phase for Phase {
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

/// Result of one frame of a state.
pub(crate) type Next = machine::Next<Phase>;

impl BaselinePicker {
    /// Makes a picker for one robot, in its state at the start of an episode.
    pub fn new(robot: &RobotModel, detector: DetectorConfig, config: PickerConfig) -> Self {
        let phase = Phase::Scan(Scan::at_start());
        Self { core: PickerCore::new(robot, detector, config, phase.state()), phase }
    }

    /// Present state.
    pub fn state(&self) -> State {
        self.phase.state()
    }

    /// Believed position of the tree's axis, odom \[m\].
    pub fn believed_tree_odom(&self) -> Vec3 {
        self.core.perception.belief.p_odom()
    }

    fn scan(&mut self, mut scan: Scan, robot: &RobotState) -> Next {
        let (velocity, choice) = self.core.look_around(&mut scan, robot);
        let Some(choice) = choice else { return Next::Stay(Phase::Scan(scan), velocity) };
        self.core.commit(robot, choice.track, choice.target, choice.plan);
        Next::Enter(Phase::Align(Align::towards(choice.goal)))
    }
}

impl Machine for BaselinePicker {
    type Phase = Phase;

    fn core(&mut self) -> &mut PickerCore {
        &mut self.core
    }

    fn phase(&mut self) -> &mut Phase {
        &mut self.phase
    }

    fn run(&mut self, phase: Phase, robot: &RobotState) -> Next {
        match phase {
            Phase::Scan(state) => self.scan(state, robot),
            Phase::Align(state) => self.align(state, robot),
            Phase::Reach(state) => self.reach(state, robot),
            Phase::Grasp(state) => self.grasp(state, robot),
            Phase::Push(state) => self.push(state, robot),
            Phase::Pull(state) => self.pull(state, robot),
            Phase::Deposit(state) => self.deposit(state, robot),
            Phase::Retreat(state) => self.retreat(state, robot),
        }
    }

    fn after_failure(&mut self, state: State, attempt: Option<&Attempt>, robot: &RobotState) -> Phase {
        Phase::Retreat(Retreat::after_failure(state, attempt, robot))
    }
}

impl Controller for BaselinePicker {
    fn act(&mut self, observation: &Observation) -> Command {
        Machine::act(self, observation)
    }

    fn record(&self) -> &Record {
        self.core.record()
    }
}
