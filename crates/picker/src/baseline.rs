//! The paper's harvest cycle as a state machine (its Algorithm 1): scan, align, reach, grasp, pull, deposit.
//!
//! One file a group of states in `baseline/`: `approach.rs` (align, reach), `grasp.rs` (grasp, pull), `deposit.rs`
//! (deposit, retreat); scanning is shared (`scan.rs`). The table of states is in `docs/computation/robot.md`.

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
use crate::record::{Record, State};
use crate::rig::{Attempt, Rig};
use crate::robot_state::RobotState;
use crate::scan::Scan;
use orchard_geometry::Vec3;
use orchard_perception::DetectorConfig;
use orchard_robot::{Command, Observation, RobotModel};

/// The baseline picker: geometric perception, damped-least-squares arm, dead-reckoned grasp.
#[derive(Debug, Clone)]
pub struct BaselinePicker {
    pub(crate) rig: Rig,
    phase: Phase,
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

/// What a state wants next.
pub(crate) type Next = machine::Next<Phase>;

impl BaselinePicker {
    /// A picker for one robot.
    pub fn new(robot: &RobotModel, detector: DetectorConfig, config: PickerConfig) -> Self {
        let phase = Phase::Scan(Scan::at_start());
        Self { rig: Rig::new(robot, detector, config, phase.state()), phase }
    }

    /// What the picker is doing.
    pub fn state(&self) -> State {
        self.phase.state()
    }

    /// Where it believes the tree's axis to be, odom.
    pub fn believed_tree_odom(&self) -> Vec3 {
        self.rig.eyes.belief.p_odom()
    }

    fn scan(&mut self, mut scan: Scan, robot: &RobotState) -> Next {
        let (velocity, choice) = self.rig.look_around(&mut scan, robot);
        let Some(choice) = choice else { return Next::Stay(Phase::Scan(scan), velocity) };
        self.rig.commit(robot, choice.track, choice.target, choice.plan);
        Next::Enter(Phase::Align(Align::towards(choice.goal)))
    }
}

impl Machine for BaselinePicker {
    type Phase = Phase;

    fn rig(&mut self) -> &mut Rig {
        &mut self.rig
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
        self.rig.record()
    }
}
