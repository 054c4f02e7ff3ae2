//! Nominal harvests of several scenarios on the same trees, in this process and without files.

use std::sync::atomic::AtomicBool;

use indicatif::{ProgressBar, ProgressStyle};
use orchard_bench::Task;
use orchard_scenario::Scenario;
use orchard_statistics::{MetricDefinition, Share};
use orchard_tasks::harvest::episode::{EpisodeKey, EpisodeRecord};
use orchard_tasks::harvest::metrics::METRICS;
use orchard_tasks::harvest::plan::Plan;
use orchard_tasks::harvest::{Episodes, Harvest};
use orchard_tasks::protocol::Protocol;
use rayon::prelude::*;

/// Extent of each scenario's harvests: trees and seconds of an episode.
#[derive(Debug, Clone, Copy)]
pub struct Size {
    /// Trees of the first tuning seed, from world 0.
    pub trees: u32,
    /// Length of an episode \[s\].
    pub horizon: f64,
}

/// Harvests the trees of every scenario; returns their records, scenario by scenario. A bar with the name `title` counts frames.
///
/// # Errors
/// A scenario's rules do not read.
pub fn harvests(
    title: &'static str,
    scenarios: &[Scenario],
    size: Size,
) -> anyhow::Result<Vec<Vec<EpisodeRecord>>> {
    let seeds = Protocol::paper().tuning_seeds[..1].to_vec();
    let planned = scenarios.iter().map(|scenario| -> anyhow::Result<(Harvest, Plan)> {
        let harvest = Harvest::new(scenario.clone())?;
        let plan = harvest.plan(title, seeds.clone(), size.trees, size.horizon);
        plan.check()?;
        Ok((harvest, plan))
    });
    let planned = planned.collect::<anyhow::Result<Vec<_>>>()?;
    let all = planned
        .iter()
        .flat_map(|(harvest, plan)| plan.episodes().into_iter().map(move |key| (harvest, plan, key)));
    let all: Vec<(&Harvest, &Plan, EpisodeKey)> = all.collect();
    let frames = all.iter().map(|(_, _, key)| u64::from(key.horizon_frames)).sum();
    let style =
        ProgressStyle::with_template("{prefix} {bar:30} {percent:>3} %  {elapsed} (about {eta} left)")?;
    let bar = ProgressBar::new(frames).with_style(style).with_prefix(title);
    // Nothing raises it: without files, there is nothing to keep when a user stops the program.
    let stop = AtomicBool::new(false);
    let computed = all.par_iter().with_max_len(1).map(|(harvest, plan, key)| {
        let record = Episodes::unwatched(plan, *harvest).compute(key, &stop, &mut || bar.inc(1))?;
        // An episode may end early.
        let left = |record: &EpisodeRecord| u64::from(key.horizon_frames.saturating_sub(record.frames));
        bar.inc(record.as_ref().map_or(0, left));
        record.ok_or_else(|| anyhow::anyhow!("an episode was stopped"))
    });
    let mut records = computed.collect::<anyhow::Result<Vec<EpisodeRecord>>>()?.into_iter();
    bar.finish_and_clear();
    Ok(scenarios.iter().map(|_| records.by_ref().take(size.trees as usize).collect()).collect())
}

/// The harvest's metric of a name.
///
/// # Panics
/// There is no such metric.
pub fn metric(name: &str) -> &'static MetricDefinition<EpisodeRecord> {
    METRICS.iter().find(|metric| metric.info.name == name).unwrap_or_else(|| unreachable!("no metric {name}"))
}

/// Tree by tree, the shares of a metric.
pub fn shares(metric: &MetricDefinition<EpisodeRecord>, records: &[EpisodeRecord]) -> Vec<Share> {
    records.iter().map(metric.share).collect()
}
