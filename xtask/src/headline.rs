//! The headline metrics beside the paper's, as a table for people.

use orchard_bench::metrics::{METRICS, Metric};
use orchard_bench::protocol::Protocol;
use orchard_bench::summary::ConditionSummary;

use crate::columns::columns;

/// The metrics of a condition in the order of their definition, with the paper's nominal figures.
pub fn table(condition: &ConditionSummary, protocol: &Protocol) -> String {
    let head = ["metric", "mean", "95 % interval", "n", "paper", "unit"].map(str::to_owned);
    let mut rows = vec![head];
    for definition in METRICS {
        let Some(metric) = condition.metrics.get(definition.name) else { continue };
        let paper = protocol.published.get(definition.name);
        rows.push([
            definition.name.to_owned(),
            number(metric.mean),
            interval(metric),
            metric.n.to_string(),
            number(paper.map(|p| p.value)),
            definition.unit.to_owned(),
        ]);
    }
    columns(&rows, &[0, 5])
}

/// Two digits after the point, or that there is none.
pub fn number(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), |x| format!("{x:.2}"))
}

/// Metrics by name, in an order, with their units and three digits after the point: loads are often small.
pub fn fine_table<'a>(
    order: impl Iterator<Item = (&'a str, &'a str)>,
    metrics: &std::collections::BTreeMap<String, Metric>,
) -> String {
    let mut rows = vec![["metric", "mean", "95 % interval", "n", "unit"].map(str::to_owned)];
    for (name, unit) in order {
        let Some(metric) = metrics.get(name) else { continue };
        let cells = [
            metric.mean.map(|x| format!("{x:.3}")),
            match metric.ci95 {
                [Some(low), Some(high)] => Some(format!("{low:.3} .. {high:.3}")),
                _ => None,
            },
        ];
        let [mean, ci95] = cells.map(|cell| cell.unwrap_or_else(|| "-".to_owned()));
        rows.push([name.to_owned(), mean, ci95, metric.n.to_string(), unit.to_owned()]);
    }
    columns(&rows, &[0, 4])
}

/// An interval.
pub fn interval(metric: &Metric) -> String {
    match metric.ci95 {
        [Some(low), Some(high)] => format!("{low:.2} .. {high:.2}"),
        _ => "-".to_owned(),
    }
}
