//! `cargo xtask bench-v1`: the benchmark.

use std::path::PathBuf;
use std::sync::Mutex;

use clap::ValueEnum;
use indicatif::{ProgressBar, ProgressStyle};
use orchard_bench::episode::EpisodeRecord;
use orchard_bench::harvest::Harvest;
use orchard_bench::plan::Plan;
use orchard_bench::protocol::Protocol;
use orchard_bench::store::Store;
use orchard_bench::{Progress, RunError, RunResult, run as run_plan};

use crate::failure::Failure;
use crate::{headline, interrupt};

/// Grows trees, lets the robot harvest them and writes the metrics.
#[derive(clap::Args)]
#[command(
    after_help = "Files:\n  DIR/summary.json      metrics with 95 % intervals, zones, failure reasons\n  \
DIR/episodes/*.json   one a tree: every attempt, event and fruit\n  \
DIR/compute.json      wall time and machine, and nothing else\n\
The first two are the same bytes on every run of one command, for any number of threads.\n\
Ctrl-C leaves whole files only; the same command then goes on where it stopped.\n\n\
Examples:\n  cargo xtask bench-v1\n  cargo xtask bench-v1 --profile full --threads 2 --out results/full\n  \
cargo xtask bench-v1 --seeds 1,2,3 --trees 2 --horizon 20"
)]
pub struct Args {
    /// How much to run: quick is 1 seed x 6 trees x 40 s, full is 3 seeds x 6 trees x 75 s.
    #[arg(long, value_enum, default_value_t = ProfileName::Quick)]
    profile: ProfileName,
    /// Seeds: `tuning` for the three tuning seeds, or a list A,B,.. [default: by profile]
    #[arg(long, value_name = "tuning|A,B,..")]
    seeds: Option<Seeds>,
    /// Trees a seed [default: by profile]
    #[arg(long, value_name = "N")]
    trees: Option<u32>,
    /// Length of an episode in seconds [default: by profile]
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    horizon: Option<f64>,
    /// Threads [default: as many as the machine has]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    threads: Option<u32>,
    /// Where the results go [default: results/bench-v1-PROFILE]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ProfileName {
    Quick,
    Full,
}

impl ProfileName {
    fn name(self) -> &'static str {
        match self {
            ProfileName::Quick => "quick",
            ProfileName::Full => "full",
        }
    }
}

#[derive(Debug, Clone, PartialEq, Eq)]
enum Seeds {
    Tuning,
    List(Vec<u64>),
}

impl std::str::FromStr for Seeds {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "tuning" {
            return Ok(Seeds::Tuning);
        }
        text.split(',')
            .map(|seed| {
                seed.trim()
                    .parse()
                    .map_err(|_| format!("'{seed}' is neither 'tuning' nor a whole number >= 0"))
            })
            .collect::<Result<_, _>>()
            .map(Seeds::List)
    }
}

pub fn run(args: &Args) -> Result<(), Failure> {
    let harvest = Harvest::paper();
    let protocol = Protocol::paper();
    let plan = plan(args, &harvest, &protocol).map_err(Failure::BadInput)?;
    plan.check().map_err(|e| Failure::BadInput(e.to_string()))?;
    let threads = args.threads.map_or_else(
        || std::thread::available_parallelism().map_or(1, std::num::NonZero::get),
        |threads| threads as usize,
    );
    let out = args
        .out
        .clone()
        .unwrap_or_else(|| PathBuf::from(format!("results/bench-v1-{}", args.profile.name())));
    let store = Store::open(&out).map_err(|e| Failure::BadInput(format!("--out: {e}")))?;

    let stop = interrupt::listen()?;
    let progress = Bar::new(&plan);
    let result = run_plan(&plan, &harvest, &store, threads, stop, &progress);
    progress.bar.finish_and_clear();
    match result {
        Ok(result) => {
            report(&result, &plan);
            println!("results: {}", out.join("summary.json").display());
            Ok(())
        }
        Err(e @ RunError::Interrupted { .. }) => Err(Failure::Interrupted(e.to_string())),
        Err(e) => Err(Failure::Failed(e.to_string())),
    }
}

fn plan(args: &Args, harvest: &Harvest, protocol: &Protocol) -> Result<Plan, String> {
    let profile = match args.profile {
        ProfileName::Quick => &protocol.quick,
        ProfileName::Full => &protocol.full,
    };
    let seeds = match &args.seeds {
        Some(Seeds::List(seeds)) => seeds.clone(),
        Some(Seeds::Tuning) => protocol.tuning_seeds.clone(),
        None => protocol.tuning_seeds.iter().copied().take(profile.seeds.get() as usize).collect(),
    };
    let trees = args.trees.unwrap_or_else(|| profile.trees.get());
    let trees = profile.trees.with_value(trees).map_err(|e| format!("--trees: {e}"))?;
    let horizon = args.horizon.unwrap_or_else(|| profile.horizon.value());
    let horizon = profile.horizon.with_value(horizon).map_err(|e| format!("--horizon: {e}"))?;
    Ok(harvest.plan(args.profile.name(), seeds, trees.get(), horizon.si()))
}

fn report(result: &RunResult, plan: &Plan) {
    let Some(condition) = result.summary.conditions.get(&plan.condition) else { return };
    println!(
        "condition {}: {} fruit, foliage {}; seeds {:?} x {} trees x {} s",
        plan.condition,
        plan.params.fruit_count,
        plan.params.foliage_density,
        plan.seeds,
        plan.params.trees,
        plan.params.horizon_s
    );
    print!("{}", headline::table(condition, &plan.protocol));
    let counts = |counts: &std::collections::BTreeMap<String, u32>| {
        let list: Vec<String> = counts.iter().map(|(name, n)| format!("{name} {n}")).collect();
        if list.is_empty() { "none".to_owned() } else { list.join(", ") }
    };
    println!("episodes ended: {}", counts(&condition.outcomes));
    println!("failed attempts: {}", counts(&condition.failures));
    println!(
        "{:.0} s on {} threads; {} world-seconds a second",
        result.compute.wall_s,
        result.compute.threads,
        result.compute.world_seconds_per_s.map_or_else(|| "-".to_owned(), |x| format!("{x:.1}"))
    );
}

/// A progress bar on a terminal, a line an episode elsewhere.
struct Bar {
    bar: ProgressBar,
    horizon_frames: u64,
    total: usize,
    done: Mutex<usize>,
}

impl Bar {
    fn new(plan: &Plan) -> Self {
        let (total, horizon_frames) = (plan.episodes().len(), u64::from(plan.horizon_frames()));
        let bar = ProgressBar::new(total as u64 * horizon_frames);
        if let Ok(style) =
            ProgressStyle::with_template("{bar:30} {percent:>3} %  {msg}  {elapsed} (about {eta} left)")
        {
            bar.set_style(style);
        }
        bar.set_message(format!("0/{total} trees"));
        Self { bar, horizon_frames, total, done: Mutex::new(0) }
    }

    fn say(&self, line: &str) {
        if self.bar.is_hidden() {
            eprintln!("{line}");
        } else {
            self.bar.println(line);
        }
    }
}

impl Progress for Bar {
    fn frame(&self) {
        self.bar.inc(1);
    }

    fn episode(&self, record: &EpisodeRecord, reused: bool) {
        let computed = if reused { 0 } else { u64::from(record.frames) };
        self.bar.inc(self.horizon_frames.saturating_sub(computed));
        // A poisoned counter only means that another thread panicked; the run ends with that.
        let mut done = self.done.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        *done += 1;
        self.bar.set_message(format!("{done}/{} trees", self.total));
        self.say(&format!(
            "{done}/{}  seed {} tree {}: {} fruit deposited ({} reachable), {} attempts, {} dropped{}",
            self.total,
            record.key.seed,
            record.key.world,
            record.deposited().count(),
            record.reachable_count,
            record.attempts.len(),
            record.dropped().count(),
            if reused { " (stored)" } else { "" }
        ));
    }

    fn note(&self, line: &str) {
        self.say(&format!("note: {line}"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seeds_on_the_command_line() {
        assert_eq!("tuning".parse(), Ok(Seeds::Tuning));
        assert_eq!("5, 6".parse(), Ok(Seeds::List(vec![5, 6])));
        for bad in ["", "5,", "-1", "1.5", "all"] {
            assert!(bad.parse::<Seeds>().is_err(), "{bad}");
        }
    }
}
