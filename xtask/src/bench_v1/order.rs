//! From the command line to the orders of a run: nothing is computed, all is checked.

use std::path::{Path, PathBuf};

use orchard_bench::harvest::Extent;
use orchard_bench::matrix::{EXHAUSTION, Matrix, NOMINAL};
use orchard_bench::order::{Order, Trees};
use orchard_bench::protocol::{Profile, Protocol};
use orchard_perception::DetectorConfig;
use orchard_picker::Kind;
use orchard_spec::Spec;

use super::{Args, ProfileName, Seeds, TaskName};
use crate::failure::Failure;
use crate::sensing_args::{detector_for, read_camera, read_detector};

/// What the command line asks for, in the order in which it is run.
pub fn orders(args: &Args, protocol: &Protocol) -> Result<Vec<Order>, Failure> {
    check_options(args).map_err(Failure::BadInput)?;
    let trees = trees(args, protocol).map_err(Failure::BadInput)?;
    let controller = || controller(args);
    let of_task = |task: &TaskName| {
        Ok(match task {
            TaskName::Harvest => {
                let extent = extent(args, protocol, &trees).map_err(Failure::BadInput)?;
                Order::Harvest { controller: controller()?, extent }
            }
            TaskName::Detect => detect(args, trees.clone())?,
            TaskName::ReachAndGrasp => {
                Order::ReachAndGrasp { controller: controller()?, trees: trees.clone() }
            }
            TaskName::Gentle => Order::Gentle { controller: controller()?, trees: trees.clone() },
            TaskName::Scaling => Order::Scaling {
                profile: args.profile.name().to_owned(),
                backend: args.backend.unwrap_or(protocol.scaling.backend),
            },
        })
    };
    tasks(args).iter().map(of_task).collect()
}

/// Where the results go that are given no place: apart by all that makes another plan of them in common use.
pub fn default_out(args: &Args) -> PathBuf {
    let mut folder = format!("results/bench-v1-{}", args.profile.name());
    let mut add = |part: &str| folder = format!("{folder}-{part}");
    if let Some(name) = args.controller.as_deref().filter(|name| *name != Kind::default().name()) {
        add(name);
    }
    if matches!(args.seeds, Some(Seeds::V1)) {
        add("v1");
    }
    if let Some(conditions) = &args.conditions {
        add(&conditions.join("+"));
    }
    if let Some(shard) = args.shard.filter(|shard| !shard.is_whole()) {
        add(&shard.to_string().replace('/', "of"));
    }
    PathBuf::from(folder)
}

/// The tasks that are named; else those that the options are for; else all.
fn tasks(args: &Args) -> Vec<TaskName> {
    if let Some(tasks) = &args.tasks {
        return TaskName::ALL.into_iter().filter(|task| tasks.contains(task)).collect();
    }
    let of_harvest =
        args.conditions.is_some() || args.horizon.is_some() || args.repeats.is_some() || args.record;
    let of_detect = args.camera.is_some() || args.detector.is_some();
    let asked = |task: &TaskName| match task {
        TaskName::Harvest => of_harvest || !of_detect,
        TaskName::Detect => of_detect || !of_harvest,
        // Figures of one machine at a time: they have no parts.
        TaskName::Scaling if is_part(args) => false,
        _ => !of_harvest && !of_detect,
    };
    TaskName::ALL.into_iter().filter(asked).collect()
}

fn is_part(args: &Args) -> bool {
    args.shard.is_some_and(|shard| !shard.is_whole())
}

/// An option of a task that is not run would change nothing: better told than ignored.
fn check_options(args: &Args) -> Result<(), String> {
    use TaskName::{Detect, Gentle, Harvest, ReachAndGrasp, Scaling};
    let options: [(&str, bool, &[TaskName], &str); 8] = [
        ("--horizon", args.horizon.is_some(), &[Harvest], "the task harvest"),
        ("--conditions", args.conditions.is_some(), &[Harvest], "the task harvest"),
        ("--repeats", args.repeats.is_some(), &[Harvest], "the task harvest"),
        ("--record", args.record, &[Harvest], "the task harvest"),
        (
            "--controller",
            args.controller.is_some(),
            &[Harvest, ReachAndGrasp, Gentle],
            "the tasks harvest, reach-and-grasp and gentle",
        ),
        ("--camera", args.camera.is_some(), &[Detect], "the task detect"),
        ("--detector", args.detector.is_some(), &[Detect], "the task detect"),
        ("--backend", args.backend.is_some(), &[Scaling], "the task scaling"),
    ];
    let run = tasks(args);
    for (option, given, tasks, names) in options {
        if given && !tasks.iter().any(|task| run.contains(task)) {
            return Err(format!("{option} is for {names}, which --tasks does not name"));
        }
    }
    if is_part(args) && run.contains(&Scaling) {
        return Err("--shard: the task scaling has no parts; run it alone".to_owned());
    }
    Ok(())
}

fn profile<'a>(args: &Args, protocol: &'a Protocol) -> &'a Profile {
    match args.profile {
        ProfileName::Quick => &protocol.quick,
        ProfileName::Full => &protocol.full,
    }
}

fn trees(args: &Args, protocol: &Protocol) -> Result<Trees, String> {
    let profile = profile(args, protocol);
    let seeds = match &args.seeds {
        Some(seeds) => seeds.resolve(protocol),
        None => protocol.tuning_seeds.iter().copied().take(profile.seeds.get() as usize).collect(),
    };
    let of_seed = match args.seeds {
        Some(Seeds::V1) => &protocol.seed_sets.v1.trees,
        _ => &profile.trees,
    };
    let trees = args.trees.unwrap_or_else(|| of_seed.get());
    let trees = of_seed.with_value(trees).map_err(|e| format!("--trees: {e}"))?.get();
    Ok(Trees { profile: args.profile.name().to_owned(), seeds, trees })
}

fn extent(args: &Args, protocol: &Protocol, trees: &Trees) -> Result<Extent, String> {
    let profile = profile(args, protocol);
    let names = args.conditions.as_ref().unwrap_or(&profile.conditions);
    let matrix = Matrix::of(protocol, &Spec::paper());
    let chosen = matrix.choose(names).map_err(|e| format!("--conditions: {e}"))?;
    let conditions: Vec<String> = chosen.iter().map(|condition| condition.name.clone()).collect();
    if args.repeats.is_some() && !conditions.iter().any(|name| name == NOMINAL) {
        return Err("--repeats: these are of the nominal condition, which --conditions does not name".into());
    }
    if args.horizon.is_some() && conditions.iter().all(|name| name == EXHAUSTION) {
        return Err(format!("--horizon: {EXHAUSTION} has one of its own, and no other condition is run"));
    }
    let horizon = args.horizon.unwrap_or_else(|| profile.horizon.value());
    let horizon = profile.horizon.with_value(horizon).map_err(|e| format!("--horizon: {e}"))?;
    let official = &protocol.seed_sets.v1.repeats;
    let repeats = args.repeats.unwrap_or(if args.seeds == Some(Seeds::V1) { official.get() } else { 1 });
    let repeats = official.with_value(repeats).map_err(|e| format!("--repeats: {e}"))?.get();
    let Trees { profile, seeds, trees } = trees.clone();
    Ok(Extent { profile, conditions, seeds, trees, repeats, horizon_s: horizon.si() })
}

/// The name of the controller that the command line asks for.
fn controller(args: &Args) -> Result<String, Failure> {
    let name = args.controller.clone().unwrap_or_else(|| Kind::default().name().to_owned());
    kind(&name).map(|_| name).map_err(|e| Failure::BadInput(format!("--controller {e}")))
}

/// A controller by its name.
pub fn kind(name: &str) -> Result<Kind, String> {
    Kind::ALL.into_iter().find(|kind| kind.name() == name).ok_or_else(|| {
        let known: Vec<&str> = Kind::ALL.iter().map(|kind| kind.name()).collect();
        format!("{name}: there are {}", known.join(", "))
    })
}

fn detect(args: &Args, trees: Trees) -> Result<Order, Failure> {
    let camera = args.camera.as_deref().map_or_else(|| Ok(Spec::paper().camera), read_camera)?;
    let (detector_name, detector) =
        named_detector(args.detector.as_deref().unwrap_or(detector_for(&camera)))?;
    Ok(Order::Detect { trees, camera: Box::new(camera), detector_name, detector: Box::new(detector) })
}

/// A detector by its name or from its file, with the name that results give it.
fn named_detector(detector: &str) -> Result<(String, DetectorConfig), Failure> {
    let config = read_detector("--detector", detector)?;
    // The folder is no part of a result: the same file elsewhere gives the same bytes.
    let name = Path::new(detector).file_name().map_or(detector.into(), |name| name.to_string_lossy());
    Ok((name.into_owned(), config))
}

#[cfg(test)]
#[path = "order_tests.rs"]
mod tests;
