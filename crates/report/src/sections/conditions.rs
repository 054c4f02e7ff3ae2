//! All conditions beside each other.

use maud::html;

use super::{Section, side_by_side};
use crate::figures::Figures;
use crate::results::{Results, conditions, has_singles};
use crate::table::{Cell, table};
use crate::words::{digits, interval, number, title_with_unit, why};

/// Columns of the table.
const COLUMNS: [&str; 9] = [
    "place_success_per_contact_attempt",
    "harvest_completeness",
    "throughput_fruit_per_min",
    "branches_snapped_per_tree",
    "fruit_dropped_per_tree",
    "fruit_stem_pulled_per_tree",
    "detach_tension_p95_n",
    "detach_tension_max_n",
    "bruise_free_share",
];

/// The section; `None` where every condition is of a sweep or in full.
pub(crate) fn section(results: &Results, figures: &Figures) -> Option<Section> {
    let harvest = results.harvest.as_ref().filter(|harvest| has_singles(harvest))?;
    let row = |(name, of): (&str, &orchard_tasks::harvest::summary::ConditionSummary)| {
        let cell = |metric: &&str| match of.metrics.get(*metric) {
            Some(found) => {
                let digits = digits(metric).min(2);
                let ends = interval(found.ci95, digits);
                Cell::number(number(found.mean, digits)).because(why(found).or(Some(ends)))
            }
            None => Cell::number("-"),
        };
        let trees = Cell::number(of.episodes.len().to_string());
        [Cell::words(name)].into_iter().chain(COLUMNS.iter().map(cell)).chain([trees]).collect()
    };
    let rows: Vec<Vec<Cell>> = conditions(harvest).into_iter().map(row).collect();
    let titles: Vec<String> = COLUMNS.iter().map(|metric| title_with_unit(metric)).collect();
    let mut heads = vec!["condition"];
    heads.extend(titles.iter().map(String::as_str));
    heads.push("episodes");
    let body = html! {
        p { "Every condition of the run, those of sweeps too. Bars have 95 % intervals; those of the table show under the pointer." }
        (side_by_side(&figures.conditions))
        (table("All conditions: means", &heads, &rows))
    };
    Some(Section { id: "conditions", title: "Conditions", body })
}
