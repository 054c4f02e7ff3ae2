//! What it costs to compute.

use maud::{Markup, html};

use super::{Section, missing, side_by_side};
use crate::figures::Figures;
use crate::published::PaperFigures;
use crate::results::{Results, Scaling};
use crate::table::{Cell, table};
use crate::words::{grouped, number, plain};

/// Throughput over parallel worlds.
pub(crate) fn scaling(results: &Results, figures: &Figures, paper: &PaperFigures) -> Section {
    let paper = &paper.scaling;
    let body = html! {
        @match results.scaling.as_ref().filter(|_| !figures.scaling.is_empty()) {
            None => (missing("No scaling run in this folder.", "cargo xtask bench-v1 --tasks scaling")),
            Some(scaling) => {
                p {
                    "Physics alone, no rendering, both axes logarithmic. An env-step is one frame (1/60 s) of one world. The paper's throughput levels off between "
                    (grouped(paper.plateau_low.get().into())) " and " (grouped(paper.plateau_high.get().into()))
                    " env-steps/s on its laptop GPU where worlds share their dimensions, and at " (paper.distinct.get())
                    " where every world has a geometry of its own."
                }
                (side_by_side(&figures.scaling))
                (rows(scaling))
            },
        }
    };
    Section { id: "scaling", title: "Scaling over worlds", body }
}

fn rows(scaling: &Scaling) -> Markup {
    let row = |r: &crate::results::ScalingRow| {
        vec![
            Cell::words(plain(&r.solver)),
            Cell::words(plain(&r.mode)),
            Cell::number(r.worlds.to_string()),
            Cell::number(number(Some(r.step_rate_per_s), 1)),
            Cell::main(grouped(r.env_steps_per_s.max(0.0).round() as u64)),
            Cell::number(number(r.memory_mib, 0)).because(r.memory_mib.is_none().then_some("not measured")),
        ]
    };
    let rows: Vec<_> = scaling.rows.iter().map(row).collect();
    let heads = ["solver", "mode", "worlds", "frames of the batch [1/s]", "env-steps/s", "memory [MiB]"];
    html! { details { summary { "Every row" } (table("Scaling over worlds", &heads, &rows)) } }
}

/// What the harvest cost.
pub(crate) fn compute(results: &Results) -> Section {
    let body = html! {
        @match &results.compute {
            None => (missing("No compute.json in this folder.", "cargo xtask bench-v1")),
            Some(compute) => {
                @let not_told = |value: Option<f64>| value.is_none().then_some("not told: all episodes were reused, or the system does not say");
                @let cell = |value: Option<f64>, digits| vec![Cell::main(number(value, digits)).because(not_told(value))];
                @let row = |name: &str, cells: Vec<Cell>, unit: &str| [vec![Cell::words(name)], cells, vec![Cell::words(unit)]].concat();
                @let reused = compute.episodes.iter().filter(|e| e.wall_s.is_none()).count();
                (table("Cost of the harvest", &["figure", "value", "unit"], &[
                    row("wall time", cell(Some(compute.wall_s), 1), "s"),
                    row("env-steps computed", vec![Cell::main(grouped(compute.env_steps))], ""),
                    row("throughput", cell(compute.env_steps_per_s, 0), "env-steps/s"),
                    row("simulated time", cell(compute.world_seconds_per_s, 1), "world-seconds/s"),
                    row("peak memory", cell(compute.peak_memory_mib, 0), "MiB"),
                    row("threads", vec![Cell::main(compute.threads.to_string())], ""),
                    row("episodes", vec![Cell::main(compute.episodes.len().to_string())], ""),
                    row("of these, reused", vec![Cell::main(reused.to_string())], ""),
                ]))
                p.note { "Sensing and control included. These figures and those of scaling depend on the machine; nothing else on this page does." }
            },
        }
    };
    Section { id: "compute", title: "Compute", body }
}
