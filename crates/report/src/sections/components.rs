//! The component tasks: one skill at a time.

use maud::{Markup, html};
use orchard_bench::component::{ComponentSummary, ReachAndGrasp, metrics};

use super::{Section, missing};
use crate::results::Results;
use crate::table::{Cell, table};
use crate::words::{digits, interval, number, plain, title, unit, why};

/// The section.
pub(crate) fn section(results: &Results) -> Section {
    let body = html! {
        @if results.components.is_empty() {
            (missing("No component task in this folder.", "cargo xtask bench-v1 --tasks reach-and-grasp,gentle"))
        } @else {
            p {
                strong { "reach-and-grasp" } ": hold a named fruit. " strong { "gentle" } ": push the hand through the canopy to a point behind it. \
                 Loads are those of the robot on live wood; without contact they are 0."
            }
            @for summary in &results.components { (one(summary)) }
        }
    };
    Section { id: "components", title: "Component tasks", body }
}

fn one(summary: &ComponentSummary) -> Markup {
    let row = |name: &str| {
        let metric = summary.metrics.get(name)?;
        let digits = digits(name);
        Some(vec![
            Cell::words(title(name)).because(Some(name)),
            Cell::main(number(metric.mean, digits)).because(why(metric)),
            Cell::number(interval(metric.ci95, digits)).because(why(metric)),
            Cell::number(metric.n.to_string()),
            Cell::words(unit(name)),
        ])
    };
    let rows: Vec<_> = metrics::<ReachAndGrasp>().iter().filter_map(|m| row(m.name)).collect();
    let counts = |counts: &std::collections::BTreeMap<String, u32>| {
        let list: Vec<String> = counts.iter().map(|(name, n)| format!("{} {n}", plain(name))).collect();
        if list.is_empty() { "none".to_owned() } else { list.join(", ") }
    };
    html! {
        h3 { (summary.run.task) }
        (table(&format!("Metrics of {}", summary.run.task), &["metric", "mean", "95 % interval", "n", "unit"], &rows))
        p.note {
            "Trials ended: " (counts(&summary.outcomes)) ". Attempts given up: " (counts(&summary.failures)) ". Controller "
            (summary.run.controller) ", " (summary.trees.len()) " trees."
        }
    }
}
