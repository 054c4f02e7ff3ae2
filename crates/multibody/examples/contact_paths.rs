//! Times both contact paths by the number of rows: a heavy base presses a canopy against a wall, and every step is
//! taken by each path from the same state. Prints the table of `docs/computation/dynamics.md`. Arguments: links of the
//! tree (151) and substeps (330).

#[path = "../tests/suite/common/canopy.rs"]
mod canopy;

use std::collections::BTreeMap;

use orchard_geometry::Vec3;
use orchard_multibody::{ContactPath, Data, Integrator, Model, Solver, StepReport, StepSettings, step};

/// Each step is timed as often, and the fastest counts.
const REPEATS: usize = 3;
/// Rows of a line of the table.
const BIN: usize = 30;

#[derive(Default)]
struct Line {
    steps: f64,
    newton: f64,
    cg: f64,
    direct: f64,
    matrix_free: f64,
}

fn settings(contact_path: ContactPath) -> StepSettings {
    StepSettings {
        h: 1.0 / 180.0,
        gravity: Vec3::new(0.0, 0.0, -9.81),
        contact_dissipation_time: 0.01,
        contact_margin: 0.01,
        integrator: Integrator::default(),
        solver: Solver::default(),
        contact_path,
    }
}

/// Processor time of this process [s].
fn cpu_seconds() -> f64 {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    now.tv_sec as f64 + 1e-9 * now.tv_nsec as f64
}

/// Least processor time of a step from a state [us].
fn time(model: &Model, data: &Data, path: ContactPath, report: &mut StepReport) -> f64 {
    let mut best = f64::INFINITY;
    let mut scratch = data.clone();
    for _ in 0..REPEATS {
        scratch.clone_from(data);
        let start = cpu_seconds();
        step(model, &mut scratch, &settings(path), report);
        best = best.min(cpu_seconds() - start);
    }
    best * 1e6
}

fn main() {
    let mut arguments = std::env::args().skip(1).map(|argument| argument.parse::<usize>());
    let mut next = |default| arguments.next().and_then(Result::ok).unwrap_or(default);
    let (links, steps) = (next(151), next(330));
    let (model, mut data) = canopy::canopy(links, 1.2);
    let mut lines = BTreeMap::<usize, Line>::new();
    let mut report = StepReport::default();
    for _ in 0..steps {
        let direct = time(&model, &data, ContactPath::Delassus, &mut report);
        let newton = report.newton_iterations;
        let matrix_free = time(&model, &data, ContactPath::MatrixFree, &mut report);
        let line = lines.entry((3 * report.contacts.len()).div_ceil(BIN)).or_default();
        line.steps += 1.0;
        line.newton += newton as f64;
        line.cg += report.cg_iterations as f64;
        line.direct += direct;
        line.matrix_free += matrix_free;
        step(&model, &mut data, &settings(ContactPath::ByRows), &mut report);
    }
    println!("rows up to | steps | Newton | CG | Delassus us | matrix-free us");
    for (bin, line) in lines {
        let mean = |sum: f64| sum / line.steps;
        println!(
            "{:4} | {:3} | {:4.1} | {:5.1} | {:7.1} | {:7.1}",
            bin * BIN,
            line.steps,
            mean(line.newton),
            mean(line.cg),
            mean(line.direct),
            mean(line.matrix_free)
        );
    }
}
