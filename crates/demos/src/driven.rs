//! Demonstrations that a person drove, added to a folder one by one.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use orchard_bench::record::Record as _;
use orchard_bench::store::{Store, Stored};
use orchard_bench::task::{NoProgress, RunError, Session};
use orchard_env::{EnvError, Settings, TaskEnv, Via};
use orchard_picker::Goal;
use orchard_robot::Command;
use orchard_scenario::Scenario;

use crate::meta::{Meta, MetaError};
use crate::person::person;
use crate::plan::{DemosError, Plan, held_out};
use crate::record::DemoRecord;
use crate::run::{Demos, read_files, write_plan};
use crate::take::{Played, StoredStep};

/// An episode as it was driven: the command of every frame from the start of the world, and who gave it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Drive {
    commands: Vec<Command>,
    phases: Vec<String>,
}

impl Drive {
    /// Adds the command of the next frame; `phase` tells who gave it: [`crate::PERSON`], or the state of a controller.
    pub fn push(&mut self, command: Command, phase: &str) {
        self.commands.push(command);
        self.phases.push(phase.to_owned());
    }

    /// Frames so far.
    pub fn frames(&self) -> usize {
        self.commands.len()
    }

    /// The whole steps of so many frames, to be played in an environment: commands of every frame, and a step for each.
    pub(crate) fn steps(&self, frames: usize) -> Played {
        let whole = self.commands.len() / frames * frames;
        let step =
            |phase: &String| StoredStep { action: Vec::new(), error: Vec::new(), phase: phase.clone() };
        Played {
            steps: self.phases[..whole].iter().step_by(frames).map(step).collect(),
            commands: self.commands[..whole].to_vec(),
        }
    }
}

/// A demonstration that cannot be added.
#[derive(Debug, thiserror::Error)]
pub enum DrivenError {
    /// Settings, a seed or a scenario that cannot be used.
    #[error(transparent)]
    Plan(#[from] DemosError),
    /// There is no world to start in.
    #[error(transparent)]
    Env(#[from] EnvError),
    /// `meta.json` of the folder cannot be used.
    #[error(transparent)]
    Meta(#[from] MetaError),
    /// The folder holds other demonstrations, or a file cannot be written.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The seed has a demonstration.
    #[error("seed {0} has a demonstration in the folder; take another seed")]
    Taken(u64),
    /// A file of an earlier demonstration is not as it was written.
    #[error("{0}: is damaged or was edited; move it out of the folder with the other files of its seed")]
    Damaged(String),
    /// Less than a step was driven.
    #[error("{frames} frames are less than a step of {step}; drive on")]
    Short {
        /// Frames that were driven.
        frames: usize,
        /// Frames of a step.
        step: u32,
    },
}

/// A task as a person demonstrates it in a scenario, and the folder of the files.
pub struct DrivenDemos<'a> {
    scenario: Scenario,
    settings: Settings,
    store: &'a Store,
}

impl<'a> DrivenDemos<'a> {
    /// Demonstrations in a scenario, whose controller does not matter, in a folder.
    ///
    /// # Errors
    /// Settings that do not fit the scenario, or a folder with other demonstrations.
    pub fn new(scenario: &Scenario, settings: &Settings, store: &'a Store) -> Result<Self, DrivenError> {
        let demos = Self { scenario: scenario.with_controller(person()), settings: settings.clone(), store };
        demos.plan(vec![FREE])?;
        demos.seeds()?;
        Ok(demos)
    }

    fn plan(&self, seeds: Vec<u64>) -> Result<Plan, DrivenError> {
        let episodes = seeds.len() as u32;
        Ok(Plan::new(self.scenario.clone(), self.settings.clone(), Via::Commands, seeds, episodes)?)
    }

    /// Seeds of the demonstrations in the folder, in the order in which they were added.
    ///
    /// # Errors
    /// The folder holds other demonstrations, or a damaged one.
    pub fn seeds(&self) -> Result<Vec<u64>, DrivenError> {
        let root = self.store.path();
        if !root.join(Meta::FILE).exists() {
            return Ok(Vec::new());
        }
        let listed = Meta::read(root)?.seeds;
        if listed.is_empty() {
            return Ok(listed);
        }
        let keys = self.plan(listed.clone())?.keys();
        self.store.check_plan::<DemoRecord>(&keys).map_err(RunError::from)?;
        let mut seeds = Vec::new();
        for (seed, key) in listed.into_iter().zip(&keys) {
            match self.store.stored::<DemoRecord>(key) {
                Stored::Whole(record) if is_whole(root, &record) => seeds.push(seed),
                // Its files were never finished.
                Stored::Missing => {}
                Stored::Whole(_) | Stored::Other | Stored::Damaged => {
                    return Err(DrivenError::Damaged(DemoRecord::path(key)));
                }
            }
        }
        Ok(seeds)
    }

    /// Index of the world in which a demonstration of a seed starts, and the task's goal there, if it has one. It is the seed's first world, or the first after it with a target.
    ///
    /// # Errors
    /// As [`Self::check`], or no world of the seed has a target.
    pub fn start(&self, seed: u64) -> Result<(u32, Option<Goal>), DrivenError> {
        self.check(seed)?;
        if self.settings.task.target().is_none() {
            return Ok((0, None));
        }
        let mut env = TaskEnv::new(&self.scenario, &self.settings, 0..1)?;
        env.reset(&[Some(seed)], &[true])?;
        Ok((env.world(0).map_or(0, |(_, index)| index), env.goal(0)))
    }

    /// Checks that a demonstration of a seed can be added.
    ///
    /// # Errors
    /// A seed of the official set, or one that has a demonstration.
    pub fn check(&self, seed: u64) -> Result<(), DrivenError> {
        held_out(&[seed])?;
        if self.seeds()?.contains(&seed) { Err(DrivenError::Taken(seed)) } else { Ok(()) }
    }

    /// Simulates a driven episode of a seed again, in the world of [`Self::start`], and writes it beside the others as [`crate::run`] does. It ends with the task's own
    /// end, or with the last whole step of the drive, and is marked as truncated then.
    ///
    /// # Errors
    /// The seed cannot be used, less than a step was driven, or a file cannot be written.
    pub fn add(&self, seed: u64, drive: &Drive) -> Result<DemoRecord, DrivenError> {
        self.check(seed)?;
        let mut seeds = self.seeds()?;
        seeds.push(seed);
        let plan = self.plan(seeds)?;
        let step = plan.step_frames();
        let played = drive.steps(step as usize);
        if played.steps.is_empty() {
            return Err(DrivenError::Short { frames: drive.frames(), step });
        }
        let keys = plan.keys();
        let Some(key) = keys.last() else { unreachable!("it has the seed's key") };
        let never = AtomicBool::new(false);
        let session = Session::whole(self.store, 1, &never);
        write_plan(&plan, self.store)?;
        let demos = Demos::new(&plan, self.store).with_drive(key, &played);
        let done = orchard_bench::task::run_task(&demos, &session, &NoProgress)?;
        let record = done.records.into_iter().find(|record| record.key == *key);
        Ok(record.unwrap_or_else(|| unreachable!("a whole run has all records")))
    }
}

/// A seed that is not of the official set, to check everything else by.
const FREE: u64 = 1;

fn is_whole(root: &Path, record: &DemoRecord) -> bool {
    record.demonstration.as_ref().is_none_or(|demo| read_files(root, demo).is_ok())
}
