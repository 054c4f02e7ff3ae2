//! `orchard validate`: compares the simulator with measurements, with f64 results and with itself, and writes a file of rows.

mod demanded;
mod effect;
mod fruit;
#[cfg(feature = "gpu")]
mod gpu;
mod harvests;
pub mod ik;
mod page;
mod sensitivity;
mod stem;
mod target;
mod trees;
mod wind;
mod wood;

use std::path::PathBuf;

use orchard_bench::store::write_bytes;

use crate::failure::Failure;
#[cfg(feature = "gpu")]
use crate::failure::Verdict;
use crate::rows::{Effort, Measured, Row, Suite, judge, measure_suite};

/// Compares the simulator with published measurements, the graphics device with f64, or inverse with forward kinematics; writes the rows to a
/// file.
#[derive(clap::Args)]
#[command(after_help = "Suites:\n  \
all          trees, wood, wind, stem and fruit one after the other; `--page` writes a page of what is validated\n  \
trees        200 grown trees of each calibrated preset against measured apple trees\n  \
wood         material, beams, damping, sway and rupture of wood against measurements and closed forms\n  \
wind         profile, gusts and drag of wind against measurements and closed forms\n  \
stem         pulls, bends and twists at the fruit of calibrated trees against measured picks\n  \
fruit        sizes, masses, clusters and bruises of fruit against measurements\n  \
effect       harvests of the preset calibrated beside paper, by two controllers on the same seeds\n  \
sensitivity  effects of the uncertain parameters of the preset calibrated on the expert's harvest, up to a quarter of an hour\n  \
ik           10,000 reachable tool poses of each robot, solved by both inverse kinematics\n  \
gpu          trees and robots on the graphics device against the same in f64: states, ruptures, detachments\n\n\
                  A row of trees has the figure of the grown trees, the measured figure as its target, and the target interval.\n\
                  Pictures are written to the folder FILE-pictures beside FILE. A missed target gives exit code 1 unless\n\
                  its row has a reason why it cannot be met.\n\nExample:\n  orchard validate trees --json trees.json")]
pub struct Args {
    /// Suite to run
    suite: String,
    /// JSON file for the rows
    #[arg(long, value_name = "FILE")]
    json: PathBuf,
    /// Markdown page that says what is validated, grounded, missed and not testable
    #[arg(long, value_name = "FILE")]
    page: Option<PathBuf>,
    /// Take small samples: to see that everything works, not to quote
    #[arg(long)]
    quick: bool,
    /// CSV file of real picks that the suite stem predicts beside its own: a line a pick, with the columns along_n and across_n (largest force along the
    /// hand's axis and across it, in N) and success (1 or 0)
    #[arg(long, value_name = "FILE.csv")]
    picks: Option<PathBuf>,
}

/// Suites that compare the simulator with measurements.
const MEASURED: [fn(Effort) -> anyhow::Result<Measured>; 5] =
    [trees::measure, wood::measure, wind::measure, stem::measure, fruit::measure];

fn measure_all(effort: Effort) -> anyhow::Result<Measured> {
    let mut all = Measured::default();
    for measure in MEASURED {
        let Measured { rows, pictures, .. } = measure(effort)?;
        all.rows.extend(rows);
        all.pictures.extend(pictures);
    }
    Ok(all)
}

const SUITES: &[Suite] = &[
    Suite {
        name: "all",
        about: "trees, wood, wind, stem and fruit one after the other",
        measure: measure_all,
    },
    Suite {
        name: "trees",
        about: "200 grown trees of each calibrated preset against measured ones",
        measure: trees::measure,
    },
    Suite {
        name: "ik",
        about: "10,000 reachable tool poses of each robot, solved by both inverse kinematics",
        measure: ik::measure,
    },
    Suite {
        name: "stem",
        about: "pulls, bends and twists at the fruit of calibrated trees against measured picks",
        measure: stem::measure,
    },
    Suite { name: "wood", about: "wood against measurements and closed forms", measure: wood::measure },
    Suite { name: "wind", about: "wind against measurements and closed forms", measure: wind::measure },
    Suite {
        name: "fruit",
        about: "sizes, masses, clusters and bruises of fruit against measurements",
        measure: fruit::measure,
    },
    Suite {
        name: "effect",
        about: "harvests of the preset calibrated beside paper, on the same seeds",
        measure: effect::measure,
    },
    Suite {
        name: "sensitivity",
        about: "effects of uncertain parameters of the preset calibrated on the expert's harvest",
        measure: sensitivity::measure,
    },
    #[cfg(feature = "gpu")]
    Suite {
        name: "gpu",
        about: "trees and robots on the graphics device against the same in f64",
        measure: gpu::measure,
    },
];

/// Compares the graphics device, if there is one, with f64.
#[cfg(feature = "gpu")]
pub fn check_gpu() -> Result<Verdict, Failure> {
    gpu::check()
}

/// Compares with small samples, as a test: every row has a figure or says why not. Small samples miss targets by chance.
pub fn check_quick() -> Result<(), Failure> {
    let rows = measure_all(Effort::Quick)?.rows;
    let silent = rows.iter().find(|row| row.value.is_none() && row.note.is_none());
    silent.map_or(Ok(()), |row| {
        Err(Failure::Failed(format!("{} has no figure and does not say why", row.name)))
    })
}

pub fn run(args: &Args) -> Result<(), Failure> {
    let effort = if args.quick { Effort::Quick } else { Effort::Full };
    let given = match &args.picks {
        None => Vec::new(),
        Some(file) if ["stem", "all"].contains(&args.suite.as_str()) => {
            stem::given_picks(&stem::picks::from_file(file)?)?
        }
        Some(_) => {
            return Err(Failure::BadInput("--picks: only the suites stem and all predict picks".into()));
        }
    };
    let complete = |rows: &mut Vec<Row>| {
        rows.extend(given);
        demanded::mark(rows);
    };
    let rows = measure_suite("validation", SUITES, &args.suite, &args.json, effort, complete)?;
    if rows.iter().any(|row| row.demanded.is_some()) {
        say!("{}", demanded::summary(&rows));
    }
    if let Some(page) = &args.page {
        write_bytes(page, page::markdown(&rows).as_bytes()).map_err(|e| Failure::Failed(e.to_string()))?;
    }
    judge(&rows)
}
