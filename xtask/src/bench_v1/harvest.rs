//! The harvest task: a robot picks fruit for a while.

use std::sync::atomic::AtomicBool;

use orchard_bench::episode::EpisodeRecord;
use orchard_bench::harvest::Harvest;
use orchard_bench::plan::Plan;
use orchard_bench::protocol::Profile;
use orchard_bench::store::Store;
use orchard_bench::{RunResult, run as run_plan};

use super::bar::{Bar, Shown};
use super::{Args, Scope, ended};
use crate::failure::Failure;
use crate::headline;

/// What the command line asks for.
pub struct Asked {
    harvest: Harvest,
    plan: Plan,
}

impl Asked {
    /// Reads the command line.
    pub fn read(args: &Args, scope: &Scope, profile: &Profile) -> Result<Self, Failure> {
        let bad = |e: String| Failure::BadInput(format!("--horizon: {e}"));
        let horizon = args.horizon.unwrap_or_else(|| profile.horizon.value());
        let horizon = profile.horizon.with_value(horizon).map_err(bad)?;
        let harvest = Harvest::paper(args.controller()?);
        let plan = harvest.plan(args.profile.name(), scope.seeds.clone(), scope.trees, horizon.si());
        plan.check().map_err(|e| Failure::BadInput(e.to_string()))?;
        Ok(Self { harvest, plan })
    }

    /// Runs it and reports.
    pub fn run(&self, scope: &Scope, store: &Store, stop: &AtomicBool) -> Result<(), Failure> {
        let frames = u64::from(self.plan.horizon_frames());
        let bar = Bar::new(self.plan.episodes().len(), frames, shown);
        let result = run_plan(&self.plan, &self.harvest, store, scope.threads, stop, &bar);
        bar.clear();
        report(&ended(result)?, &self.plan);
        say!("results: {}", scope.out.join("summary.json").display());
        Ok(())
    }
}

fn shown(record: &EpisodeRecord) -> Shown {
    Shown {
        steps: u64::from(record.frames),
        line: format!(
            "seed {} tree {}: {} fruit deposited ({} reachable), {} attempts, {} dropped",
            record.key.seed,
            record.key.world,
            record.deposited().count(),
            record.reachable_count,
            record.attempts.len(),
            record.dropped().count(),
        ),
    }
}

fn report(result: &RunResult, plan: &Plan) {
    let Some(condition) = result.summary.conditions.get(&plan.condition) else { return };
    say!(
        "condition {}: {} fruit, foliage {}; seeds {:?} x {} trees x {} s",
        plan.condition,
        plan.params.fruit_count,
        plan.params.foliage_density,
        plan.seeds,
        plan.params.trees,
        plan.params.horizon_s
    );
    say!("{}", headline::table(condition, &plan.protocol).trim_end());
    let counts = |counts: &std::collections::BTreeMap<String, u32>| {
        let list: Vec<String> = counts.iter().map(|(name, n)| format!("{name} {n}")).collect();
        if list.is_empty() { "none".to_owned() } else { list.join(", ") }
    };
    say!("episodes ended: {}", counts(&condition.outcomes));
    say!("failed attempts: {}", counts(&condition.failures));
    say!(
        "{:.0} s on {} threads; {} world-seconds a second",
        result.compute.wall_s,
        result.compute.threads,
        result.compute.world_seconds_per_s.map_or_else(|| "-".to_owned(), |x| format!("{x:.1}"))
    );
}
