//! The harvest task: a robot picks fruit for a while.

use std::sync::atomic::AtomicBool;

use orchard_bench::episode::{EpisodeKey, EpisodeRecord};
use orchard_bench::harvest::Harvest;
use orchard_bench::plan::Plan;
use orchard_bench::protocol::{ConditionName, Profile, Protocol};
use orchard_bench::store::Store;
use orchard_bench::{OtherPlan, RunResult, run as run_plan, run_watched};
use orchard_recording::{RecordingConfig, Recordings};

use super::bar::{Bar, Shown};
use super::{Args, Scope, counts, ended};
use crate::failure::Failure;
use crate::headline;

/// What the command line asks for.
pub struct Asked {
    harvest: Harvest,
    plan: Plan,
    record: bool,
}

impl Asked {
    /// Reads the command line.
    pub fn read(args: &Args, scope: &Scope, protocol: &Protocol, profile: &Profile) -> Result<Self, Failure> {
        let bad = |e: String| Failure::BadInput(format!("--horizon: {e}"));
        let horizon = args.horizon.unwrap_or_else(|| profile.horizon.value());
        let horizon = profile.horizon.with_value(horizon).map_err(bad)?;
        let names = args.conditions.as_ref().unwrap_or(&profile.conditions);
        if args.repeats.is_some() && !names.contains(&ConditionName::Nominal) {
            let problem = "--repeats: these are of the nominal condition, which --conditions does not name";
            return Err(Failure::BadInput(problem.to_owned()));
        }
        if args.horizon.is_some() && !names.contains(&ConditionName::Nominal) {
            let problem = "is that of the nominal condition, which --conditions does not name";
            return Err(bad(problem.to_owned()));
        }
        let seconds = |name: &ConditionName| match name {
            ConditionName::Nominal => horizon.si(),
            ConditionName::Exhaustion => protocol.exhaustion.horizon.si(),
        };
        let conditions: Vec<_> = names.iter().map(|name| (*name, seconds(name))).collect();
        let harvest = Harvest::paper(args.controller()?);
        let plan = harvest
            .plan_of(args.profile.name(), scope.seeds.clone(), scope.trees, &conditions)
            .repeated(ConditionName::Nominal.name(), scope.repeats);
        plan.check().map_err(|e| Failure::BadInput(e.to_string()))?;
        Ok(Self { harvest, plan, record: args.record })
    }

    /// Keys of all its episodes.
    pub fn keys(&self) -> Vec<EpisodeKey> {
        self.plan.episodes()
    }

    /// Whether the folder takes it.
    pub fn check(&self, store: &Store) -> Result<(), OtherPlan> {
        store.check_plan::<EpisodeRecord>(&self.keys())
    }

    /// Runs it and reports.
    pub fn run(&self, scope: &Scope, store: &Store, stop: &AtomicBool) -> Result<(), Failure> {
        let episodes = self.keys();
        // The bar counts frames; an episode that ends early gives the rest of the longest back.
        let frames = episodes.iter().map(|key| u64::from(key.horizon_frames)).max().unwrap_or(0);
        let bar = Bar::new(episodes.len(), frames, shown);
        let (plan, harvest, threads) = (&self.plan, &self.harvest, scope.threads);
        let result = if self.record {
            let recordings = Recordings::new(&scope.out, RecordingConfig::paper(), harvest.frame());
            run_watched(plan, harvest, store, threads, stop, &bar, &recordings)
        } else {
            run_plan(plan, harvest, store, threads, stop, &bar)
        };
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

fn report(result: &RunResult, plan: &Plan) {
    for condition in &plan.conditions {
        let params = &condition.params;
        say!(
            "condition {}: {} fruit, foliage {}; seeds {:?} x {} trees{} x {} s",
            condition.name,
            params.fruit_count,
            params.foliage_density,
            plan.seeds,
            params.trees,
            if params.repeats > 1 { format!(" x {} repeats", params.repeats) } else { String::new() },
            params.horizon_s
        );
        if let Some(summary) = result.summary.conditions.get(&condition.name) {
            say!("episodes ended: {}", counts(&summary.outcomes));
        }
    }
    say!("{}", headline::report(&result.summary, plan).trim_end());
    say!(
        "{:.0} s on {} threads; {} world-seconds a second",
        result.compute.wall_s,
        result.compute.threads,
        result.compute.world_seconds_per_s.map_or_else(|| "-".to_owned(), |x| format!("{x:.1}"))
    );
}
