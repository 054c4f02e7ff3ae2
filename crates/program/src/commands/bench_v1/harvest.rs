//! The harvest task: a robot picks fruit for a limited time.

use std::path::Path;

use orchard_bench::store::Store;
use orchard_scenario::Scenario;
use orchard_tasks::harvest::Episodes;
use orchard_tasks::harvest::command_log::{CommandLogs, MergeLogsError};
use orchard_tasks::harvest::episode::EpisodeRecord;
use orchard_tasks::harvest::plan::Plan;
use orchard_tasks::harvest::summary::Summary;
use orchard_tasks::harvest::{Extent, Harvest};
use orchard_tasks::plan_file::Backend;

use super::bar::RecordProgress;
use super::task::PresentedTask;
use super::{counts, tell_alarms, tell_faults};
use crate::failure::Failure;
use crate::headline;

/// Records episodes into a folder.
#[cfg(feature = "recording")]
use orchard_recording::Recordings;

/// Placeholder in a program built without recordings.
#[cfg(not(feature = "recording"))]
type Recordings = orchard_tasks::harvest::observe::NoObservers;

#[cfg(feature = "recording")]
fn recordings(out: &Path, scenario: &Scenario) -> Result<Recordings, Failure> {
    Ok(Recordings::new(out, orchard_recording::RecordingConfig::paper(), scenario))
}

#[cfg(not(feature = "recording"))]
fn recordings(_: &Path, _: &Scenario) -> Result<Recordings, Failure> {
    Err(Failure::BadInput("--record: this program was built without the feature `recording`".to_owned()))
}

/// Conditions of the matrix under a controller.
pub struct Harvesting {
    harvest: Harvest,
    plan: Plan,
    /// Files beside the records: commands, and recordings where they are asked for.
    watch: (Option<Recordings>, CommandLogs),
}

impl Harvesting {
    /// Plans the conditions, with results in the folder `out`. With `record`, episodes are recorded there, too.
    pub fn new(
        scenario: &Scenario,
        extent: &Extent,
        backend: Backend,
        out: &Path,
        record: bool,
    ) -> Result<Self, Failure> {
        let harvest = Harvest::new(scenario.clone())?;
        let plan = Plan { backend, ..harvest.plan_of(extent.clone())? };
        plan.check()?;
        let recordings = record.then(|| recordings(out, scenario)).transpose()?;
        Ok(Self { harvest, plan, watch: (recordings, CommandLogs::new(out)) })
    }

    /// The matrix.
    #[cfg(feature = "gpu")]
    pub fn harvest(&self) -> &Harvest {
        &self.harvest
    }

    /// The plan.
    #[cfg(feature = "gpu")]
    pub fn plan(&self) -> &Plan {
        &self.plan
    }
}

impl PresentedTask for Harvesting {
    type Record = EpisodeRecord;
    type Summary = Summary;
    type Task<'a> = Episodes<'a, Harvest, (Option<Recordings>, CommandLogs)>;

    fn task(&self) -> Self::Task<'_> {
        Episodes { plan: &self.plan, factory: &self.harvest, watch: &self.watch }
    }

    fn steps(&self) -> u64 {
        self.plan.episodes().iter().map(|key| u64::from(key.horizon_frames)).max().unwrap_or(0)
    }

    fn shown(record: &EpisodeRecord) -> RecordProgress {
        RecordProgress {
            steps: u64::from(record.frames),
            line: format!(
                "{}, seed {} tree {}{}: {} fruit deposited ({} reachable), {} attempts, {} dropped",
                record.key.condition,
                record.key.seed,
                record.key.world,
                if record.key.repeat > 0 { format!(" repeat {}", record.key.repeat) } else { String::new() },
                record.deposited().count(),
                record.reachable_count,
                record.attempts.len(),
                record.dropped().count(),
            ),
        }
    }

    fn report(&self, summary: &Summary, _: &Store) -> Result<(), Failure> {
        report(summary, &self.plan);
        let (logs, bytes) = self.watch.1.size();
        say!(
            "commands of {logs} episodes, {:.1} MB, in {}",
            bytes as f64 * 1e-6,
            self.watch.1.folder().display()
        );
        Ok(())
    }

    fn merge_files(&self, records: &[EpisodeRecord], from: &[&Store], _: &Store) -> Result<(), Failure> {
        let roots: Vec<&Path> = from.iter().map(|store| store.path()).collect();
        let missing = self.watch.1.merge(records, &roots).map_err(|e| match e {
            MergeLogsError::Log(e) => Failure::BadInput(e.to_string()),
            MergeLogsError::Store(e) => Failure::Failed(e.to_string()),
        });
        match missing? {
            0 => {}
            n => note!("note: the parts hold no commands of {n} episodes"),
        }
        Ok(())
    }
}

fn report(summary: &Summary, plan: &Plan) {
    if summary.quarantined > 0 {
        say!("QUARANTINED: {} worlds became implausible; they count as zero harvest", summary.quarantined);
    }
    say!("task harvest, controller {}; seeds {:?}", summary.controller, summary.seeds);
    tell_faults(&summary.gave_up);
    for condition in &plan.conditions {
        let (params, dials) = (&condition.params, &condition.params.dials);
        let ends = summary.conditions.get(&condition.name).map(|of| counts(&of.outcomes));
        say!(
            "condition {}: {} fruit, foliage {}, terrain amplitude {} m; {} trees per seed{} x {} s; outcomes: {}",
            condition.name,
            dials.fruit_count,
            dials.foliage_density,
            dials.terrain_amplitude_m,
            params.trees,
            if params.repeats > 1 { format!(" x {} repeats", params.repeats) } else { String::new() },
            params.horizon_s,
            ends.unwrap_or_default()
        );
        if let Some(of) = summary.conditions.get(&condition.name) {
            tell_alarms(&condition.name, &of.alarms);
        }
    }
    say!("{}", headline::report(summary, plan).trim_end());
}
