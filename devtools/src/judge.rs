//! `cargo xtask judge`: compares the tree physics with MuJoCo.

mod paths;

use std::path::Path;

use anyhow::Context;
use orchard_bench::store::{write_bytes, write_json};
use orchard_spec::Spec;
use serde::Serialize;

use crate::python;
use orchard_program::Failure;
use orchard_program::Verdict;
use orchard_program::bare_tree::BareTree;
use paths::TreePaths;

/// Steps exported trees with MuJoCo and compares rest, pull and release with our own paths.
#[derive(clap::Args)]
#[command(
    after_help = "Needs python3 with venv, and the network on the first run: MuJoCo is installed into target/judge/venv.\n\
                  If they are missing, the comparison is skipped with a message; with CI=true in the environment it fails.\n\
                  Inputs and outcome of the last run are in target/judge."
)]
pub struct Args {}

/// Folder of the script and of the last run's output.
pub const SUITE: &str = "judge";
/// Seeds and trees that are compared.
const TREES: [(u64, u32); 3] = [(20250704, 0), (1, 0), (2, 3)];
/// Time step of our paths \[s\].
const TIME_STEP: f64 = 1e-3;

/// Input of the Python script.
#[derive(Serialize)]
struct Case {
    mjcf: String,
    #[serde(flatten)]
    paths: TreePaths,
}

pub fn run(_: &Args) -> Result<(), Failure> {
    if let Verdict::Skipped(reason) = judge()? {
        eprintln!("SKIPPED: no comparison with MuJoCo: {reason}");
    }
    Ok(())
}

/// Compares; `Skipped` gives the reason why it cannot. In continuous integration that is a failure.
fn judge() -> Result<Verdict, Failure> {
    let environment = match python::environment(SUITE)? {
        Ok(environment) => environment,
        Err(skipped) => return Ok(skipped),
    };
    let spec = Spec::paper();
    let cases = TREES.map(|(seed, tree)| write_case(&spec, seed, tree, &python::folder(SUITE)));
    let cases = cases.into_iter().collect::<anyhow::Result<Vec<_>>>()?;
    environment.compare("judge.py", &cases)?;
    Ok(Verdict::Agreed)
}

/// Writes a tree's model and our paths of it; returns the path of the case's file.
fn write_case(spec: &Spec, seed: u64, world: u32, folder: &Path) -> anyhow::Result<std::path::PathBuf> {
    let mut tree = BareTree::new(spec, seed, world)?;
    let mjcf = format!("{}.xml", tree.name);
    write_bytes(&folder.join(&mjcf), tree.mjcf(TIME_STEP)?.as_bytes())?;
    let paths = paths::simulate(&mut tree, TIME_STEP)
        .with_context(|| format!("seed {seed}, tree {world}: our own paths"))?;
    let file = folder.join(format!("{}.json", tree.name));
    write_json(&file, &Case { mjcf, paths })?;
    Ok(file)
}
