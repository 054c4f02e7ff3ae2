//! The harvest task on a graphics device: many episodes advance together.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use orchard_bench::store::Store;
use orchard_gpu::{Choice, Gpu};
use orchard_lockstep::{Berths, BerthsError, Share, Together};
use orchard_scenario::Scenario;
use orchard_tasks::harvest::command_log::CommandLogs;
use orchard_tasks::harvest::episode::EpisodeRecord;
use orchard_tasks::harvest::plan::{Condition, Plan};
use orchard_tasks::harvest::summary::Summary;
use orchard_tasks::harvest::{Episodes, Extent};
use orchard_tasks::plan_file::Backend;

use super::bar::RecordProgress;
use super::harvest::Harvesting;
use super::task::{PresentedTask, lost_device};
use super::way::Way;
use crate::failure::Failure;

/// Episodes that advance together, unless the command line says otherwise: our own choice.
pub const LANES: usize = 512;

/// Opens a device with berths for worlds of some conditions, up to `lanes` of a kind, and says which of them it cannot step.
pub fn open_berths(
    what: &str,
    shares: &[Share<'_>],
    lanes: usize,
    threads: usize,
) -> Result<Arc<Berths>, Failure> {
    let gpu = Gpu::open(Choice::Any).map_err(|e| Failure::Failed(format!("--backend gpu: {e}")))?;
    say!("{what} on {}: up to {lanes} episodes at once", gpu.info().name);
    let berths = Berths::new(&gpu, shares, lanes, threads).map_err(|e| match e {
        BerthsError::Lockstep(e) => Failure::BadInput(format!("--backend gpu: {e}")),
        BerthsError::Threads(e) => Failure::Failed(e.to_string()),
    })?;
    for (condition, why) in berths.refused() {
        say!("{condition}: computed in f64, since {why}");
    }
    Ok(Arc::new(berths))
}

/// Says where frames were computed, and whether images were not drawn there.
pub fn say_where(berths: &Berths) {
    let tally = berths.tally();
    if let Some(why) = berths.undrawn() {
        say!("images were drawn by the processor from some frame on, since {why}");
    }
    let total = tally.total().max(1) as f64;
    let places: Vec<String> = tally
        .frames
        .iter()
        .map(|(place, frames)| format!("{place} {:.1} %", 100.0 * *frames as f64 / total))
        .collect();
    say!(
        "motion in f32; frames by the place where they were computed: {}; with free fruit, which the processor moves, {:.1} %; contacts that the device left out: {}, unsolved: {}",
        if places.is_empty() { "none".to_owned() } else { places.join(", ") },
        100.0 * tally.free_fruit as f64 / total,
        tally.contacts_lost,
        tally.contacts_unsolved
    );
}

/// Conditions of the matrix under a controller, with motion on a graphics device.
pub struct OnDevice {
    inner: Harvesting,
    plan: Plan,
    together: Together,
    berths: Arc<Berths>,
    logs: CommandLogs,
}

impl OnDevice {
    /// Plans the conditions and opens the device.
    pub fn new(scenario: &Scenario, extent: &Extent, out: &Path, way: Way) -> Result<Self, Failure> {
        if way.record {
            return Err(Failure::BadInput("--record: episodes on a graphics device are not recorded".into()));
        }
        let inner = Harvesting::new(scenario, extent, Backend::Gpu, out, false)?;
        let (harvest, plan) = (inner.harvest().clone(), inner.plan().clone());
        let name = |condition: &Condition| condition.name.clone();
        let scenarios = plan.conditions.iter().map(|own| Ok((name(own), harvest.scenario_of(&own.name)?)));
        let scenarios = scenarios.collect::<Result<Vec<_>, Failure>>()?;
        let mut episodes: BTreeMap<String, usize> = BTreeMap::new();
        for key in plan.episodes() {
            *episodes.entry(key.condition).or_default() += 1;
        }
        let shares: Vec<Share<'_>> = scenarios
            .iter()
            .map(|(condition, scenario)| Share { condition, scenario, episodes: episodes[condition] })
            .collect();
        let lanes = way.lanes.unwrap_or(LANES).min(plan.episodes().len());
        let berths = open_berths("harvest", &shares, lanes, way.threads)?;
        let together = Together::new(harvest, berths.clone());
        Ok(Self { inner, plan, together, berths, logs: CommandLogs::new(out) })
    }
}

impl PresentedTask for OnDevice {
    type Record = EpisodeRecord;
    type Summary = Summary;
    type Task<'a> = Episodes<'a, Together, CommandLogs>;

    fn task(&self) -> Self::Task<'_> {
        Episodes { plan: &self.plan, factory: &self.together, watch: &self.logs }
    }

    fn steps(&self) -> u64 {
        self.inner.steps()
    }

    fn shown(record: &EpisodeRecord) -> RecordProgress {
        Harvesting::shown(record)
    }

    fn report(&self, summary: &Summary, store: &Store) -> Result<(), Failure> {
        self.inner.report(summary, store)?;
        say_where(&self.berths);
        Ok(())
    }

    fn failed(&self) -> Option<String> {
        let why = self.berths.lost()?;
        Some(lost_device(&why))
    }
}
