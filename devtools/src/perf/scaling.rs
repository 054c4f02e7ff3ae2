//! Suite `scaling`: the scaling task on a larger plan, `[scaling.study]` of the protocol, and the cost of each kind of
//! randomisation.

use std::sync::atomic::AtomicBool;

use orchard_scaling::{
    AxisRow, Omitted, PublishedScaling, Row as CellRow, Scaling, ScalingPlan, ScalingRules, SolverName,
    measure as measure_plan,
};
use orchard_scenario::Scenario;
use orchard_spec::randomisation::Mode;
use orchard_tasks::plan_file::Backend;
use orchard_tasks::protocol::Protocol;

use orchard_program::commands::bench_v1::default_threads;
use orchard_program::commands::bench_v1::scaling::{Cells, name};
use orchard_program::rows::{Effort, Measured, Row};

/// Numbers of worlds with a row of the build time: those that the paper reports.
const BUILT: [u32; 2] = [64, 512];
/// Solver that the paper's rates refer to.
const PAPER: &str = "the paper's conjugate gradients, at most";

/// On the processor.
pub fn on_cpu(effort: Effort) -> anyhow::Result<Measured> {
    measure(effort, Backend::Cpu)
}

/// On the graphics device.
pub fn on_gpu(effort: Effort) -> anyhow::Result<Measured> {
    measure(effort, Backend::Gpu)
}

fn measure(effort: Effort, backend: Backend) -> anyhow::Result<Measured> {
    let scenario = Scenario::of(&[])?;
    let protocol = Protocol::of_scenario(&scenario)?;
    let rules = &ScalingRules::of(&protocol)?;
    let plan = ScalingPlan::study(&scenario, backend, effort == Effort::Quick)?;
    let (plan, gpu) = plan.with_device(rules)?;
    let bar = Cells::new(&plan);
    let never = AtomicBool::new(false);
    let result = measure_plan(&plan, gpu.as_ref(), default_threads(), &never, &bar);
    bar.clear();
    let scaling = result?;
    let mut measured = Measured::from(rows(&scaling, &rules.published));
    measured.context.insert("backend", Some(backend.name().to_owned()));
    measured.context.insert("adapter", scaling.adapter.as_ref().map(|adapter| adapter.name.clone()));
    measured.context.insert("driver", scaling.adapter.as_ref().map(|adapter| adapter.driver.clone()));
    measured.scaling = Some(Box::new(scaling));
    Ok(measured)
}

/// One row per cell, timed or skipped; the build times; the kinds of randomisation.
fn rows(scaling: &Scaling, paper: &PublishedScaling) -> Vec<Row> {
    let cells = scaling.rows.iter().map(|row| rate(row, paper));
    let omitted = scaling.omitted.iter().map(left_out);
    let built = scaling.rows.iter().filter(|row| BUILT.contains(&row.worlds));
    let threads = scaling.threads;
    let built = built.map(|row| build(row, threads, paper));
    let axes = scaling.axes.iter().map(of_axis);
    cells.chain(omitted).chain(built).chain(axes).collect()
}

fn row_name(mode: Mode, worlds: u32, solver: SolverName) -> String {
    format!("scaling.{}_{worlds}.{}", name(mode), solver.name())
}

fn rate(cell: &CellRow, paper: &PublishedScaling) -> Row {
    let ends = cell.spread.map(|rate| rate * f64::from(cell.worlds));
    let row =
        Row::measured(&row_name(cell.mode, cell.worlds, cell.solver), cell.env_steps_per_s, "env-steps/s");
    let row = Row { spread: Some(ends), note: cell.note.clone(), ..row };
    match paper.at(cell.mode, cell.worlds) {
        Some(rate) => row.beside(PAPER, rate.high),
        None => row,
    }
}

fn left_out(cell: &Omitted) -> Row {
    let row = Row::measured(&row_name(cell.mode, cell.worlds, cell.solver), f64::NAN, "env-steps/s");
    Row { note: Some(format!("skipped: {}", cell.why)), ..row }
}

fn build(cell: &CellRow, threads: u32, paper: &PublishedScaling) -> Row {
    let row_name = format!("{}.build", row_name(cell.mode, cell.worlds, cell.solver));
    let note = format!(
        "elapsed; {threads} threads grow and settle the worlds; of this, packing {:.3} s",
        cell.pack_s
    );
    let note = cell.note.as_ref().map_or(note.clone(), |particular| format!("{note}; {particular}"));
    let row = Row { note: Some(note), ..Row::measured(&row_name, cell.build_s(), "s") };
    match paper.build_at(cell.mode, cell.worlds) {
        Some(build) => row.beside("the paper", build.value),
        None => row,
    }
}

fn of_axis(axis: &AxisRow) -> Row {
    let row_name = format!("scaling.axis.{}.{}", axis.axis.name(), axis.solver.name());
    let note = format!("rate of {} settled worlds over that of as many identical ones", axis.worlds);
    let note = axis.note.as_ref().map_or(note.clone(), |particular| format!("{note}; {particular}"));
    Row { spread: Some(axis.spread), note: Some(note), ..Row::measured(&row_name, axis.relative, "1") }
}
