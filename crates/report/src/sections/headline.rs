//! Headline section: metrics beside the paper's, requirements, variation between episodes.

use std::collections::BTreeMap;

use maud::{Markup, html};
use orchard_statistics::{Component, VarianceComponents};
use orchard_tasks::harvest::metrics::{METRICS, infos};
use orchard_tasks::harvest::summary::{ConditionSummary, Summary};
use orchard_tasks::protocol::Protocol;

use super::{Section, missing};
use crate::requirements::judge_requirements;
use crate::results::{Results, conditions, main_condition, principal};
use crate::table::{Cell, table};
use crate::words::{digits, interval, number, reason_of, title, unit, why};

/// Headline metrics, shown above all others.
const CARDS: [&str; 7] = [
    "harvest_completeness",
    "place_success_per_contact_attempt",
    "place_success_per_attempt",
    "throughput_fruit_per_min",
    "mean_cycle_time_s",
    "branches_snapped_per_tree",
    "fruit_dropped_per_tree",
];

/// The section.
pub(crate) fn section(results: &Results, protocol: &Protocol) -> Section {
    let body = match &results.harvest {
        None => missing("No harvest in this folder.", "cargo xtask bench-v1 --profile full"),
        Some(harvest) => html! {
            @if let Some((name, main)) = main_condition(harvest) {
                p {
                    "Under the condition " strong { (name) } ". Every metric is a ratio of sums over trees, with a 95 % percentile \
                     interval of a hierarchical bootstrap over seeds and trees; its definition is "
                    a href="#definitions" { "below" } ". The paper's figures are for orientation only: its released code assists the grasp and counts by other rules."
                }
                (cards(main, protocol))
            }
            (metrics(&principal(harvest), protocol))
            (requirements_table(harvest, protocol))
            @for (name, results) in conditions(harvest) {
                @if let Some(variance) = &results.variance { (components(name, variance)) }
            }
        },
    };
    Section { id: "headline", title: "Headline", body }
}

fn cards(results: &ConditionSummary, protocol: &Protocol) -> Markup {
    html! {
        div.cards { @for name in CARDS { @if let Some(metric) = results.metrics.get(name) {
            div.card {
                div.name { (title(name)) }
                div.value { (number(metric.mean, digits(name).min(2))) @if !unit(name).is_empty() { " " span.unit { (unit(name)) } } }
                div.range title=[why(metric)] { (interval(metric.ci95, digits(name).min(2))) }
                @if let Some(paper) = protocol.published.get(name) {
                    div.paper { "paper " (number(Some(paper.value), digits(name).min(2))) }
                }
            }
        } } }
    }
}

/// All metrics, conditions side by side.
fn metrics(conditions: &[(&str, &ConditionSummary)], protocol: &Protocol) -> Markup {
    let row = |metric: &'static str| {
        let digits = digits(metric);
        let mut row = vec![Cell::words(title(metric)).because(Some(metric))];
        for (_, results) in conditions {
            match results.metrics.get(metric) {
                Some(found) => row.extend([
                    Cell::main(number(found.mean, digits)).because(why(found)),
                    Cell::number(interval(found.ci95, digits)).because(why(found)),
                    Cell::number(crate::words::grouped(found.n)),
                ]),
                None => {
                    row.extend(["-"; 3].map(|text| Cell::number(text).because(Some("not in this result"))))
                }
            }
        }
        let paper = protocol.published.get(metric).map(|published| published.value);
        let reason = paper.is_none().then_some("the paper gives none");
        row.extend([Cell::number(number(paper, digits)).because(reason), Cell::words(unit(metric))]);
        row
    };
    let rows: Vec<_> = infos().map(|info| row(info.name)).collect();
    let mut heads = vec!["metric"];
    heads.extend(conditions.iter().flat_map(|(name, _)| [*name, "95 % interval", "n"]));
    heads.extend(["paper, nominal", "unit"]);
    table("All metrics: means with 95 % intervals", &heads, &rows)
}

fn requirements_table(harvest: &Summary, protocol: &Protocol) -> Markup {
    let requirements = judge_requirements(harvest, protocol);
    let mut rows = Vec::new();
    for condition in &requirements {
        for judged in condition.judged.iter().flatten() {
            let digits = digits(judged.metric);
            let met = judged.is_met();
            rows.push(vec![
                Cell::words(title(judged.metric)).because(Some(judged.metric)),
                Cell::words(condition.condition),
                Cell::number(judged.requirement.bound().replace(">=", "\u{2265}").replace("<=", "\u{2264}")),
                Cell::main(number(judged.mean, digits)),
                Cell::verdict(if met { "met" } else { "missed" }, met),
            ]);
        }
    }
    let unjudged: Vec<&str> =
        requirements.iter().filter(|c| c.judged.is_none()).map(|c| c.condition).collect();
    html! {
        @if !rows.is_empty() {
            h3 { "Requirements of this project on the controller" }
            (table("Requirements over the tuning seeds", &["metric", "condition", "required", "mean", "verdict"], &rows))
        }
        @if !unjudged.is_empty() {
            p.note {
                "The requirements hold for the tuning seeds and are not judged here (" (unjudged.join(", "))
                "): this run has other seeds, trees, repeats or time."
            }
        }
    }
}

fn components(name: &str, variance: &BTreeMap<String, VarianceComponents>) -> Markup {
    let cell = |component: &Component, digits: usize| {
        let deviation = component.variance.map(f64::sqrt);
        Cell::number(number(deviation, digits)).because(component.undefined.map(|u| reason_of(u, false)))
    };
    let row = |(metric, of): (&str, &VarianceComponents)| {
        let digits = digits(metric);
        vec![
            Cell::words(title(metric)).because(Some(metric)),
            cell(&of.between_seeds, digits),
            cell(&of.between_trees, digits),
            cell(&of.within_tree, digits),
            Cell::number(of.n.to_string()),
            Cell::words(unit(metric)),
        ]
    };
    let known = METRICS.iter().filter_map(|m| Some((m.info.name, variance.get(m.info.name)?)));
    let rows: Vec<_> = known.map(row).collect();
    let heads = ["metric", "between seeds", "between trees", "between repeats", "episodes", "unit"];
    html! {
        h3 { "Variation between single episodes, " (name) }
        p {
            "Standard deviations between seeds, between the trees of a seed, and between repeats of one tree from other start poses. \
             They separate the effect of the tree from chance. A component whose estimate is negative is written as 0."
        }
        (table(&format!("Standard deviations, {name}"), &heads, &rows))
    }
}
