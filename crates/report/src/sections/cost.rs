//! Sections on the cost of computing.

use maud::{Markup, html};
use orchard_bench::compute::{Compute, TaskCost};
use orchard_scaling::{AxisRow, Omitted, PublishedScaling, PublishedSolver, Row, Scaling};

use super::{Section, missing, side_by_side};
use crate::figures::Figures;
use crate::results::Results;
use crate::table::{Cell, table};
use crate::words::{grouped, mode, number};

/// Throughput over parallel worlds.
pub(crate) fn scaling(results: &Results, figures: &Figures) -> Section {
    let body = html! {
        @if figures.scaling.is_empty() {
            (missing("No scaling run in this folder.", "cargo xtask bench-v1 --tasks scaling"))
        } @else {
            p {
                "Physics only, without rendering; both axes are logarithmic; an env-step is one frame (1/60 s) of one world. Marks are medians of the \
                 repeats, caps the slowest and the fastest; " (ran_on(&results.scaling)) ". "
                @if results.scaling.len() > 1 { "The fastest solver of each backend is drawn; the table has all. " }
                "Grey bands and hollow marks are the paper's rates on its laptop GPU" @if let Some(paper) = &figures.published_scaling { (solvers(paper)) } "."
            }
            (side_by_side(&figures.scaling))
            (rows(&results.scaling))
            (axes(&results.scaling))
        }
    };
    Section { id: "scaling", title: "Scaling over worlds", body }
}

/// Returns the hardware that the batches ran on: adapters, or threads and SIMD lanes.
fn ran_on(scalings: &[Scaling]) -> String {
    let of = |scaling: &Scaling| match &scaling.adapter {
        Some(adapter) if adapter.is_software => format!("{} (in software, for tests)", adapter.name),
        Some(adapter) => adapter.name.clone(),
        None => format!("{} threads, lanes of {}", scaling.threads, scaling.instructions),
    };
    scalings.iter().map(of).collect::<Vec<_>>().join("; ")
}

/// Returns the paper's limits of its solvers: most worlds, memory, slowdown.
fn solvers(paper: &PublishedScaling) -> String {
    let of = |solver: &PublishedSolver| {
        let mut text = format!(", {} up to {} worlds", solver.name, solver.most_worlds);
        if let Some(memory) = solver.memory {
            text += &format!(" with {memory} {}", solver.unit);
        }
        if solver.heavier > 1.0 {
            let [least, most] = solver.slower;
            text += &format!(", {least} to {most} times slower with {} times the memory", solver.heavier);
        }
        text
    };
    paper.solvers.iter().map(of).collect()
}

fn rows(scalings: &[Scaling]) -> Markup {
    let row = |r: &Row| {
        vec![
            Cell::words(r.solver.name()),
            Cell::words(mode(r.mode)),
            Cell::number(r.worlds.to_string()),
            Cell::number(number(Some(r.step_rate_per_s), 1)),
            Cell::main(grouped(r.env_steps_per_s.max(0.0).round() as u64)),
            Cell::number(grouped(r.substeps_per_s.max(0.0).round() as u64)),
            Cell::number(number(r.memory_mib, 0)).because(r.memory_mib.is_none().then_some("not measured")),
            Cell::number(number(Some(r.build_s()), 2)),
        ]
    };
    let rows: Vec<_> = scalings.iter().flat_map(|scaling| &scaling.rows).map(row).collect();
    let heads = [
        "solver",
        "mode",
        "worlds",
        "frames of the batch [1/s]",
        "env-steps/s",
        "substeps/s",
        "memory [MiB]",
        "build [s]",
    ];
    let omitted: Vec<&Omitted> = scalings.iter().flat_map(|scaling| &scaling.omitted).collect();
    html! {
        details { summary { "All rows" } (table("Scaling over worlds", &heads, &rows)) }
        @if !omitted.is_empty() {
            details {
                summary { "Skipped cells" }
                ul { @for cell in omitted {
                    li { (cell.solver.name()) ", " (mode(cell.mode)) ", " (cell.worlds) " worlds: " (cell.why) }
                } }
            }
        }
    }
}

/// Table of the cost of each kind of randomisation.
fn axes(scalings: &[Scaling]) -> Markup {
    let row = |r: &AxisRow| {
        let [least, most] = r.spread.map(|x| number(Some(x), 2));
        vec![
            Cell::words(r.solver.name()),
            Cell::words(r.axis.name()),
            Cell::number(r.worlds.to_string()),
            Cell::main(number(Some(r.relative), 2)),
            Cell::number(format!("{least} to {most}")),
        ]
    };
    let rows: Vec<_> = scalings.iter().flat_map(|scaling| &scaling.axes).map(row).collect();
    let heads =
        ["solver", "kind of difference", "settled worlds", "rate relative to identical worlds", "repeats"];
    html! {
        @if !rows.is_empty() {
            details {
                summary { "Single kinds of randomisation" }
                (table("Rate of worlds that differ in one kind", &heads, &rows))
            }
        }
    }
}

/// Section on the compute cost of the tasks.
pub(crate) fn compute(results: &Results) -> Section {
    let body = html! {
        @match &results.compute {
            None => (missing("No compute.json in this folder.", "cargo xtask bench-v1")),
            Some(compute) => {
                (costs(compute))
                p.note {
                    "Including sensing and control; env-steps of the detection task are images. Only these figures and those of scaling depend on \
                     the machine."
                }
            },
        }
    };
    Section { id: "compute", title: "Compute", body }
}

/// One column per task.
fn costs(compute: &Compute) -> Markup {
    let costs: Vec<&TaskCost> = compute.tasks.values().collect();
    let row = |name: &str, unit: &str, cell: &dyn Fn(&TaskCost) -> Cell| -> Vec<Cell> {
        let cells = costs.iter().map(|cost| cell(cost));
        std::iter::once(Cell::words(name)).chain(cells).chain([Cell::words(unit)]).collect()
    };
    let number_of = |value: Option<f64>, digits| {
        let reason = "every record was reused, or the system does not report it";
        Cell::main(number(value, digits)).because(value.is_none().then_some(reason))
    };
    let count = |n: usize| Cell::number(grouped(n as u64));
    let reused = |cost: &TaskCost| cost.records.iter().filter(|record| record.wall_s.is_none()).count();
    let rows = [
        row("wall time", "s", &|cost| number_of(Some(cost.wall_s), 1)),
        row("threads", "", &|cost| count(cost.threads as usize)),
        row("env-steps computed", "", &|cost| Cell::number(grouped(cost.env_steps))),
        row("step rate of one world", "frames/s", &|cost| number_of(cost.step_rate_per_s, 0)),
        row("throughput", "env-steps/s", &|cost| number_of(cost.env_steps_per_s, 0)),
        row("simulated time", "world-seconds/s", &|cost| number_of(cost.world_seconds_per_s, 1)),
        row("peak memory", "MiB", &|cost| number_of(cost.peak_memory_mib, 0)),
        row("records", "", &|cost| count(cost.records.len())),
        row("reused records", "", &|cost| count(reused(cost))),
    ];
    let tasks = compute.tasks.keys().map(String::as_str);
    let heads: Vec<&str> = std::iter::once("figure").chain(tasks).chain(["unit"]).collect();
    table("Cost of the last run of each task", &heads, &rows)
}
