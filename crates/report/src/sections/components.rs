//! Section on the component tasks.

use std::collections::BTreeMap;

use maud::{Markup, html};
use orchard_tasks::component::{ComponentSummary, ReachAndGrasp, metrics};

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
                 Loads are measured on live wood; without contact of the robot they are 0."
            }
            (side_by_side(&results.components))
            @for summary in &results.components { (endings(summary)) }
        }
    };
    Section { id: "components", title: "Component tasks", body }
}

/// One column per task.
fn side_by_side(tasks: &[ComponentSummary]) -> Markup {
    let row = |name: &str| {
        let digits = digits(name);
        let mut row = vec![Cell::words(title(name)).because(Some(name))];
        for task in tasks {
            match task.metrics.get(name) {
                Some(metric) => row.extend([
                    Cell::main(number(metric.mean, digits)).because(why(metric)),
                    Cell::number(interval(metric.ci95, digits)).because(why(metric)),
                    Cell::number(metric.n.to_string()),
                ]),
                None => {
                    row.extend(["-"; 3].map(|text| Cell::number(text).because(Some("not in this result"))))
                }
            }
        }
        row.push(Cell::words(unit(name)));
        row
    };
    let rows: Vec<_> = metrics::<ReachAndGrasp>().iter().map(|m| row(m.info.name)).collect();
    let mut heads = vec!["metric"];
    heads.extend(tasks.iter().flat_map(|task| [task.run.task.as_str(), "95 % interval", "n"]));
    heads.push("unit");
    table("Metrics of the component tasks", &heads, &rows)
}

fn endings(summary: &ComponentSummary) -> Markup {
    let counts = |counts: &BTreeMap<String, u32>| {
        let list: Vec<String> = counts.iter().map(|(name, n)| format!("{} {n}", plain(name))).collect();
        if list.is_empty() { "none".to_owned() } else { list.join(", ") }
    };
    html! {
        p.note {
            strong { (summary.run.task) } ", controller " (summary.run.scenario.controller) ", trees: " (summary.trees.len()) ". Outcomes of trials: "
            (counts(&summary.outcomes)) ". Failed attempts: " (counts(&summary.failures)) "."
        }
    }
}
