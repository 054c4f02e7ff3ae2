//! `orchard bench-v1`: the benchmark.

pub mod bar;
mod component;
mod detect;
mod harvest;
pub mod plans;
pub mod scaling;
pub mod task;
#[cfg(feature = "gpu")]
pub mod together;
mod way;

use std::collections::BTreeMap;
use std::path::PathBuf;

use clap::ValueEnum;
use orchard_bench::{Session, Shard};
use orchard_tasks::plan_file::Backend;
use orchard_tasks::plan_file::PlanFile;
use orchard_tasks::protocol::Protocol;
use orchard_tasks::seeds::SeedSetName;

use crate::args::ScenarioArgs;
use crate::failure::Failure;
use crate::out_folder::open_folder;
use crate::program::Program;

/// Runs the benchmark: grows trees, lets the robot harvest them or a detector find fruit, and writes the metrics.
#[derive(clap::Args)]
#[command(
    after_help = "Tasks:\n  harvest   the robot picks fruit for a limited time, under every condition of the matrix on the same trees\n  \
detect    single depth images by a free camera, 8 per tree at each of 5 foliage densities: precision, recall,\n            \
errors, canopy zones, and the detector with each of its gates switched off\n  \
reach-and-grasp\n            hold a named fruit: success, time, path, loads on the wood\n  \
gentle    push the hand through the canopy to a point behind it: success, time, loads on the wood\n  \
scaling   frames per second of batches of 1 to 512 trees, by solver and by the differences between trees; no robot\n\n\
--backend gpu moves the worlds of all tasks but detect on a graphics device, in f32; cameras, rules and controllers stay on the\n\
CPU. Such results are marked and belong on no leaderboard (docs/computation/gpu-world.md).\n\n\
Files:\n  DIR/plan.json         the options of every task\n  \
DIR/summary.json      harvest: metrics with 95 % intervals, zones, failure reasons, times of states, and the\n                        \
sweeps' conditions tested against the nominal one, tree by tree\n  \
DIR/episodes/*.json   one per episode: every attempt, event and fruit\n  \
DIR/recordings/*.mcap with --record: one per episode, for Foxglove and `orchard replay` (docs/recording.md)\n  \
DIR/detect.json       detect: metrics with 95 % intervals by foliage density, zones, ablation\n  \
DIR/detect/*.json     one per tree: every image, fruit seen and detection\n  \
DIR/detect.svg        precision and recall against foliage density\n  \
                  DIR/detect-precision-recall.svg   precision over recall, as the score's threshold falls\n  \
DIR/TASK.json         reach-and-grasp, gentle: metrics with 95 % intervals\n  \
DIR/TASK/*.json       one per tree: every trial\n  \
DIR/scaling.json      scaling: step rates and memory by worlds, solver and mode\n  \
DIR/compute.json      wall times, step rates, memory and machine\n\
All files but compute.json and scaling.json have the same bytes on every run of one command, for any number of threads or shards.\n\
Ctrl-C and SIGTERM leave only complete files; the same command continues from there. A folder with results of another plan\n\
(controller, condition, seeds, horizon, camera, ..) or in use by another run is refused.\n\n\
Examples:\n  orchard bench-v1                            the quick profile\n  \
orchard bench-v1 --profile full --controller expert\n  \
orchard bench-v1 --profile full --controller expert --seeds v1      an official score\n  \
orchard bench-v1 --profile full --conditions exhaustion\n  \
orchard bench-v1 --conditions foliage,terrain-0.2 --seeds 1,2,3 --trees 2 --horizon 20 --out results/mine\n  \
orchard bench-v1 --seeds tuning --conditions nominal --repeats 3\n  \
orchard bench-v1 --tasks detect --profile full --camera d435i\n  \
orchard bench-v1 --tasks reach-and-grasp,gentle --controller expert\n  \
orchard bench-v1 --tasks scaling --backend gpu\n  \
orchard bench-v1 --tasks harvest --backend gpu --conditions nominal --seeds 5 --trees 100 --controller expert\n  \
orchard bench-v1 --profile full --shard 3/8 --out parts/3    one part of eight, then orchard merge"
)]
pub struct Args {
    /// Tasks to run [default: all, or those that the given options belong to]
    #[arg(long, value_enum, value_delimiter = ',')]
    tasks: Option<Vec<TaskName>>,
    #[command(flatten)]
    run: RunArgs,
}

/// Options of a run of either benchmark.
#[derive(Clone, clap::Args)]
pub struct RunArgs {
    /// Size of the run: seeds, trees and time, of every condition that the profile names
    #[arg(long, value_enum, default_value_t = ProfileName::Quick)]
    profile: ProfileName,
    /// Seeds: `tuning` (three seeds for tuning), the official set of the benchmark (`v1` or `field-v1`, not for tuning), or a list A,B,..
    /// [default: tuning, as many as the profile sets]
    #[arg(long, value_name = "tuning|SET|A,B,..")]
    seeds: Option<Seeds>,
    /// Trees per seed [default: by seed set and profile]
    #[arg(long, value_name = "N")]
    trees: Option<u32>,
    /// Nominal episodes per tree, each from another start pose of the robot, to separate the variance within trees from that between trees
    /// [default: by seed set; 1 on other seeds]
    #[arg(long, value_name = "N")]
    repeats: Option<u32>,
    /// Length of a harvest episode in seconds; does not apply to exhaustion [default: by profile]
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    horizon: Option<f64>,
    /// Conditions of the harvest: names of conditions, groups and sweeps; one value of a sweep, such as foliage-1.5; exhaustion: nominal until no
    /// reachable fruit is left, at most 600 s [default: by profile]
    #[arg(long, value_name = "A,B,..", value_delimiter = ',')]
    conditions: Option<Vec<String>>,
    /// Record every harvest episode as an MCAP file, about 20 MB for 75 s; episodes without a complete recording are run again
    #[arg(long)]
    record: bool,
    #[command(flatten)]
    scenario: ScenarioArgs,
    /// Processor that moves the worlds: cpu, or gpu (any Vulkan, Metal or DirectX 12 device). Cameras and
    /// controllers always run on the CPU [default: cpu]
    #[arg(long, value_name = "cpu|gpu")]
    backend: Option<Backend>,
    /// Episodes, or trees of a task with trials, that advance together on a graphics device [default: all, at most 512]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=16384))]
    lanes: Option<u32>,
    /// Threads [default: as many as the machine has]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    threads: Option<u32>,
    /// Compute only part I of N: every N-th record; `orchard merge` combines the parts
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Folder for the results: new, or with results of the same plan [default: results/BENCHMARK-PROFILE, followed by the options that
    /// change the plan, such as -expert or -v1]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

impl RunArgs {
    /// The harvest alone.
    pub fn of_harvest(self) -> Args {
        Args { tasks: Some(vec![TaskName::Harvest]), run: self }
    }
}

/// A benchmark: the name of its command and of its protocol, if that is not v1.
#[derive(Debug, Clone, Copy)]
pub struct Benchmark {
    /// Name of the command.
    pub command: &'static str,
    /// Name of the protocol.
    pub protocol: Option<&'static str>,
}

/// A task of the benchmark.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum TaskName {
    Harvest,
    Detect,
    ReachAndGrasp,
    Gentle,
    Scaling,
}

impl TaskName {
    /// Name on command lines and in results.
    fn name(self) -> &'static str {
        match self {
            Self::Harvest => "harvest",
            Self::Detect => "detect",
            Self::ReachAndGrasp => "reach-and-grasp",
            Self::Gentle => "gentle",
            Self::Scaling => "scaling",
        }
    }

    /// All tasks, in the order in which they are run.
    const ALL: [Self; 5] = [Self::Harvest, Self::Detect, Self::ReachAndGrasp, Self::Gentle, Self::Scaling];
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

/// Seeds of a run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Seeds {
    Set(SeedSetName),
    List(Vec<u64>),
}

impl Seeds {
    /// Returns the seeds as a list.
    ///
    /// # Errors
    /// A set that is not of this benchmark.
    pub fn resolve(&self, protocol: &Protocol) -> Result<Vec<u64>, String> {
        match self {
            Seeds::List(seeds) => Ok(seeds.clone()),
            Seeds::Set(SeedSetName::Tuning) => Ok(protocol.tuning_seeds.clone()),
            Seeds::Set(set) if *set == protocol.official => Ok(protocol.official_seeds()),
            Seeds::Set(set) => {
                Err(format!("--seeds {set}: the sets of this benchmark are tuning and {}", protocol.official))
            }
        }
    }

    /// True for a set of official seeds.
    fn is_official(&self) -> bool {
        matches!(self, Seeds::Set(set) if set.is_official())
    }
}

/// Number of threads of the machine.
pub fn default_threads() -> usize {
    std::thread::available_parallelism().map_or(1, std::num::NonZero::get)
}

impl std::str::FromStr for Seeds {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let named =
            SeedSetName::ALL.into_iter().find(|set| set.name() == text && *set != SeedSetName::Custom);
        if let Some(set) = named {
            return Ok(Seeds::Set(set));
        }
        text.split(',')
            .map(|seed| {
                seed.trim().parse().map_err(|_| {
                    format!("'{seed}' is not a seed: use 'tuning', 'v1' or 'field-v1', or whole numbers >= 0")
                })
            })
            .collect::<Result<_, _>>()
            .map(Seeds::List)
    }
}

/// The benchmark of this command.
const BENCHMARK: Benchmark = Benchmark { command: "bench-v1", protocol: None };

pub fn run(args: &Args, program: &Program) -> Result<(), Failure> {
    run_benchmark(args, BENCHMARK, program)
}

/// Runs tasks of a benchmark.
///
/// # Errors
/// Bad input, a run that was interrupted or failed.
pub fn run_benchmark(args: &Args, benchmark: Benchmark, program: &Program) -> Result<(), Failure> {
    let RunArgs { record, shard, threads, .. } = args.run;
    // All input is checked before anything is computed.
    let scenario = args.run.scenario.resolve(program)?;
    let scenario = benchmark.protocol.map_or(scenario.clone(), |name| scenario.on_protocol(name));
    let plans = plans::plans(args, &scenario)?;
    let out = args.run.out.clone().unwrap_or_else(|| plans::default_out(args, benchmark));
    let threads = threads.map_or_else(default_threads, |threads| threads as usize);
    let way = way::Way { record, lanes: args.run.lanes.map(|lanes| lanes as usize), threads };
    let tasks = plans.iter().map(|plan| plans::task(plan, &scenario, &out, Some(way)));
    let tasks = tasks.collect::<Result<Vec<_>, Failure>>()?;
    // A missing device is reported before the first task starts.
    scaling::check_device(&plans, &scenario)?;
    let (store, _lock) = open_folder("--out", &out)?;
    // So is a folder with other content.
    for task in &tasks {
        task.check(&store).map_err(|e| Failure::BadInput(format!("--out: {e}")))?;
    }
    let stop = program.stop()?;
    let shard = shard.unwrap_or(Shard::WHOLE);
    let written = PlanFile::write(&store, &plans, &scenario.stored(), shard);
    written.map_err(|e| Failure::Failed(e.to_string()))?;
    let session = Session { store: &store, threads, shard, stop };
    if let Some(line) = scenario.differences() {
        say!("scenario: {line}");
    }
    tasks.iter().try_for_each(|task| task.run(&session))
}

/// Says in how many episodes the controller gave up.
fn tell_faults(gave_up: &BTreeMap<String, u32>) {
    if !gave_up.is_empty() {
        say!("THE CONTROLLER GAVE UP and held still to the end, in episodes by reason: {}", counts(gave_up));
    }
}

/// Says which faults the controller told in a condition.
fn tell_alarms(condition: &str, alarms: &BTreeMap<String, u32>) {
    if !alarms.is_empty() {
        say!("condition {condition}: alarms of the controller: {}", counts(alarms));
    }
}

/// Lists names with their counts.
fn counts(counts: &BTreeMap<String, u32>) -> String {
    let list: Vec<String> = counts.iter().map(|(name, n)| format!("{name} {n}")).collect();
    if list.is_empty() { "none".to_owned() } else { list.join(", ") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seeds_on_the_command_line() {
        for set in [SeedSetName::Tuning, SeedSetName::V1, SeedSetName::FieldV1] {
            assert_eq!(set.name().parse(), Ok(Seeds::Set(set)));
        }
        assert_eq!("5, 6".parse(), Ok(Seeds::List(vec![5, 6])));
        for bad in ["", "5,", "-1", "1.5", "all", "v2", "custom"] {
            assert!(bad.parse::<Seeds>().is_err(), "{bad}");
        }
    }
}
