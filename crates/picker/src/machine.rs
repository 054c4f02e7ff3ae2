//! State machine of the controllers of this crate: a core and a phase, one step each frame.

use crate::picker_core::{Attempt, PickerCore, STILL};
use crate::record::{AttemptEnd, FailureReason, State};
use crate::robot_state::RobotState;
use orchard_robot::{Command, Observation};

/// State of a controller, with the memory of that state.
pub(crate) trait Phase: Clone {
    /// Name of the state in the record.
    fn state(&self) -> State;
}

/// Result of one frame of a state.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Next<P> {
    /// Stay in this state, with a base velocity [m/s, m/s, rad/s].
    Stay(P, [f64; 3]),
    /// Enter another state.
    Enter(P),
    /// Give the target up.
    Fail(FailureReason),
}

/// A controller as a state machine.
pub(crate) trait Machine {
    type Phase: Phase;

    fn core(&mut self) -> &mut PickerCore;

    fn phase(&mut self) -> &mut Self::Phase;

    /// Runs one frame of a phase.
    fn run(&mut self, phase: Self::Phase, robot: &RobotState) -> Next<Self::Phase>;

    /// Returns the phase that follows a failure in a state.
    fn after_failure(&mut self, state: State, attempt: Option<&Attempt>, robot: &RobotState) -> Self::Phase;

    /// Updates the controller from the sensors before the phase runs.
    fn take_in(&mut self, _robot: &RobotState) {}

    /// Takes note of a frame whose sensors could not be read.
    fn miss(&mut self) {}

    /// Runs one frame: returns the command for an observation.
    fn act(&mut self, observation: &Observation) -> Command {
        let Some(robot) = self.core().sense(observation) else {
            self.miss();
            return self.core().hold();
        };
        self.take_in(&robot);
        let base_velocity = self.step(&robot);
        self.core().command(base_velocity)
    }

    /// Runs the present phase and returns the base's velocity [m/s, m/s, rad/s].
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
                let attempt = self.core().conclude(robot, AttemptEnd::Failed(reason));
                self.after_failure(state, attempt.as_ref(), robot)
            }
        };
        self.core().enter(phase.state(), robot);
        *self.phase() = phase;
        STILL
    }
}
