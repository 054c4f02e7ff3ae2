//! Demonstrations in a folder, as `orchard demos` writes them.

use orchard_bench::store::Store;
use orchard_demos::{Drive, DrivenDemos, DrivenError};
use orchard_env::{Settings, Task};
use orchard_scenario::Scenario;

use crate::demonstration::{DrivenFrame, Shelf, Start};

/// A folder of demonstrations.
pub struct DemoFolder {
    store: Store,
    settings: Settings,
}

impl DemoFolder {
    /// A folder, and the task, with the observations and actions that are written.
    pub fn new(store: Store, settings: Settings) -> Self {
        Self { store, settings }
    }

    fn of(&self, scenario: &Scenario) -> Result<DrivenDemos<'_>, String> {
        DrivenDemos::new(scenario, &self.settings, &self.store).map_err(|e| told(&e))
    }
}

fn told(e: &DrivenError) -> String {
    e.to_string()
}

impl Shelf for DemoFolder {
    fn start(&self, scenario: &Scenario, seed: u64) -> Result<Start, String> {
        let (index, goal) = self.of(scenario)?.start(seed).map_err(|e| told(&e))?;
        Ok(Start { index, goal })
    }

    fn keep(&mut self, scenario: &Scenario, seed: u64, frames: &[DrivenFrame]) -> Result<String, String> {
        let mut drive = Drive::default();
        frames.iter().for_each(|frame| drive.push(frame.command, &frame.phase));
        let record = self.of(scenario)?.add(seed, &drive).map_err(|e| told(&e))?;
        let folder = self.store.path().display();
        let Some(demo) = record.demonstration else {
            return Err(format!("seed {seed} has no episode: {}", record.never_began.unwrap_or_default()));
        };
        let (time, fruit) = (demo.statistics.time, demo.statistics.deposited);
        let done = match self.settings.task {
            Task::Harvest => format!("{fruit} fruit in the bucket, "),
            Task::Reach | Task::Gentle => String::new(),
        };
        Ok(format!("wrote the demonstration of seed {seed} to {folder}: {time:.1} s, {done}{}", demo.outcome))
    }
}
