//! Makes and checks the plans of a run from the command line, before anything is computed.

use std::path::{Path, PathBuf};

use orchard_picker::Kind;
use orchard_scaling::ScalingRules;
use orchard_scenario::Scenario;
use orchard_tasks::component::{Gentle, ReachAndGrasp};
use orchard_tasks::harvest::matrix::{NOMINAL, is_exhaustion};
use orchard_tasks::harvest::{Extent, Harvest};
use orchard_tasks::plan_file::{Backend, TaskPlan, TreeExtent};
use orchard_tasks::protocol::{Profile, Protocol};

use super::task::AnyTask;
use super::way::Way;
use super::{Args, Benchmark, ProfileName, Seeds, TaskName, component, detect, harvest, scaling};
use crate::failure::Failure;

/// The plans requested on the command line, in the order in which they are run.
pub fn plans(args: &Args, scenario: &Scenario) -> Result<Vec<TaskPlan>, Failure> {
    check_options(args).map_err(Failure::BadInput)?;
    let harvest = Harvest::new(scenario.clone())?;
    let protocol = harvest.protocol();
    let trees = trees(args, protocol).map_err(Failure::BadInput)?;
    let moved_by = args.run.backend.unwrap_or_default();
    let mut plans = Vec::new();
    for task in tasks(args) {
        if let Err(why) = fits(task, scenario) {
            if args.tasks.is_some() {
                return Err(Failure::BadInput(format!("--tasks {}: {why}", task.name())));
            }
            note!("note: task {} is skipped: {why}", task.name());
            continue;
        }
        plans.push(match task {
            TaskName::Harvest => {
                let extent = extent(args, &harvest, &trees).map_err(Failure::BadInput)?;
                TaskPlan::Harvest { extent, backend: moved_by }
            }
            TaskName::Detect => TaskPlan::Detect { trees: trees.clone() },
            TaskName::ReachAndGrasp => TaskPlan::ReachAndGrasp { trees: trees.clone(), backend: moved_by },
            TaskName::Gentle => TaskPlan::Gentle { trees: trees.clone(), backend: moved_by },
            TaskName::Scaling => TaskPlan::Scaling {
                profile: args.run.profile.name().to_owned(),
                backend: match args.run.backend {
                    Some(backend) => backend,
                    None => ScalingRules::of(protocol)?.backend,
                },
            },
        });
    }
    Ok(plans)
}

/// The task of a plan with results in the folder `out`; `way` is none if it is not run, only merged.
pub fn task(
    plan: &TaskPlan,
    scenario: &Scenario,
    out: &Path,
    way: Option<Way>,
) -> Result<Box<dyn AnyTask>, Failure> {
    Ok(match plan {
        TaskPlan::Harvest { extent, backend } => match way {
            Some(way) if *backend == Backend::Gpu => harvest_on_device(scenario, extent, out, way)?,
            _ => {
                let record = way.is_some_and(|way| way.record);
                Box::new(harvest::Harvesting::new(scenario, extent, *backend, out, record)?)
            }
        },
        TaskPlan::Detect { trees } => Box::new(detect::Detecting::new(scenario, trees)?),
        TaskPlan::ReachAndGrasp { trees, backend } => {
            component::trials::<ReachAndGrasp>(scenario, trees, *backend, way)?
        }
        TaskPlan::Gentle { trees, backend } => component::trials::<Gentle>(scenario, trees, *backend, way)?,
        TaskPlan::Scaling { profile, backend } => {
            Box::new(scaling::Timing::new(scenario, profile, *backend)?)
        }
    })
}

#[cfg(feature = "gpu")]
fn harvest_on_device(
    scenario: &Scenario,
    extent: &Extent,
    out: &Path,
    way: Way,
) -> Result<Box<dyn AnyTask>, Failure> {
    Ok(Box::new(super::together::OnDevice::new(scenario, extent, out, way)?))
}

#[cfg(not(feature = "gpu"))]
fn harvest_on_device(_: &Scenario, _: &Extent, _: &Path, _: Way) -> Result<Box<dyn AnyTask>, Failure> {
    Err(Failure::BadInput("--backend gpu: this program was built without the feature `gpu`".to_owned()))
}

/// Checks that a task can be run with a scenario; the error gives the reason.
fn fits(task: TaskName, scenario: &Scenario) -> Result<(), String> {
    match task {
        TaskName::ReachAndGrasp | TaskName::Gentle if !scenario.controller_kind().takes_goals() => {
            Err(format!(
                "controller {} cannot be given a goal, which this task needs",
                scenario.names().controller
            ))
        }
        TaskName::Harvest if scenario.controller_kind().needs_goal() => Err(format!(
            "controller {} needs a goal, which this task does not give",
            scenario.names().controller
        )),
        TaskName::Scaling if scenario.digitised_tree().is_some() => {
            Err("it needs grown trees, but --tree gives a digitised one".to_owned())
        }
        _ => Ok(()),
    }
}

/// Default result folder: named by the profile and by the options that change the plan.
pub fn default_out(args: &Args, benchmark: Benchmark) -> PathBuf {
    let mut folder = format!("results/{}-{}", benchmark.command, args.run.profile.name());
    let mut add = |part: &str| folder = format!("{folder}-{part}");
    // A file is represented by its name, without folders and extension.
    let stem = |value: &str| match std::path::Path::new(value).file_stem() {
        Some(stem) if value.ends_with(".toml") || value.contains('/') => stem.to_string_lossy().into_owned(),
        _ => value.to_owned(),
    };
    if let Some(file) = args.run.scenario.file() {
        add(&stem(&file.to_string_lossy()));
    }
    for value in args.run.scenario.given() {
        add(&stem(value));
    }
    if let Some(name) = args.run.scenario.controller().filter(|name| *name != Kind::default().name()) {
        add(&orchard_scenario::controller_name(name));
    }
    if let Some(Seeds::Set(set)) = args.run.seeds.as_ref().filter(|seeds| seeds.is_official()) {
        add(set.name());
    }
    if args.run.backend == Some(Backend::Gpu) {
        add(Backend::Gpu.name());
    }
    if let Some(conditions) = &args.run.conditions {
        add(&conditions.join("+"));
    }
    if let Some(shard) = args.run.shard.filter(|shard| !shard.is_whole()) {
        add(&shard.to_string().replace('/', "of"));
    }
    PathBuf::from(folder)
}

/// The tasks of `--tasks`; without it, those that the given options belong to; otherwise all.
fn tasks(args: &Args) -> Vec<TaskName> {
    if let Some(tasks) = &args.tasks {
        return TaskName::ALL.into_iter().filter(|task| tasks.contains(task)).collect();
    }
    let of_harvest = args.run.conditions.is_some()
        || args.run.horizon.is_some()
        || args.run.repeats.is_some()
        || args.run.record;
    let applies = |task: &TaskName| match task {
        TaskName::Harvest => true,
        // Timings belong to one machine, so the task cannot be split into parts.
        TaskName::Scaling if is_part(args) => false,
        TaskName::Detect if args.run.backend == Some(Backend::Gpu) => false,
        _ => !of_harvest,
    };
    TaskName::ALL.into_iter().filter(applies).collect()
}

fn is_part(args: &Args) -> bool {
    args.run.shard.is_some_and(|shard| !shard.is_whole())
}

/// Refuses options that only affect tasks that are not run.
fn check_options(args: &Args) -> Result<(), String> {
    use TaskName::{Gentle, Harvest, ReachAndGrasp, Scaling};
    let options: [(&str, bool, &[TaskName], &str); 7] = [
        ("--horizon", args.run.horizon.is_some(), &[Harvest], "the task harvest"),
        ("--conditions", args.run.conditions.is_some(), &[Harvest], "the task harvest"),
        ("--repeats", args.run.repeats.is_some(), &[Harvest], "the task harvest"),
        ("--record", args.run.record, &[Harvest], "the task harvest"),
        (
            "--controller",
            args.run.scenario.controller().is_some(),
            &[Harvest, ReachAndGrasp, Gentle],
            "the tasks harvest, reach-and-grasp and gentle",
        ),
        (
            "--backend",
            args.run.backend.is_some(),
            &[Harvest, ReachAndGrasp, Gentle, Scaling],
            "the tasks harvest, reach-and-grasp, gentle and scaling",
        ),
        (
            "--lanes",
            args.run.lanes.is_some(),
            &[Harvest, ReachAndGrasp, Gentle],
            "the tasks harvest, reach-and-grasp and gentle",
        ),
    ];
    let run = tasks(args);
    for (option, given, tasks, names) in options {
        if given && !tasks.iter().any(|task| run.contains(task)) {
            return Err(format!("{option} applies to {names}, which --tasks does not include"));
        }
    }
    if args.run.lanes.is_some() && args.run.backend != Some(Backend::Gpu) {
        return Err("--lanes applies to --backend gpu alone".to_owned());
    }
    if is_part(args) && run.contains(&Scaling) {
        return Err("--shard: the task scaling cannot be split into parts; run it without --shard".to_owned());
    }
    Ok(())
}

fn profile<'a>(args: &Args, protocol: &'a Protocol) -> &'a Profile {
    match args.run.profile {
        ProfileName::Quick => &protocol.quick,
        ProfileName::Full => &protocol.full,
    }
}

fn trees(args: &Args, protocol: &Protocol) -> Result<TreeExtent, String> {
    let profile = profile(args, protocol);
    let seeds = match &args.run.seeds {
        Some(seeds) => seeds.resolve(protocol)?,
        None => protocol.tuning_seeds.iter().copied().take(profile.seeds.get() as usize).collect(),
    };
    let of_seed = match &args.run.seeds {
        Some(seeds) if seeds.is_official() => &protocol.official_set().trees,
        _ => &profile.trees,
    };
    let trees = args.run.trees.unwrap_or_else(|| of_seed.get());
    let trees = of_seed.with_value(trees).map_err(|e| format!("--trees: {e}"))?.get();
    Ok(TreeExtent { profile: args.run.profile.name().to_owned(), seeds, trees })
}

fn extent(args: &Args, harvest: &Harvest, trees: &TreeExtent) -> Result<Extent, String> {
    let protocol = harvest.protocol();
    let profile = profile(args, protocol);
    let names = args.run.conditions.as_ref().unwrap_or(&profile.conditions);
    let chosen = harvest.matrix().choose(names).map_err(|e| format!("--conditions: {e}"))?;
    let conditions: Vec<String> = chosen.iter().map(|condition| condition.name.clone()).collect();
    if args.run.repeats.is_some() && !conditions.iter().any(|name| name == NOMINAL) {
        return Err("--repeats: applies to the condition nominal, which --conditions does not include".into());
    }
    if args.run.horizon.is_some() && conditions.iter().all(|name| is_exhaustion(name)) {
        let names = conditions.join(", ");
        return Err(format!("--horizon: does not apply to {names}, and no other condition is run"));
    }
    let horizon = args.run.horizon.unwrap_or_else(|| profile.horizon.value());
    let horizon = profile.horizon.with_value(horizon).map_err(|e| format!("--horizon: {e}"))?;
    let official = &protocol.official_set().repeats;
    let is_official = args.run.seeds.as_ref().is_some_and(Seeds::is_official);
    let repeats = args.run.repeats.unwrap_or(if is_official { official.get() } else { 1 });
    let repeats = official.with_value(repeats).map_err(|e| format!("--repeats: {e}"))?.get();
    let TreeExtent { profile, seeds, trees } = trees.clone();
    Ok(Extent { profile, conditions, seeds, trees, repeats, horizon_s: horizon.si() })
}

#[cfg(test)]
#[path = "plans_tests.rs"]
mod tests;
