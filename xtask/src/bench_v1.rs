//! `cargo xtask bench-v1`: the benchmark.

pub mod bar;
mod component;
mod detect;
mod harvest;
mod scaling;

use std::collections::BTreeMap;
use std::path::PathBuf;

use clap::ValueEnum;
use orchard_bench::RunError;
use orchard_bench::protocol::{ConditionName, Profile, Protocol};
use orchard_bench::store::Store;
use orchard_picker::Kind;

use crate::failure::Failure;
use crate::interrupt;

/// Grows trees, lets the robot harvest them or the detector look at them, and writes the metrics.
#[derive(clap::Args)]
#[command(after_help = "Tasks:\n  harvest   the robot picks fruit for a while\n  \
detect    single depth images by a free camera, 8 a tree at each of 5 foliage densities: precision and recall,\n            \
errors, canopy zones, and the detector with each of its gates switched off\n  \
reach-and-grasp\n            hold a named fruit: success, time, path, loads on the wood\n  \
gentle    push the hand through the canopy to a point behind it: success, time, loads on the wood\n  \
scaling   frames a second of batches of 1 to 512 trees, by solver and by what differs between trees; no robot\n\n\
Files:\n  DIR/summary.json      harvest: metrics with 95 % intervals, zones, failure reasons, times of states\n  \
DIR/episodes/*.json   one a tree: every attempt, event and fruit\n  \
DIR/compute.json      wall time and machine, and nothing else\n  \
DIR/detect.json       detect: metrics with 95 % intervals by foliage density, zones, ablation\n  \
DIR/detect/*.json     one a tree: every image, fruit seen and detection\n  \
DIR/detect.svg        precision and recall against foliage density\n  \
DIR/TASK.json         reach-and-grasp, gentle: metrics with 95 % intervals\n  \
DIR/TASK/*.json       one a tree: every trial\n  \
DIR/scaling.json      scaling: step rates and memory by worlds, solver and mode\n\
All but compute.json and scaling.json are the same bytes on every run of one command, for any number of threads.\n\
Ctrl-C leaves whole files only; the same command then goes on where it stopped. A folder of another plan (controller,\n\
condition, seeds, horizon, camera, ..) is refused.\n\n\
Examples:\n  cargo xtask bench-v1\n  cargo xtask bench-v1 --profile full --threads 2 --out results/full\n  \
cargo xtask bench-v1 --seeds 1,2,3 --trees 2 --horizon 20 --out results/mine\n  \
cargo xtask bench-v1 --seeds v1 --profile full --controller expert\n  \
cargo xtask bench-v1 --seeds tuning --repeats 3 --out results/repeats\n  \
cargo xtask bench-v1 --controller expert --profile full --conditions exhaustion\n  \
cargo xtask bench-v1 --tasks detect --profile full\n  \
cargo xtask bench-v1 --tasks reach-and-grasp,gentle --controller expert")]
pub struct Args {
    /// What to run
    #[arg(long, value_enum, value_delimiter = ',', default_values_t = [TaskName::Harvest])]
    tasks: Vec<TaskName>,
    /// How much to run: quick is 1 seed x 6 trees x 40 s, full is 3 seeds x 6 trees x 75 s, and to exhaustion.
    #[arg(long, value_enum, default_value_t = ProfileName::Quick)]
    profile: ProfileName,
    /// Seeds: `tuning` for the three tuning seeds, `v1` for the five official ones, which are not for tuning, or a list A,B,..
    /// [default: tuning, as many as the profile says]
    #[arg(long, value_name = "tuning|v1|A,B,..")]
    seeds: Option<Seeds>,
    /// Trees a seed [default: by seed set and profile, 6]
    #[arg(long, value_name = "N")]
    trees: Option<u32>,
    /// Nominal episodes a tree, each with another start pose of the robot: tells the spread within trees from that between them
    /// [default: 3 with --seeds v1, else 1]
    #[arg(long, value_name = "N")]
    repeats: Option<u32>,
    /// Length of a nominal episode of the harvest in seconds [default: by profile]
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    horizon: Option<f64>,
    /// Conditions of the harvest: nominal, for the profile's time; exhaustion, the same trees until nothing reachable is left, at
    /// most 600 s [default: by profile; quick is nominal, full is both]
    #[arg(long, value_name = "A,B,..", value_delimiter = ',', value_parser = condition)]
    conditions: Option<Vec<ConditionName>>,
    /// Controller that harvests: baseline, the paper's state machine, or expert
    #[arg(long, value_name = "NAME")]
    controller: Option<String>,
    /// Threads [default: as many as the machine has]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    threads: Option<u32>,
    /// Where the results go: a new folder, or one of the same plan [default: results/bench-v1-PROFILE, with -CONTROLLER behind it
    /// for another than the baseline]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Depth camera of the detect task: ideal, paper, d435i, or a file of figures that differ [default: paper]
    #[arg(long, value_name = "NAME|FILE.toml")]
    camera: Option<String>,
    /// Detector of the detect task: paper, d435i, or a file of figures that differ [default: the one made for the camera]
    #[arg(long, value_name = "NAME|FILE.toml")]
    detector: Option<String>,
}

impl Args {
    /// The controller that the command line names.
    fn controller(&self) -> Result<Kind, Failure> {
        let Some(name) = &self.controller else { return Ok(Kind::default()) };
        Kind::ALL.into_iter().find(|kind| kind.name() == name).ok_or_else(|| {
            let known: Vec<&str> = Kind::ALL.iter().map(|kind| kind.name()).collect();
            Failure::BadInput(format!("--controller {name}: there are {}", known.join(", ")))
        })
    }
}

fn condition(text: &str) -> Result<ConditionName, String> {
    ConditionName::ALL.into_iter().find(|condition| condition.name() == text).ok_or_else(|| {
        let known = ConditionName::ALL.map(ConditionName::name);
        format!("there are {}", known.join(", "))
    })
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

/// Which seeds a command runs on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Seeds {
    Tuning,
    V1,
    List(Vec<u64>),
}

impl Seeds {
    /// The seeds themselves.
    pub fn resolve(&self, protocol: &Protocol) -> Vec<u64> {
        match self {
            Seeds::List(seeds) => seeds.clone(),
            Seeds::Tuning => protocol.tuning_seeds.clone(),
            Seeds::V1 => protocol.v1_seeds(),
        }
    }
}

/// As many threads as the machine has.
pub fn default_threads() -> usize {
    std::thread::available_parallelism().map_or(1, std::num::NonZero::get)
}

impl std::str::FromStr for Seeds {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "tuning" => return Ok(Seeds::Tuning),
            "v1" => return Ok(Seeds::V1),
            _ => {}
        }
        text.split(',')
            .map(|seed| {
                seed.trim()
                    .parse()
                    .map_err(|_| format!("'{seed}' is neither 'tuning' nor 'v1' nor a whole number >= 0"))
            })
            .collect::<Result<_, _>>()
            .map(Seeds::List)
    }
}

/// What all tasks share.
struct Scope {
    seeds: Vec<u64>,
    /// Trees a seed.
    trees: u32,
    /// Nominal episodes a tree.
    repeats: u32,
    threads: usize,
    out: PathBuf,
}

pub fn run(args: &Args) -> Result<(), Failure> {
    let protocol = Protocol::paper();
    let profile = match args.profile {
        ProfileName::Quick => &protocol.quick,
        ProfileName::Full => &protocol.full,
    };
    let scope = scope(args, &protocol, profile).map_err(Failure::BadInput)?;
    check_options(args).map_err(Failure::BadInput)?;
    // All input is read before anything is computed.
    let asks = |task| args.tasks.contains(&task);
    let harvest = asks(TaskName::Harvest)
        .then(|| harvest::Asked::read(args, &scope, &protocol, profile))
        .transpose()?;
    let detect = asks(TaskName::Detect).then(|| detect::Asked::read(args, &scope, &protocol)).transpose()?;
    let grasp = asks(TaskName::ReachAndGrasp).then(|| component::Grasping::read(args, &scope)).transpose()?;
    let gentle = asks(TaskName::Gentle).then(|| component::Pushing::read(args, &scope)).transpose()?;
    let scaling = asks(TaskName::Scaling).then(|| scaling::Asked::read(args, &protocol)).transpose()?;
    let store = Store::open(&scope.out).map_err(|e| Failure::BadInput(format!("--out: {e}")))?;

    // Nor is a folder found to hold something else after an hour.
    let checks = [
        harvest.as_ref().map(|asked| asked.check(&store)),
        detect.as_ref().map(|asked| asked.check(&store)),
        grasp.as_ref().map(|asked| asked.check(&store)),
        gentle.as_ref().map(|asked| asked.check(&store)),
    ];
    for check in checks.into_iter().flatten() {
        check.map_err(|e| Failure::BadInput(format!("--out: {e}")))?;
    }

    let stop = interrupt::listen()?;
    if let Some(harvest) = harvest {
        harvest.run(&scope, &store, stop)?;
    }
    if let Some(detect) = detect {
        detect.run(&scope, &store, stop)?;
    }
    if let Some(grasp) = grasp {
        grasp.run(&scope, &store, stop)?;
    }
    if let Some(gentle) = gentle {
        gentle.run(&scope, &store, stop)?;
    }
    if let Some(scaling) = scaling {
        scaling.run(&scope, &store, stop)?;
    }
    Ok(())
}

fn scope(args: &Args, protocol: &Protocol, profile: &Profile) -> Result<Scope, String> {
    let seeds = match &args.seeds {
        Some(seeds) => seeds.resolve(protocol),
        None => protocol.tuning_seeds.iter().copied().take(profile.seeds.get() as usize).collect(),
    };
    let official = &protocol.seed_sets.v1;
    let (of_seed, repeats) = match args.seeds {
        Some(Seeds::V1) => (&official.trees, official.repeats.get()),
        _ => (&profile.trees, 1),
    };
    let trees = args.trees.unwrap_or_else(|| of_seed.get());
    let trees = of_seed.with_value(trees).map_err(|e| format!("--trees: {e}"))?.get();
    let repeats = args.repeats.unwrap_or(repeats);
    let repeats = official.repeats.with_value(repeats).map_err(|e| format!("--repeats: {e}"))?.get();
    let threads = args.threads.map_or_else(default_threads, |threads| threads as usize);
    let out = args.out.clone().unwrap_or_else(|| default_out(args));
    Ok(Scope { seeds, trees, repeats, threads, out })
}

/// Where results go that are given no place: apart by profile, controller and seed set.
fn default_out(args: &Args) -> PathBuf {
    let mut folder = format!("results/bench-v1-{}", args.profile.name());
    if let Some(name) = args.controller.as_deref().filter(|name| *name != Kind::default().name()) {
        folder = format!("{folder}-{name}");
    }
    if matches!(args.seeds, Some(Seeds::V1)) {
        folder.push_str("-v1");
    }
    PathBuf::from(folder)
}

/// An option of a task that is not run would change nothing: better told than ignored.
fn check_options(args: &Args) -> Result<(), String> {
    use TaskName::{Detect, Gentle, Harvest, ReachAndGrasp};
    let options: [(&str, bool, &[TaskName], &str); 6] = [
        ("--horizon", args.horizon.is_some(), &[Harvest], "the task harvest"),
        ("--conditions", args.conditions.is_some(), &[Harvest], "the task harvest"),
        ("--repeats", args.repeats.is_some(), &[Harvest], "the task harvest"),
        (
            "--controller",
            args.controller.is_some(),
            &[Harvest, ReachAndGrasp, Gentle],
            "the tasks harvest, reach-and-grasp and gentle",
        ),
        ("--camera", args.camera.is_some(), &[Detect], "the task detect"),
        ("--detector", args.detector.is_some(), &[Detect], "the task detect"),
    ];
    for (option, given, tasks, names) in options {
        if given && !tasks.iter().any(|task| args.tasks.contains(task)) {
            return Err(format!("{option} is for {names}, which --tasks does not name"));
        }
    }
    Ok(())
}

/// A run's end as the command's.
fn ended<T>(result: Result<T, RunError>) -> Result<T, Failure> {
    result.map_err(|e| match e {
        RunError::Interrupted { .. } => Failure::Interrupted(e.to_string()),
        RunError::OtherPlan(e) => Failure::BadInput(format!("--out: {e}")),
        e => Failure::Failed(e.to_string()),
    })
}

/// How often each of some things was, in words.
fn counts(counts: &BTreeMap<String, u32>) -> String {
    let list: Vec<String> = counts.iter().map(|(name, n)| format!("{name} {n}")).collect();
    if list.is_empty() { "none".to_owned() } else { list.join(", ") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seeds_on_the_command_line() {
        assert_eq!("tuning".parse(), Ok(Seeds::Tuning));
        assert_eq!("v1".parse(), Ok(Seeds::V1));
        assert_eq!("5, 6".parse(), Ok(Seeds::List(vec![5, 6])));
        for bad in ["", "5,", "-1", "1.5", "all", "v2"] {
            assert!(bad.parse::<Seeds>().is_err(), "{bad}");
        }
    }

    #[derive(clap::Parser)]
    struct Line {
        #[command(flatten)]
        args: Args,
    }

    fn args(line: &[&str]) -> Args {
        let line = [&["bench-v1"], line].concat();
        <Line as clap::Parser>::try_parse_from(line).unwrap_or_else(|e| panic!("{e}")).args
    }

    #[test]
    fn a_seed_set_brings_its_trees_and_repeats() {
        let protocol = Protocol::paper();
        let of = |line: &[&str]| {
            let scope = scope(&args(line), &protocol, &protocol.quick).unwrap();
            (scope.seeds, scope.trees, scope.repeats)
        };
        assert_eq!(of(&[]), (vec![20250704], 6, 1));
        assert_eq!(of(&["--seeds", "v1"]), (protocol.v1_seeds(), 6, 3));
        assert_eq!(of(&["--seeds", "tuning", "--repeats", "2"]), (protocol.tuning_seeds.clone(), 6, 2));
        assert_eq!(of(&["--seeds", "v1", "--trees", "1", "--repeats", "1"]).1, 1);
        for (line, option) in [(["--repeats", "0"], "--repeats: "), (["--trees", "0"], "--trees: ")] {
            let problem = scope(&args(&line), &protocol, &protocol.quick).err().unwrap();
            assert!(problem.starts_with(option), "{problem}");
        }
    }

    #[test]
    fn tasks_on_the_command_line() {
        assert_eq!(args(&[]).tasks, [TaskName::Harvest]);
        assert_eq!(args(&["--tasks", "harvest,detect"]).tasks, [TaskName::Harvest, TaskName::Detect]);
        let check = |line: &[&str]| check_options(&args(line));
        assert_eq!(check(&["--tasks", "detect", "--camera", "ideal", "--detector", "paper"]), Ok(()));
        assert_eq!(
            check(&["--camera", "ideal"]).unwrap_err(),
            "--camera is for the task detect, which --tasks does not name"
        );
        let exhausted = args(&["--conditions", "exhaustion,nominal"]).conditions;
        assert_eq!(exhausted, Some(vec![ConditionName::Exhaustion, ConditionName::Nominal]));
        assert!(condition("windy").unwrap_err().contains("nominal, exhaustion"));
        assert!(check(&["--tasks", "detect", "--conditions", "nominal"]).unwrap_err().starts_with("--cond"));
        assert!(check(&["--tasks", "detect", "--horizon", "20"]).unwrap_err().starts_with("--horizon"));
    }
    #[test]
    fn controllers_do_not_share_a_folder() {
        let out = |line: &[&str]| default_out(&args(line)).display().to_string();
        assert_eq!(out(&[]), "results/bench-v1-quick");
        assert_eq!(out(&["--controller", "baseline"]), "results/bench-v1-quick");
        assert_eq!(out(&["--controller", "expert", "--profile", "full"]), "results/bench-v1-full-expert");
    }

    /// Another controller's records are in the folder: refused with exit code 2, and nothing is changed.
    #[test]
    fn a_folder_of_another_plan_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().to_str().unwrap();
        let asked = |controller: &str| {
            let line = ["--controller", controller, "--seeds", "7", "--trees", "1", "--out", out];
            args(&line)
        };
        let protocol = Protocol::paper();
        let baseline = asked("baseline");
        let scope = scope(&baseline, &protocol, &protocol.quick).unwrap();
        let plan = harvest::Asked::read(&baseline, &scope, &protocol, &protocol.quick).unwrap();
        let store = Store::open(folder.path()).unwrap();
        let key = plan.keys().swap_remove(0);
        let file = "episodes/baseline-nominal-7-000.json";
        std::fs::create_dir(folder.path().join("episodes")).unwrap();
        store.write(file, &key).unwrap();
        store.write("summary.json", &"baseline's").unwrap();
        assert_eq!(plan.check(&store), Ok(()));
        match run(&asked("expert")) {
            Err(Failure::BadInput(line)) => assert_eq!(
                line,
                format!(
                    "--out: {out} holds results of another plan: {file} has controller \"baseline\", not \"expert\"; \
                     give another --out, or remove that folder"
                )
            ),
            other => panic!("{other:?}"),
        }
        assert!(folder.path().join("summary.json").exists());
    }
}
