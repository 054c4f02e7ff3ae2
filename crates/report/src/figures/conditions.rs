//! Figures over all conditions: one metric, a bar a condition.

use orchard_tasks::harvest::summary::Summary;

use crate::bars::{Bar, bars};
use crate::figure::{Figure, FigureError, colour};
use crate::results::{conditions, ends};
use crate::words::{digits, interval, number, title, title_with_unit};

/// Drawn metrics.
const DRAWN: [&str; 4] = [
    "place_success_per_contact_attempt",
    "harvest_completeness",
    "branches_snapped_per_tree",
    "fruit_dropped_per_tree",
];

/// A figure of each metric.
pub(crate) fn figures(harvest: &Summary) -> Result<Vec<Figure>, FigureError> {
    DRAWN.iter().map(|metric| figure(harvest, metric)).collect()
}

fn figure(harvest: &Summary, metric: &str) -> Result<Figure, FigureError> {
    let digits = digits(metric).min(2);
    let bar = |(name, results): (&str, &orchard_tasks::harvest::summary::ConditionSummary)| {
        let found = results.metrics.get(metric);
        let mean = found.and_then(|found| found.mean);
        Bar {
            name: name.to_owned(),
            parts: vec![(mean.unwrap_or(0.0), colour::SERIES[0])],
            ci95: found.and_then(|found| ends(found.ci95)),
            label: number(mean, digits),
        }
    };
    let all = conditions(harvest);
    let list: Vec<Bar> = all.iter().copied().map(bar).collect();
    let texts: Vec<String> = all
        .iter()
        .zip(&list)
        .map(|((name, results), bar)| {
            let ci95 = results.metrics.get(metric).map_or([None; 2], |found| found.ci95);
            format!("{name} {} ({})", bar.label, interval(ci95, digits))
        })
        .collect();
    let description = format!("{} by condition: {}.", title(metric), texts.join("; "));
    bars(
        &format!("conditions-{}", metric.replace('_', "-")),
        &title_with_unit(metric),
        &description,
        &list,
        &[],
    )
}
