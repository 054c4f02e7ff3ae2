//! `cargo xtask merge`: the parts of a run as one result.

use std::collections::BTreeMap;
use std::path::PathBuf;

use orchard_bench::Shard;
use orchard_bench::episode::CODE_VERSION;
use orchard_bench::order::{Order, PlanFile};
use orchard_bench::store::Store;

use crate::bench_v1::{job, open};
use crate::failure::Failure;

/// Puts the parts of a run of bench-v1 together, byte for byte what one run would have written.
#[derive(clap::Args)]
#[command(
    after_help = "Parts are what `bench-v1 --shard I/N` wrote, each into a folder of its own, on one machine or many. All tasks of their\n\
                  plans are merged; the plans must be equal but for the part, and all records there. compute.json is each machine's\n\
                  own and is not merged.\n\n\
                  Exit code 2: a folder without a plan, plans that differ, missing or changed records: nothing is written then.\n\n\
                  Example, on one machine:\n  \
                  for i in 1 2 3 4; do cargo xtask bench-v1 --shard $i/4 --out parts/$i; done\n  \
                  cargo xtask merge parts/* --out results/whole"
)]
pub struct Args {
    /// Folders of the parts
    #[arg(value_name = "DIR", required = true)]
    parts: Vec<PathBuf>,
    /// Where the whole result goes
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

pub fn run(args: &Args) -> Result<(), Failure> {
    let bad = |e: &dyn std::fmt::Display| Failure::BadInput(e.to_string());
    let mut parts = Vec::new();
    for path in &args.parts {
        if !path.is_dir() {
            return Err(Failure::BadInput(format!("{}: there is no such folder", path.display())));
        }
        parts.push(Store::open(path).map_err(|e| bad(&e))?);
    }
    let plans = parts.iter().map(PlanFile::read).collect::<Result<Vec<_>, _>>().map_err(|e| bad(&e))?;
    let orders = common(&args.parts, &plans).map_err(Failure::BadInput)?;
    let jobs = orders.iter().map(|order| job::job(order, None)).collect::<Result<Vec<_>, Failure>>()?;
    let (into, _lock) = open(&args.out)?;
    for job in &jobs {
        job.check(&into).map_err(|e| Failure::BadInput(format!("--out: {e}")))?;
    }
    let from: Vec<&Store> = parts.iter().collect();
    jobs.iter().try_for_each(|job| job.merge(&from, &into))?;
    PlanFile::note(&into, &orders, Shard::WHOLE).map_err(|e| Failure::Failed(e.to_string()))
}

/// The orders of all parts, which are one.
fn common(folders: &[PathBuf], plans: &[PlanFile]) -> Result<Vec<Order>, String> {
    let mut orders: BTreeMap<&str, (&PathBuf, &Order)> = BTreeMap::new();
    for (folder, plan) in folders.iter().zip(plans) {
        for (task, noted) in &plan.tasks {
            if noted.code_version != CODE_VERSION {
                return Err(format!(
                    "{}: {task} was run by code version {}, this is {CODE_VERSION}",
                    folder.display(),
                    noted.code_version
                ));
            }
            let (first, order) = orders.entry(task).or_insert((folder, &noted.order));
            if **order != noted.order {
                return Err(format!(
                    "{} and {} were asked for different things of {task} (see their {})",
                    first.display(),
                    folder.display(),
                    PlanFile::FILE
                ));
            }
        }
    }
    if orders.is_empty() {
        return Err("the plans hold no task".to_owned());
    }
    Ok(orders.into_values().map(|(_, order)| order.clone()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use orchard_bench::order::{Noted, Trees};

    fn plan(code: &str, trees: u32) -> PlanFile {
        let trees = Trees { profile: "quick".into(), seeds: vec![1], trees };
        let order = Order::Gentle { controller: "baseline".into(), trees };
        let noted = Noted { code_version: code.into(), shard: Shard::WHOLE, order };
        PlanFile { schema_version: 4, tasks: [("gentle".to_owned(), noted)].into() }
    }

    #[test]
    fn parts_must_be_of_one_plan_and_this_code() {
        let folders = [PathBuf::from("a"), PathBuf::from("b")];
        let of = |plans: [PlanFile; 2]| common(&folders, &plans);
        assert_eq!(of([plan(CODE_VERSION, 2), plan(CODE_VERSION, 2)]).unwrap().len(), 1);
        let e = of([plan(CODE_VERSION, 2), plan(CODE_VERSION, 3)]).unwrap_err();
        assert_eq!(e, "a and b were asked for different things of gentle (see their plan.json)");
        let e = of([plan(CODE_VERSION, 2), plan("x", 2)]).unwrap_err();
        assert!(e.starts_with("b: gentle was run by code version x, this is "), "{e}");
    }
}
