//! `cargo xtask export-tree`: a world's tree and fruit as a model for another engine.

use std::path::PathBuf;

use clap::ValueEnum;
use orchard_bench::store::write_bytes;
use orchard_spec::Spec;

use crate::bare_tree::BareTree;
use crate::failure::Failure;

/// Writes a tree with its fruit as a model for another physics engine.
#[derive(clap::Args)]
#[command(
    after_help = "The file holds the very equations of the simulator: two hinges a joint with springs and dampers, inertias, fruit on\n\
                  tethers. Drag, the tether's reaction cap, rupture and contacts are left out. docs/computation/judge.md tells how.\n\n\
                  Example:\n  cargo xtask export-tree --seed 20250704 --out tree.xml"
)]
pub struct Args {
    /// Seed of the population
    #[arg(long, value_name = "S")]
    seed: u64,
    /// Which of the seed's trees
    #[arg(long, default_value_t = 0, value_name = "N")]
    tree: u32,
    /// Configuration
    #[arg(long, value_enum, default_value_t = Preset::Paper)]
    preset: Preset,
    /// Format of the file; mjcf is MuJoCo's
    #[arg(long, value_enum, default_value_t = Format::Mjcf)]
    format: Format,
    /// The file to write
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Preset {
    Paper,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Format {
    Mjcf,
}

/// Time step that the file asks for [s].
const TIME_STEP: f64 = 1e-3;

pub fn run(args: &Args) -> Result<(), Failure> {
    let spec = match args.preset {
        Preset::Paper => Spec::paper(),
    };
    let tree = BareTree::new(&spec, args.seed, args.tree)?;
    let text = match args.format {
        Format::Mjcf => tree.mjcf(TIME_STEP)?,
    };
    write_bytes(&args.out, text.as_bytes()).map_err(|e| Failure::BadInput(e.to_string()))?;
    eprintln!(
        "{}: {} links, {} fruit",
        args.out.display(),
        tree.model.bodies().len(),
        tree.model.points().len()
    );
    Ok(())
}
