//! `orchard scenario`: shows the configuration that results from the options of a scenario.

use clap::Subcommand;
use orchard_scenario::{Figure, Names};
use serde::Serialize;

use crate::args::ScenarioArgs;
use crate::columns::columns;
use crate::failure::Failure;
use crate::program::Program;

/// Shows the configuration that results from the options of a scenario.
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Show(ShowArgs),
}

/// Prints a resolved scenario: parts, hash, and every figure with unit, source and the preset, file or option that set it.
#[derive(clap::Args)]
#[command(
    after_help = "Sources are keys of docs/references.bib. A scenario file is TOML; every field may be left out:\n  \
                  preset = \"tall-spindle\"     # or config = \"mine.toml\"\n  \
                  tree = \"measured.mtg\"       # a digitised tree in every world\n  \
                  randomisation = 0.5         # or a file of changed figures\n  \
                  robot = \"fr3-fixed\"       # or its folder, or a URDF file\n  camera = \"d435i\"            # or a file\n  detector = \"d435i\"\n  controller = \"expert\"     # or a learned policy: \"onnx:policy.onnx\"\n  \
                  [rules]                     # changed figures of configs/bench/v1.toml\n\n\
                  Examples:\n  orchard scenario show --preset v-trellis --camera d435i\n  \
                  orchard scenario show --scenario mine.toml --json"
)]
pub struct ShowArgs {
    #[command(flatten)]
    scenario: ScenarioArgs,
    /// Print JSON: names, hash and figures
    #[arg(long)]
    json: bool,
}

/// A scenario as `--json` prints it.
#[derive(Serialize)]
struct Shown<'a> {
    #[serde(flatten)]
    names: &'a Names,
    hash: String,
    figures: Vec<Figure>,
}

pub fn run(args: &Args, program: &Program) -> Result<(), Failure> {
    let Command::Show(args) = &args.command;
    let scenario = args.scenario.resolve(program)?;
    let (names, hash, figures) = (scenario.names(), scenario.hash(), scenario.figures());
    if args.json {
        let shown = serde_json::to_string_pretty(&Shown { names, hash, figures });
        say!("{}", shown.map_err(|e| Failure::Failed(e.to_string()))?);
        return Ok(());
    }
    let mut parts: Vec<Vec<String>> =
        names.scene.list().iter().map(|(part, name)| vec![(*part).to_owned(), (*name).to_owned()]).collect();
    parts.push(vec!["controller".to_owned(), names.controller.clone()]);
    parts.push(vec!["hash".to_owned(), hash]);
    say!("{}", columns(&parts, &[0, 1]).trim_end());
    let mut rows = vec![["figure", "value", "unit", "source", "set by"].map(str::to_owned).to_vec()];
    rows.extend(figures.into_iter().map(|figure| {
        let Figure { path, value, unit, source, from } = figure;
        vec![path, value.to_string(), unit, source, from]
    }));
    say!("\n{}", columns(&rows, &[0, 1, 2, 3, 4]).trim_end());
    Ok(())
}
