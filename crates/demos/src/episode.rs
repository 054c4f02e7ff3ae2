//! One episode, step by step, into tables and images.

use std::sync::atomic::{AtomicBool, Ordering};

use orchard_bench::digest::{FilesDigest, hex, sha256};
use orchard_bench::store::StoreError;
use orchard_env::{EnvError, TaskEnv};
use orchard_exchange::json;
use orchard_policy::Values;
use orchard_robot::Command;

use crate::images::{Form, png};
use crate::plan::Plan;
use crate::record::{DemoKey, Demonstration, FileRecord, ImagesRecord, Split, stem};
use crate::steps::{Steps, Worth, commands_table};
use crate::table::{Table, TableError};
use crate::take::{Step, Taken};

/// Folders of the tables.
pub(crate) const STEPS: &str = "steps";
pub(crate) const COMMANDS: &str = "commands";

/// Outcome of an episode that whoever drove ended.
const STOPPED: &str = "stopped";

/// An episode that came to its end.
pub(crate) struct Episode {
    pub steps: Table,
    pub commands: Table,
    /// The record, without the tables' files.
    pub record: Demonstration,
}

/// Why an episode did not come to its end.
#[derive(Debug, thiserror::Error)]
pub(crate) enum EpisodeError {
    #[error(transparent)]
    Env(#[from] EnvError),
    #[error(transparent)]
    Store(#[from] StoreError),
    #[error("cannot encode an image of {field}: {problem}")]
    Png { field: &'static str, problem: String },
    #[error(transparent)]
    Table(#[from] TableError),
}

/// Function that receives the images: their paths and bytes.
pub(crate) type Sink<'a> = &'a mut dyn FnMut(&str, &[u8]) -> Result<(), StoreError>;

/// Berths on a graphics device.
#[cfg(feature = "gpu")]
pub(crate) type Berths = orchard_lockstep::Berths;
/// There are none without a device.
#[cfg(not(feature = "gpu"))]
pub(crate) type Berths = std::convert::Infallible;

/// Makes the environment of an episode, at its start, in a berth if there are any.
pub(crate) fn begin(plan: &Plan, key: &DemoKey, berths: Option<&Berths>) -> Result<TaskEnv, EnvError> {
    let (scenario, settings) = (&plan.scenario, &plan.settings);
    let mut env = match berths {
        None => TaskEnv::new(scenario, settings, key.world..key.world + 1)?,
        #[cfg(feature = "gpu")]
        Some(berths) => TaskEnv::in_berth(scenario, settings, key.world, berths.take(Plan::CONDITION))?,
        #[cfg(not(feature = "gpu"))]
        Some(none) => match *none {},
    };
    env.reset(&[Some(key.seed)], &[true])?;
    Ok(env)
}

/// Runs an episode from its start to its end; `None` if `stop` was raised. `take` takes a step, and `on_frame` is called after every frame.
pub(crate) fn run(
    plan: &Plan,
    key: &DemoKey,
    env: &mut TaskEnv,
    take: &mut dyn FnMut(&mut TaskEnv) -> Taken,
    sink: Sink<'_>,
    stop: &AtomicBool,
    on_frame: &mut dyn FnMut(),
) -> Result<Option<Episode>, EpisodeError> {
    let policy = env.interface().policy.clone();
    let mut steps = Steps::new(&policy.observation, policy.action.len());
    let mut images = Images::new(plan, key, policy.observation.len());
    let mut commands: Vec<Command> = Vec::new();
    let Some(world) = env.truth(0)? else { return Err(EnvError::NotStarted { env: 0 }.into()) };
    let tree_sha256 = sha256(json::write(world.skeleton()).as_bytes());
    let drawn = env.world(0).unwrap_or((key.seed, key.world));
    loop {
        if stop.load(Ordering::Relaxed) {
            return Ok(None);
        }
        let frame = env.truth(0)?.map_or(0, |world| world.frame());
        images.take(&policy.observation, env.observation(0), frame, sink)?;
        steps.see(frame, env.observation(0), &images.paths);
        let Step { driven, phase, is_last } = take(env)?;
        driven.commands.iter().for_each(|_| on_frame());
        let report = env.report(0);
        let worth = Worth {
            reward: report.reward,
            cost: report.cost,
            terminated: report.terminated,
            truncated: report.truncated || is_last && !report.terminated,
        };
        steps.act(&driven.action, &driven.error, phase, &worth);
        commands.extend(driven.commands);
        if worth.terminated || worth.truncated {
            break;
        }
    }
    let states = env.snapshot()?;
    let report = env.report(0);
    let record = Demonstration {
        drawn,
        split: Split::of(&tree_sha256, &plan.rules.split),
        tree_sha256,
        task_description: env.interface().task_description.to_owned(),
        outcome: report.outcome.clone().unwrap_or_else(|| STOPPED.to_owned()),
        success: report.is_success,
        statistics: report.statistics.clone(),
        frames: commands.len() as u32,
        action_error: steps.action_error(),
        end_state_sha256: sha256(states.first().map_or(&[], Vec::as_slice)),
        steps: FileRecord::default(),
        commands: FileRecord::default(),
        images: images.record(),
    };
    Ok(Some(Episode { steps: steps.table(), commands: commands_table(&commands), record }))
}

/// Path of a table of an episode.
pub(crate) fn table_path(folder: &str, key: &DemoKey) -> String {
    format!("{folder}/{}.parquet", stem(key))
}

impl Episode {
    /// The whole record, with the bytes of the tables of steps and commands.
    pub fn files(self, key: &DemoKey) -> Result<(Demonstration, [Vec<u8>; 2]), TableError> {
        let (steps, commands) = (self.steps.to_parquet("steps")?, self.commands.to_parquet("commands")?);
        let record = Demonstration {
            steps: FileRecord::of(&table_path(STEPS, key), &steps),
            commands: FileRecord::of(&table_path(COMMANDS, key), &commands),
            ..self.record
        };
        Ok((record, [steps, commands]))
    }
}

/// The images of an episode so far. A field whose image has not changed keeps its file.
struct Images {
    stem: String,
    unit: f64,
    /// The latest image of each field, and the path of its file; none and empty before the first.
    last: Vec<Option<Values>>,
    paths: Vec<String>,
    count: u32,
    unfit: u64,
    digest: FilesDigest,
}

impl Images {
    fn new(plan: &Plan, key: &DemoKey, fields: usize) -> Self {
        Self {
            stem: stem(key),
            unit: plan.rules.depth_unit.si(),
            last: vec![None; fields],
            paths: vec![String::new(); fields],
            count: 0,
            unfit: 0,
            digest: FilesDigest::default(),
        }
    }

    /// Takes the images of an observation in a frame, and gives the new ones to the sink.
    fn take(
        &mut self,
        fields: &[orchard_policy::Field],
        values: &[Values],
        frame: u32,
        sink: Sink<'_>,
    ) -> Result<(), EpisodeError> {
        for (i, (field, values)) in fields.iter().zip(values).enumerate() {
            if !matches!(Form::of(field), Form::Depth | Form::Colour) || self.last[i].as_ref() == Some(values)
            {
                continue;
            }
            let Some(encoded) = png(field, values, self.unit) else { continue };
            let (bytes, unfit) =
                encoded.map_err(|problem| EpisodeError::Png { field: field.key, problem })?;
            let path = format!("{}/{}-{frame:05}.png", field.key, self.stem);
            sink(&path, &bytes)?;
            self.digest.add(&path, &bytes);
            self.unfit += unfit;
            self.count += 1;
            self.paths[i] = path;
            self.last[i] = Some(values.clone());
        }
        Ok(())
    }

    fn record(&self) -> ImagesRecord {
        ImagesRecord {
            count: self.count,
            sha256: hex(&self.digest.clone().finish()),
            unfit_depth_px: self.unfit,
        }
    }
}
