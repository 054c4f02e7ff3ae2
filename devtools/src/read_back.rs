//! `cargo xtask read-back`: exported trees, data sets and recordings read by third-party tools.

mod data_sets;
mod recordings;

use std::path::PathBuf;

use orchard_bench::store::{write_bytes, write_json};
use orchard_spec::Spec;
use serde::Serialize;

use crate::python;
use orchard_program::Failure;
use orchard_program::Verdict;
use orchard_program::bare_tree::BareTree;
use orchard_program::commands::export_tree::Format;

/// Reads exported trees back with mujoco, yourdfpy, usd-core and trimesh, data sets with pycocotools, and recordings with
/// mcap, and compares.
#[derive(clap::Args)]
#[command(
    after_help = "Needs python3 with venv, and the network on the first run: packages go into target/exchange/venv,\n                  target/dataset/venv and target/recording/venv.\n\
                  If they are missing, the comparison is skipped with a message; with CI=true in the environment it fails."
)]
pub struct Args {}

/// Folder of the script and of the last run's output.
const SUITE: &str = "exchange";
/// Seeds and trees that are compared.
const TREES: [(u64, u32); 2] = [(20250704, 0), (2, 3)];
/// The formats that have a reader.
const FORMATS: [Format; 5] = [Format::Json, Format::Mjcf, Format::Urdf, Format::Usd, Format::Gltf];

/// Input of the Python script.
#[derive(Serialize)]
struct Case {
    /// Stem of the files' names.
    name: String,
    /// Density of the wood \[kg/m^3\].
    density: f64,
}

pub fn run(_: &Args) -> Result<(), Failure> {
    if let Verdict::Skipped(reason) = read_back()? {
        eprintln!("SKIPPED: not everything is read back: {reason}");
    }
    Ok(())
}

/// Writes, reads and compares; `Skipped` gives the reason why it cannot.
fn read_back() -> Result<Verdict, Failure> {
    let verdicts = [read_trees()?, data_sets::read_back()?, recordings::read_back()?];
    let skipped: Vec<String> = verdicts
        .into_iter()
        .filter_map(|verdict| match verdict {
            Verdict::Skipped(reason) => Some(reason),
            Verdict::Agreed => None,
        })
        .collect();
    Ok(if skipped.is_empty() { Verdict::Agreed } else { Verdict::Skipped(skipped.join("; ")) })
}

fn read_trees() -> Result<Verdict, Failure> {
    let environment = match python::environment(SUITE)? {
        Ok(environment) => environment,
        Err(skipped) => return Ok(skipped),
    };
    let spec = Spec::paper();
    let cases = TREES.map(|(seed, tree)| write_case(&spec, seed, tree));
    let cases = cases.into_iter().collect::<anyhow::Result<Vec<_>>>()?;
    environment.compare("read_back.py", &cases)?;
    Ok(Verdict::Agreed)
}

fn write_case(spec: &Spec, seed: u64, world: u32) -> anyhow::Result<PathBuf> {
    let folder = python::folder(SUITE);
    let tree = BareTree::new(spec, seed, world)?;
    for format in FORMATS {
        write_bytes(&folder.join(format!("{}.{}", tree.name, format.extension())), &format.write(&tree)?)?;
    }
    let file = folder.join(format!("{}.case", tree.name));
    write_json(&file, &Case { name: tree.name, density: spec.wood.density.si() })?;
    Ok(file)
}
