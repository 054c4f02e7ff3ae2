//! `cargo xtask tidy`: rules of the project that a machine can check.

mod architecture;
mod circles;
mod commands;
mod crates;
mod figures;
mod lengths;
mod mapping;
mod marked;
pub mod metrics;
mod purity;
mod robot_pages;
pub mod sources;

use std::path::Path;

use crate::workspace;
use orchard_program::Failure;

/// Checks the crate graph, the architecture page, source keys and file lengths.
#[derive(clap::Args)]
#[command(
    after_help = "Checks:\n  crates depend only on crates below them; networks, perception, picker, policy and learned controllers have no access to ground truth\n  \
the files of a crate have no circular imports\n  \
crates from quantity to learned, play, report and web open no files and read no clock\n  docs/architecture.md names every crate and no other\n  the tables of metrics and robots and the reference of a robot's mapping are those of the code\n  \
every source key in configs/ and of the robots exists in docs/references.bib, and README and conventions count them rightly\n  \
every command line of README, docs and --help is one that `orchard` and `cargo xtask` take, and their blocks of TOML and JSON are valid\n  no source file is longer than 800 lines (warning above 500)"
)]
pub struct Args {
    /// Bring the tables of metrics, robots and sources and the reference of the mapping in the documentation up to date instead of comparing them.
    #[arg(long)]
    write: bool,
}

/// The crates, lowest first. A crate may use only crates that stand before it.
const LAYERS: [&str; 45] = [
    "quantity",
    "spec",
    "geometry",
    "network",
    "treegen",
    "multibody",
    "camera",
    "perception",
    "treephys",
    "digitised",
    "exchange",
    "fruit",
    "tensor",
    "cuda",
    "batch",
    "robot",
    "gpu",
    "picker",
    "policy",
    "learned",
    "input",
    "world",
    "play",
    "scenario",
    "statistics",
    "bench",
    "tasks",
    "lockstep",
    "env",
    "scaling",
    "dataset",
    "demos",
    "leaderboard",
    "recording",
    "report",
    "web",
    "web-batch",
    "view",
    "program",
    "orchardbench",
    "python",
    "tests",
    "devtools",
    "xtask",
    "fuzz",
];

impl Args {
    /// Options of a check that writes nothing.
    pub fn reading() -> Self {
        Self { write: false }
    }
}

/// Findings of a check.
#[derive(Debug, Default, PartialEq)]
pub struct Findings {
    /// Rules broken, a line each.
    pub errors: Vec<String>,
    /// Warnings, a line each.
    pub warnings: Vec<String>,
}

impl Findings {
    fn errors(errors: Vec<String>) -> Self {
        Self { errors, warnings: Vec::new() }
    }
}

pub fn run(args: &Args) -> Result<(), Failure> {
    let findings = check(&workspace::root(), args.write)?;
    for warning in &findings.warnings {
        eprintln!("warning: {warning}");
    }
    for error in &findings.errors {
        eprintln!("error: {error}");
    }
    match findings.errors.len() {
        0 => {
            eprintln!("tidy: no rule broken, {} warnings", findings.warnings.len());
            Ok(())
        }
        n => Err(Failure::Failed(format!("tidy: {n} rules broken"))),
    }
}

fn check(root: &Path, write: bool) -> anyhow::Result<Findings> {
    let packages = crates::packages(root)?;
    let mut all = Findings::default();
    for found in [
        Findings::errors(crates::check(&packages)),
        Findings::errors(circles::check(root)?),
        Findings::errors(purity::check(root)?),
        Findings::errors(architecture::check(root, &packages)?),
        Findings::errors(sources::check(root)?),
        Findings::errors(figures::check(root, write)?),
        Findings::errors(commands::check(root)?),
        Findings::errors(metrics::check(root, write)?),
        Findings::errors(mapping::check(root, write)?),
        Findings::errors(robot_pages::check(root, write)?),
        lengths::check(root)?,
    ] {
        all.errors.extend(found.errors);
        all.warnings.extend(found.warnings);
    }
    Ok(all)
}

#[cfg(test)]
mod fixture {
    /// A temporary folder with files of the given texts.
    pub fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in files {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        }
        folder
    }
}
