//! `orchard merge`: combines the parts of a run into one result.

use std::collections::BTreeMap;
use std::path::PathBuf;

use orchard_bench::CODE_VERSION;
use orchard_bench::Shard;
use orchard_bench::store::Store;
use orchard_scenario::{Scenario, StoredScenario};
use orchard_tasks::plan_file::{PlanFile, PlannedTask};
use orchard_tasks::protocol::Protocol;

use crate::commands::bench_v1::plans;
use crate::failure::Failure;
use crate::out_folder::open_folder;
use crate::program::Program;

/// Combines the parts of a bench-v1 run; the result has the same bytes as a single run.
#[derive(clap::Args)]
#[command(
    after_help = "A part is the folder that `bench-v1 --shard I/N` wrote, on any machine. All tasks of the plans are merged. The plans must\n\
                  be equal except for the part, and together the folders must hold all records. compute.json is not merged.\n\n\
                  Exit code 2: a folder without a plan, plans that differ, missing or edited records, copies of a record that differ;\n\
                  nothing is written then. Or a command log that is not the one of its record; no summary is written then.\n\n\
                  Example, on one machine:\n  \
                  for i in 1 2 3 4; do orchard bench-v1 --shard $i/4 --out parts/$i; done\n  \
                  orchard merge parts/* --out results/whole"
)]
pub struct Args {
    /// Folders of the parts
    #[arg(value_name = "DIR", required = true)]
    parts: Vec<PathBuf>,
    /// Folder for the merged result
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

pub fn run(args: &Args, program: &Program) -> Result<(), Failure> {
    let bad = |e: &dyn std::fmt::Display| Failure::BadInput(e.to_string());
    let mut parts = Vec::new();
    for path in &args.parts {
        if !path.is_dir() {
            return Err(Failure::BadInput(format!("{}: no such folder", path.display())));
        }
        parts.push(Store::open(path).map_err(|e| bad(&e))?);
    }
    let files = parts.iter().map(PlanFile::read).collect::<Result<Vec<_>, _>>().map_err(|e| bad(&e))?;
    let planned = common(&args.parts, &files).map_err(Failure::BadInput)?;
    let by = args.parts[0].join(PlanFile::FILE).display().to_string();
    let mut tasks = Vec::new();
    for (PlannedTask { plan, .. }, scenario) in &planned {
        let scenario = Scenario::from_stored(scenario, program.controllers(), &by).map_err(|e| bad(&e))?;
        plan.check(&Protocol::of_scenario(&scenario)?)
            .map_err(|e| Failure::BadInput(format!("{by}: {e}")))?;
        tasks.push(plans::task(plan, &scenario, &args.out, None)?);
    }
    let (into, _lock) = open_folder("--out", &args.out)?;
    for task in &tasks {
        task.check(&into).map_err(|e| Failure::BadInput(format!("--out: {e}")))?;
    }
    let from: Vec<&Store> = parts.iter().collect();
    tasks.iter().try_for_each(|task| task.merge(&from, &into))?;
    let written = planned.iter().try_for_each(|(PlannedTask { plan, .. }, scenario)| {
        PlanFile::write(&into, std::slice::from_ref(plan), scenario, Shard::WHOLE)
    });
    written.map_err(|e| Failure::Failed(e.to_string()))
}

/// The plans of all parts; those of the same task must be equal.
fn common(folders: &[PathBuf], files: &[PlanFile]) -> Result<Vec<(PlannedTask, StoredScenario)>, String> {
    let mut common: BTreeMap<&str, (&PathBuf, &PlannedTask, &StoredScenario)> = BTreeMap::new();
    for (folder, file) in folders.iter().zip(files) {
        for (task, planned) in &file.tasks {
            if planned.code_version != CODE_VERSION {
                return Err(format!(
                    "{}: task {task} was run by code version {}, but this is {CODE_VERSION}",
                    folder.display(),
                    planned.code_version
                ));
            }
            let Some(scenario) = file.scenario(task) else {
                return Err(format!(
                    "{}: the scenario of task {task} is missing in {}",
                    folder.display(),
                    PlanFile::FILE
                ));
            };
            let (first, other, _) = common.entry(task).or_insert((folder, planned, scenario));
            if (&other.plan, &other.scenario) != (&planned.plan, &planned.scenario) {
                return Err(format!(
                    "{} and {} have different plans of task {task} (see their {})",
                    first.display(),
                    folder.display(),
                    PlanFile::FILE
                ));
            }
        }
    }
    if common.is_empty() {
        return Err("the plans contain no task".to_owned());
    }
    Ok(common.into_values().map(|(_, planned, scenario)| (planned.clone(), scenario.clone())).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use orchard_bench::SCHEMA_VERSION;
    use orchard_tasks::plan_file::{Backend, TaskPlan, TreeExtent};

    fn file(code: &str, trees: u32, preset: &str) -> PlanFile {
        let trees = TreeExtent { profile: "quick".into(), seeds: vec![1], trees };
        let scenario = Scenario::of(&[("preset", preset)]).unwrap().stored();
        let plan = TaskPlan::Gentle { trees, backend: Backend::Cpu };
        let hash = scenario.hash.clone();
        let planned =
            PlannedTask { code_version: code.into(), shard: Shard::WHOLE, plan, scenario: hash.clone() };
        PlanFile {
            schema_version: SCHEMA_VERSION,
            tasks: [("gentle".to_owned(), planned)].into(),
            scenarios: [(hash, scenario)].into(),
        }
    }

    #[test]
    fn parts_must_be_of_one_plan_and_this_code() {
        let folders = [PathBuf::from("a"), PathBuf::from("b")];
        let of = |files: [PlanFile; 2]| common(&folders, &files);
        let here = |trees| file(CODE_VERSION, trees, "paper");
        assert_eq!(of([here(2), here(2)]).unwrap().len(), 1);
        for other in [here(3), file(CODE_VERSION, 2, "v-trellis")] {
            let e = of([here(2), other]).unwrap_err();
            assert_eq!(e, "a and b have different plans of task gentle (see their plan.json)");
        }
        let e = of([here(2), file("x", 2, "paper")]).unwrap_err();
        assert!(e.starts_with("b: task gentle was run by code version x, but this is "), "{e}");
    }
}
