//! `orchard demos`: demonstrations of a task by a controller, for policies to learn from.

mod lerobot;
mod on_device;
mod verify;

use std::path::PathBuf;

use clap::ValueEnum;
use orchard_bench::compute::TaskCost;
use orchard_bench::store::Store;
use orchard_bench::task::{RunError, Session};
use orchard_demos::{DemoRecord, DemosResult, DemosSummary, Plan};
use orchard_env::{Settings, Task, Via};
use orchard_policy::{Control, Pixels, Spaces};
use orchard_tasks::plan_file::Backend;
use orchard_tasks::protocol::Protocol;

use crate::args::ScenarioArgs;
use crate::commands::bench_v1::bar::{Bar, RecordProgress};
use crate::commands::bench_v1::{Seeds, default_threads};
use crate::failure::Failure;
use crate::interrupt;
use crate::out_folder::open_folder;
use crate::program::Program;

/// Lets a controller demonstrate a task, and writes every step as a policy would have seen it.
#[derive(clap::Args)]
#[command(
    subcommand_negates_reqs = true,
    args_conflicts_with_subcommands = true,
    after_help = "Files (docs/learning.md describes them):\n  DIR/meta.json            every convention, scenario, seeds and version; written first\n  \
DIR/steps/*.parquet      a row a step: observation, action, its error, reward, cost, the controller's state\n  \
DIR/depth, pixels_*      PNG images, each written once\n  \
DIR/commands/*.parquet   the raw commands, a row a frame, for `orchard demos verify DIR`\n  \
DIR/episodes/*.json      success, damage, the use of the tree (training, validation, tests), hashes\n  \
DIR/summary.json         sums, and how near the actions come to the controller's commands; written last\n  \
DIR/compute.json         wall times and rates\n\
All files but compute.json have the same bytes on every run, for any number of threads. Ctrl-C and SIGTERM leave only complete files;\n\
the same command continues, and one with more episodes adds to them.\n\n\
Examples:\n  orchard demos --episodes 100 --task reach --out demos/reach\n  \
orchard demos --episodes 100 --task reach --policy-actions --obs state,depth,pixels --out demos/policy\n  \
orchard demos --episodes 20 --preset tall-spindle --camera d435i --out demos/harvest\n  \
orchard demos verify demos/reach"
)]
pub struct Args {
    #[command(subcommand)]
    command: Option<Command>,
    /// Episodes
    #[arg(long, value_name = "N", required = true, allow_negative_numbers = true)]
    episodes: Option<u32>,
    /// Folder for the files: new, or with demonstrations of the same plan
    #[arg(long, value_name = "DIR", required = true)]
    out: Option<PathBuf>,
    /// The task
    #[arg(long, value_enum, default_value_t = TaskName::Harvest)]
    task: TaskName,
    /// Seeds, which take turns: `tuning`, or a list A,B,..; the official ones are refused
    #[arg(long, value_name = "tuning|A,B,..", default_value = "1")]
    seeds: Seeds,
    /// Groups of observations: state, depth, pixels
    #[arg(long, value_name = "A,B,..", value_delimiter = ',', default_value = "state,depth")]
    obs: Vec<String>,
    /// Rows and columns of the pictures
    #[arg(long, value_name = "N", default_value_t = 128)]
    pixels_size: u32,
    /// Pictures a second, a divisor of 60 [default: as many as actions]
    #[arg(long, value_name = "HZ")]
    pixels_hz: Option<u32>,
    /// Meaning of the arm's actions: joint_delta, joint_absolute, ee_delta
    #[arg(long, value_name = "NAME", default_value = "joint_delta")]
    control: String,
    /// Actions a second, a divisor of 60
    #[arg(long, value_name = "HZ", default_value_t = 10)]
    control_hz: u32,
    /// Let the actions move the robot instead of the controller's commands: what is demonstrated is what a policy can do
    #[arg(long)]
    policy_actions: bool,
    /// Form of the result: neutral (Parquet and PNG); lerobot: a LeRobot data set in DIR, with the neutral folder beside it in DIR-neutral
    #[arg(long, value_enum, default_value_t = FormatName::Neutral)]
    format: FormatName,
    #[command(flatten)]
    scenario: ScenarioArgs,
    /// Processor that moves the worlds: cpu, or gpu (any Vulkan, Metal or DirectX 12 device), in f32. Cameras and controllers always run on the CPU
    #[arg(long, value_name = "cpu|gpu", default_value = "cpu")]
    backend: Backend,
    /// Episodes that advance together on a graphics device [default: all, at most 512]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=16384))]
    lanes: Option<u32>,
    /// Threads [default: as many as the machine has]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    threads: Option<u32>,
}

#[derive(clap::Subcommand)]
enum Command {
    Verify(verify::Args),
}

/// A task by its short name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum TaskName {
    Harvest,
    Reach,
    Gentle,
}

impl From<TaskName> for Task {
    fn from(name: TaskName) -> Self {
        match name {
            TaskName::Harvest => Self::Harvest,
            TaskName::Reach => Self::Reach,
            TaskName::Gentle => Self::Gentle,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum FormatName {
    Neutral,
    Lerobot,
}

pub fn run(args: &Args, program: &Program) -> Result<(), Failure> {
    if let Some(Command::Verify(args)) = &args.command {
        return verify::run(args, program);
    }
    let (Some(episodes), Some(out)) = (args.episodes, &args.out) else {
        return Err(Failure::BadInput("--episodes N and --out DIR are needed".to_owned()));
    };
    if args.lanes.is_some() && args.backend != Backend::Gpu {
        return Err(Failure::BadInput("--lanes applies to --backend gpu alone".to_owned()));
    }
    let plan = plan(args, episodes, program)?;
    let (folder, converter) = match args.format {
        FormatName::Neutral => (out.clone(), None),
        // A missing converter is reported before hours of episodes.
        FormatName::Lerobot => (lerobot::neutral_folder(out), Some(lerobot::Converter::find(out)?)),
    };
    let (store, _lock) = open_folder("--out", &folder)?;
    let threads = args.threads.map_or_else(default_threads, |threads| threads as usize);
    let done = match args.backend {
        Backend::Cpu => demonstrate(&plan, &store, threads)?,
        Backend::Gpu => on_device::demonstrate(&plan, &store, args.lanes, threads)?,
    };
    if let Some(summary) = &done.summary {
        report(summary);
    }
    rate(&done.cost);
    say!("demonstrations: {}", folder.display());
    converter.map_or(Ok(()), |converter| converter.convert(&folder, out))
}

fn plan(args: &Args, episodes: u32, program: &Program) -> Result<Plan, Failure> {
    let bad = |e: &dyn std::fmt::Display| Failure::BadInput(e.to_string());
    let scenario = args.scenario.resolve_under(program, "expert")?;
    let hz = args.pixels_hz.unwrap_or(args.control_hz);
    let settings = observing(
        Settings::of(args.task.into()),
        &args.obs,
        args.pixels_size,
        hz,
        &args.control,
        args.control_hz,
    )?;
    let settings = Settings { backend: args.backend, ..settings };
    let seeds = args.seeds.resolve(&Protocol::of_scenario(&scenario)?).map_err(Failure::BadInput)?;
    let via = if args.policy_actions { Via::Actions } else { Via::Commands };
    Plan::new(scenario, settings, via, seeds, episodes).map_err(|e| bad(&e))
}

/// Settings with other observations and actions, as the options of this name give them.
pub fn observing(
    settings: Settings,
    obs: &[String],
    pixels_size: u32,
    pixels_hz: u32,
    control: &str,
    control_hz: u32,
) -> Result<Settings, Failure> {
    let option = |e: orchard_policy::SettingError| {
        Failure::BadInput(format!("--{} {}: {}", e.option.replace('_', "-"), e.value, e.problem))
    };
    let groups: Vec<&str> = obs.iter().map(String::as_str).collect();
    let spaces = settings.spaces.observing(&groups).map_err(option)?;
    let pixels = spaces.pixels.map(|_| Pixels { height: pixels_size, width: pixels_size, hz: pixels_hz });
    let control = Control::named(control).map_err(option)?;
    Ok(Settings { spaces: Spaces { pixels, control, control_hz, ..spaces }, ..settings })
}

fn demonstrate(plan: &Plan, store: &Store, threads: usize) -> Result<DemosResult, Failure> {
    watched(plan, store, threads, |session, bar| orchard_demos::run(plan, session, bar))
}

/// Runs a plan by `run`, beside a bar.
fn watched(
    plan: &Plan,
    store: &Store,
    threads: usize,
    run: impl FnOnce(&Session<'_>, &Bar<DemoRecord>) -> Result<DemosResult, RunError>,
) -> Result<DemosResult, Failure> {
    let stop = interrupt::listen()?;
    let bar = Bar::new("demos", plan.episodes() as usize, plan.frames(), shown);
    let done = run(&Session::whole(store, threads, stop), &bar);
    bar.clear();
    done.map_err(|e| match e {
        RunError::Interrupted { .. } => Failure::Interrupted(e.to_string()),
        RunError::Plan(_) => Failure::BadInput(e.to_string()),
        RunError::OtherPlan(e) => Failure::BadInput(format!("--out: {e}")),
        RunError::Store(_) | RunError::Threads(_) => Failure::Failed(e.to_string()),
    })
}

fn shown(record: &DemoRecord) -> RecordProgress {
    let place = format!("seed {} world {}", record.key.seed, record.key.world);
    let Some(demo) = &record.demonstration else {
        let reason = record.never_began.as_deref().unwrap_or_default();
        return RecordProgress { steps: 0, line: format!("{place}: no episode: {reason}") };
    };
    let statistics = &demo.statistics;
    let line = format!(
        "{place}: {}{}, {} steps, {} fruit in the bucket, {} images",
        demo.outcome,
        if demo.success { " (done)" } else { "" },
        statistics.length,
        statistics.deposited,
        demo.images.count
    );
    RecordProgress { steps: record.frames(), line }
}

fn report(summary: &DemosSummary) {
    let all = &summary.all;
    say!(
        "{} episodes of {} on {} trees: {} done ({:.1} %), mean completeness {:.3}; {} fruit in buckets, {} dropped, {} branches snapped",
        all.episodes,
        summary.controller,
        summary.trees,
        all.successes,
        100.0 * f64::from(all.successes) / f64::from(all.episodes.max(1)),
        all.mean_completeness,
        all.deposited,
        all.fruit_dropped,
        all.branches_snapped
    );
    let splits = summary.splits.iter().map(|(split, totals)| format!("{} {}", split.name(), totals.episodes));
    say!("episodes by use: {}", splits.collect::<Vec<_>>().join(", "));
    let how = match summary.via {
        Via::Commands => "The controller's commands moved the robot; the actions come near to them",
        Via::Actions => "The actions moved the robot; the controller commanded otherwise",
    };
    say!("{how} by, in a step (mean; largest; steps whose action is at an end):");
    for error in &summary.action_error {
        let (channel, unit, at_end) = (&error.channel, &error.unit, 100.0 * error.saturated);
        say!("  {channel:<16} {:.4} {unit}; {:.4} {unit}; {at_end:.1} %", error.mean, error.largest);
    }
    if summary.never_began > 0 {
        note!("note: {} worlds have no episode (see never_began in episodes/*.json)", summary.never_began);
    }
    if all.unfit_depth_px > 0 {
        note!("note: {} depth pixels do not fit into the images, which have 0 there", all.unfit_depth_px);
    }
}

fn rate(cost: &TaskCost) {
    if let Some(rate) = cost.records_per_core_hour {
        say!("rate: {rate:.0} episodes an hour and core");
    }
}
