//! Takes the steps of an episode: under a controller, or as they were stored.

use orchard_env::{Driven, EnvError, TaskEnv, Via};
use orchard_picker::{Controller, Event, Record};
use orchard_robot::{Command, Observation};

/// A step of the only environment.
pub(crate) struct Step {
    pub driven: Driven,
    /// The controller's state at its begin, empty if it logs none.
    pub phase: String,
    /// True if whoever drove ends the episode with it.
    pub is_last: bool,
}

/// A step, or why there is none.
pub(crate) type Taken = Result<Step, EnvError>;

/// Takes a step under a controller of the benchmark.
pub(crate) fn take_under(env: &mut TaskEnv, controller: &mut dyn Controller, via: Via) -> Taken {
    let now = env.truth(0)?.map_or(0.0, |world| world.sense().time);
    let driven = env.drive(0, controller, via)?;
    let entered = controller.record().events.iter().rev().find_map(|event| match event {
        Event::StateChanged { time, state } if *time <= now => Some(serde_json::to_value(state)),
        _ => None,
    });
    let name = entered.and_then(Result::ok).and_then(|name| name.as_str().map(str::to_owned));
    Ok(Step { driven, phase: name.unwrap_or_default(), is_last: false })
}

/// A step as it was stored.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct StoredStep {
    pub action: Vec<f32>,
    pub error: Vec<f64>,
    pub phase: String,
}

/// An episode as it was stored or driven.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Played {
    pub steps: Vec<StoredStep>,
    /// The command of every frame.
    pub commands: Vec<Command>,
}

/// Takes stored steps again: by their actions, as a policy would, or under the stored commands.
pub(crate) struct Playback {
    via: Via,
    steps: std::vec::IntoIter<StoredStep>,
    commands: Commands,
    /// True if the episode ends with the last step, where the task has not ended it before.
    ends: bool,
}

/// A controller that plays commands back, one a frame.
struct Commands {
    commands: Vec<Command>,
    played: usize,
    record: Record,
}

impl Controller for Commands {
    fn act(&mut self, observation: &Observation) -> Command {
        let command = self.commands.get(self.played).copied();
        self.played += 1;
        command.unwrap_or_else(|| Command::still(observation))
    }

    fn record(&self) -> &Record {
        &self.record
    }
}

impl Playback {
    pub fn new(via: Via, Played { steps, commands }: Played, ends: bool) -> Self {
        let commands = Commands { commands, played: 0, record: Record::default() };
        Self { via, steps: steps.into_iter(), commands, ends }
    }

    /// Takes the next step.
    pub fn step(&mut self, env: &mut TaskEnv) -> Taken {
        // A step too many keeps still and differs from the stored ones in its number.
        let still = StoredStep { action: Vec::new(), error: Vec::new(), phase: String::new() };
        let StoredStep { mut action, mut error, phase } = self.steps.next().unwrap_or(still);
        let driven = match self.via {
            // The action is found anew from the commands.
            Via::Commands => env.drive(0, &mut self.commands, Via::Commands)?,
            Via::Actions => {
                let size = env.interface().policy.action.len();
                action.resize(size, 0.0);
                error.resize(size, 0.0);
                let before = env.report(0).statistics.time;
                env.step(&action, &[true])?;
                let frame = env.interface().policy.frame;
                let frames = ((env.report(0).statistics.time - before) / frame).round() as usize;
                let from = self.commands.played;
                self.commands.played += frames;
                let commands = self.commands.commands.get(from..from + frames).unwrap_or_default().to_vec();
                Driven { action, error, commands }
            }
        };
        let is_last = self.ends && self.steps.len() == 0;
        Ok(Step { driven, phase, is_last })
    }
}
