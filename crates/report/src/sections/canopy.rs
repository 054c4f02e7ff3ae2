//! Section on the canopy: success by zone, failure reasons, results by tree, and damage to the tree.

use std::collections::BTreeSet;

use maud::{Markup, html};
use orchard_tasks::harvest::summary::Summary;

use super::{Section, beside, missing};
use crate::figures::{Figures, attempts_of, ranked, seconds_in, states_of};
use crate::published::PaperFigures;
use crate::results::{Results, conditions, main_condition};
use crate::table::{Cell, table};
use crate::words::{number, plain};

const COMMAND: &str = "cargo xtask bench-v1 --profile full";

/// Canopy zones.
pub(crate) fn zones(results: &Results, figures: &Figures, paper: &PaperFigures) -> Section {
    let condition = results.harvest.as_ref().and_then(main_condition);
    let body = html! {
        @match condition {
            None => (missing("No harvest in this folder.", COMMAND)),
            Some((name, _)) => {
                (beside(&html! { p {
                    "The canopy of each tree is divided in three by height and in two by distance from the trunk, based on its reachable fruit. "
                    strong { "Place success" } " is relative to attempts on targets in the zone, " strong { "completeness" }
                    " to the reachable fruit in the zone. Pooled over the trees of " (name)
                    "; the paper has place success of about " (paper.zones.middle.si()) " in the middle canopy and "
                    (paper.zones.others_low.si()) " to " (paper.zones.others_high.si()) " in the lower outer and the upper zones."
                } }, &figures.zones))
            },
        }
    };
    Section { id: "zones", title: "Canopy zones", body }
}

/// Outcomes of attempts and their times.
pub(crate) fn attempts(results: &Results, figures: &Figures) -> Section {
    let body = html! {
        @match &results.harvest {
            Some(harvest) => {
                (contact_outcomes(harvest))
                (alarms(harvest))
                @if figures.attempts.is_empty() {
                    p.missing { "The controller declared no attempt." }
                } @else {
                    (beside(&html! { p {
                        "Every failed attempt that the controller declared has one reason. Facts of the world decide; where they leave it \
                         open, the controller's report does. Times are means over these attempts, including the time until the next \
                         commitment."
                    } }, &figures.attempts))
                    (failures(harvest))
                    (times(harvest))
                }
            },
            None => (missing("No harvest in this folder.", COMMAND)),
        }
    };
    Section { id: "attempts", title: "Attempts: outcomes and time", body }
}

fn failures(harvest: &Summary) -> Markup {
    let all = conditions(harvest);
    let total = |reason: &str| -> u32 { all.iter().filter_map(|(_, c)| c.failures.get(reason)).sum() };
    let names: BTreeSet<&String> = all.iter().flat_map(|(_, c)| c.failures.keys()).collect();
    let totals = names.into_iter().map(|name| (name.clone(), total(name))).collect();
    let mut heads = vec!["reason"];
    heads.extend(all.iter().map(|(name, _)| *name));
    let mut rows: Vec<Vec<Cell>> = ranked(&totals)
        .into_iter()
        .map(|(reason, _)| {
            let counts = all.iter().map(|(_, c)| c.failures.get(reason).copied().unwrap_or(0));
            std::iter::once(Cell::words(plain(reason)))
                .chain(counts.map(|n| Cell::number(n.to_string())))
                .collect()
        })
        .collect();
    let attempts = all.iter().map(|(_, c)| Cell::main(attempts_of(c).to_string()));
    rows.push(std::iter::once(Cell::words("all attempts, including placed")).chain(attempts).collect());
    html! { @if all.len() > 1 {
        details { summary { "Failed attempts by reason, all conditions" } (table("Failed attempts by reason", &heads, &rows)) }
    } }
}

fn contact_outcomes(harvest: &Summary) -> Markup {
    let all = conditions(harvest);
    let names: BTreeSet<&String> = all.iter().flat_map(|(_, c)| c.contact_outcomes.keys()).collect();
    let mut heads = vec!["outcome"];
    heads.extend(all.iter().map(|(name, _)| *name));
    let mut rows: Vec<Vec<Cell>> = names
        .into_iter()
        .map(|outcome| {
            let counts = all.iter().map(|(_, c)| c.contact_outcomes.get(outcome).copied().unwrap_or(0));
            std::iter::once(Cell::words(plain(outcome)))
                .chain(counts.map(|n| Cell::number(n.to_string())))
                .collect()
        })
        .collect();
    let sums = all.iter().map(|(_, c)| Cell::main(c.contact_outcomes.values().sum::<u32>().to_string()));
    rows.push(std::iter::once(Cell::words("all contact attempts")).chain(sums).collect());
    html! {
        p {
            "The world counts " strong { "contact attempts" } " beside those that the controller declares: one opens when a finger \
             begins to press on a fruit, and closes when the fruit is released or no finger has touched it for a while. Compare \
             different controllers by these."
        }
        (table("Contact attempts by outcome", &heads, &rows))
    }
}

/// The alarms that the controller told; nothing where it told none.
fn alarms(harvest: &Summary) -> Markup {
    let told: Vec<_> = conditions(harvest).into_iter().filter(|(_, c)| !c.alarms.is_empty()).collect();
    let names: BTreeSet<&String> = told.iter().flat_map(|(_, c)| c.alarms.keys()).collect();
    let mut heads = vec!["alarm"];
    heads.extend(told.iter().map(|(name, _)| *name));
    let row = |alarm: &String| -> Vec<Cell> {
        let counts = told.iter().map(|(_, c)| c.alarms.get(alarm).copied().unwrap_or(0));
        std::iter::once(Cell::words(plain(alarm)))
            .chain(counts.map(|n| Cell::number(n.to_string())))
            .collect()
    };
    let rows: Vec<Vec<Cell>> = names.into_iter().map(row).collect();
    html! { @if !rows.is_empty() {
        p { "Alarms are faults that the controller noticed and told, in its sensors, its hand or its arm." }
        (table("Alarms told by the controller", &heads, &rows))
    } }
}

fn times(harvest: &Summary) -> Markup {
    let Some((name, main)) = main_condition(harvest) else { return html! {} };
    let attempts = attempts_of(main);
    let placed = attempts.saturating_sub(main.failures.values().sum());
    let mut rows: Vec<Vec<Cell>> = states_of(&main.states)
        .into_iter()
        .map(|state| {
            let s = &main.states[state];
            vec![
                Cell::words(plain(state)),
                Cell::number(s.attempts.to_string()),
                Cell::number(number(s.mean_s, 2))
                    .because(s.mean_s.is_none().then_some("no attempt entered this state")),
                Cell::number(number(s.mean_placed_s, 2))
                    .because(s.mean_placed_s.is_none().then_some("no placed attempt entered this state")),
                Cell::main(number(Some(seconds_in(s, attempts, false)), 2)),
                Cell::main(number((placed > 0).then(|| seconds_in(s, placed, true)), 2)),
            ]
        })
        .collect();
    let gap = main.between_attempts_s;
    let reason = gap.is_none().then_some("no attempt was followed by another");
    let empty = || Cell::number("");
    rows.push(vec![
        Cell::words("until the next attempt"),
        empty(),
        empty(),
        empty(),
        Cell::main(number(gap, 2)).because(reason),
        empty(),
    ]);
    let heads = [
        "state",
        "attempts",
        "mean when entered [s]",
        "mean of placed [s]",
        "mean over all attempts [s]",
        "mean over all placed [s]",
    ];
    html! { details { summary { "Seconds in each state, " (name) } (table("Seconds in each state", &heads, &rows)) } }
}

/// Tree by tree.
pub(crate) fn trees(results: &Results, figures: &Figures, paper: &PaperFigures) -> Section {
    let body = html! {
        @match &results.harvest {
            None => (missing("No harvest in this folder.", COMMAND)),
            Some(harvest) => {
                (beside(&html! { p {
                    "Trees differ, so a single episode says little. The histograms count episodes by the number of fruit deposited \
                     and by completeness (paper: fruit " (paper.trees.mean.si()) " \u{b1} " (paper.trees.deviation.si()) " per tree)."
                } }, &figures.trees))
                (episodes(harvest))
            },
        }
    };
    Section { id: "trees", title: "Tree by tree", body }
}

fn episodes(harvest: &Summary) -> Markup {
    let Some((name, main)) = main_condition(harvest) else { return html! {} };
    let row = |e: &orchard_tasks::harvest::summary::EpisodeLine| {
        vec![
            Cell::words(format!("{} / {}", e.seed, e.world)).because(Some(e.file.as_str())),
            Cell::number(e.repeat.to_string()),
            Cell::number(e.fruit.to_string()),
            Cell::number(e.reachable.to_string()),
            Cell::number(e.attempts.to_string()),
            Cell::number(e.contact_attempts.to_string()),
            Cell::main(e.deposited.to_string()),
            Cell::number(e.dropped.to_string()),
            Cell::number(e.snapped.to_string()),
            Cell::number(number(Some(e.duration_s), 1)),
        ]
    };
    let rows: Vec<_> = main.episodes.iter().map(row).collect();
    let heads = [
        "seed / tree",
        "repeat",
        "fruit",
        "reachable",
        "declared attempts",
        "contact attempts",
        "deposited",
        "dropped",
        "snapped",
        "time [s]",
    ];
    html! { details { summary { "Every episode, " (name) } (table("Every episode", &heads, &rows)) } }
}

/// Damage against throughput.
pub(crate) fn damage(results: &Results, figures: &Figures) -> Section {
    let body = html! {
        @if results.harvest.is_none() || figures.damage.is_empty() {
            (missing("No harvest in this folder.", COMMAND))
        } @else {
            (beside(&html! { p { "Damage per tree against throughput; lower right is best. Faint dots are single episodes, stronger ones several coinciding episodes." } }, &figures.damage))
        }
    };
    Section { id: "damage", title: "Damage against throughput", body }
}
