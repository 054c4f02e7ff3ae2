//! The state machine that the controllers of this crate are: a rig and a phase, one step a frame.

use crate::record::{AttemptEnd, FailureReason, State};
use crate::rig::{Attempt, Rig, STILL};
use crate::robot_state::RobotState;
use orchard_robot::{Command, Observation};

/// What a controller is doing, with what the state remembers.
pub(crate) trait Phase: Clone {
    /// Its name in the record.
    fn state(&self) -> State;
}

/// What a state wants next.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Next<P> {
    /// Stay in this state, base velocity as given.
    Stay(P, [f64; 3]),
    /// Go over to another state.
    Enter(P),
    /// Give the target up.
    Fail(FailureReason),
}

/// A controller whose states are phases.
pub(crate) trait Machine {
    type Phase: Phase;

    fn rig(&mut self) -> &mut Rig;

    fn phase(&mut self) -> &mut Self::Phase;

    /// One frame of a phase.
    fn run(&mut self, phase: Self::Phase, robot: &RobotState) -> Next<Self::Phase>;

    /// The phase that follows a failure in a state.
    fn after_failure(&mut self, state: State, attempt: Option<&Attempt>, robot: &RobotState) -> Self::Phase;

    /// Takes in what the sensors say, before the phase runs.
    fn take_in(&mut self, _robot: &RobotState) {}

    /// One frame: from what is observed to a command.
    fn act(&mut self, observation: &Observation) -> Command {
        let Some(robot) = self.rig().sense(observation) else { return self.rig().hold() };
        self.take_in(&robot);
        let base_velocity = self.step(&robot);
        self.rig().command(base_velocity)
    }

    /// Runs the present phase; the base's velocity.
    fn step(&mut self, robot: &RobotState) -> [f64; 3] {
        let phase = self.phase().clone();
        let state = phase.state();
        let phase = match self.run(phase, robot) {
            Next::Stay(phase, base_velocity) => {
                *self.phase() = phase;
                return base_velocity;
            }
            Next::Enter(phase) => phase,
            Next::Fail(reason) => {
                let attempt = self.rig().conclude(robot, AttemptEnd::Failed(reason));
                self.after_failure(state, attempt.as_ref(), robot)
            }
        };
        self.rig().enter(phase.state(), robot);
        *self.phase() = phase;
        STILL
    }
}
