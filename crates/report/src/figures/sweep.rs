//! Figures of a sweep of one dial: every headline metric over it, with intervals, and the paper's values.

use orchard_statistics::Metric;
use orchard_tasks::harvest::matrix::SweepPoint;
use orchard_tasks::harvest::summary::{Summary, Sweep};

use crate::axis::Axis;
use crate::chart::{Chart, Line, Mark, Point, Series};
use crate::figure::{Figure, FigureError, colour};
use crate::published::PaperFigures;
use crate::results::{ends, metric_of};
use crate::words::{digits, interval, number, plain, title, title_with_unit};

/// Drawn metrics, grouped by panel.
const PANELS: [&[&str]; 6] = [
    &["harvest_completeness"],
    &["place_success_per_attempt"],
    &["throughput_fruit_per_min"],
    &["branches_snapped_per_tree"],
    &["fruit_dropped_per_tree"],
    &["detection_precision", "detection_recall_visible"],
];

/// All panels of a sweep.
pub(crate) fn figures(
    harvest: &Summary,
    name: &str,
    sweep: &Sweep,
    paper: &PaperFigures,
) -> Result<Vec<Figure>, FigureError> {
    PANELS.iter().map(|metrics| panel(harvest, name, sweep, metrics, paper)).collect()
}

/// The dial with its unit.
pub(crate) fn dial(sweep: &Sweep) -> String {
    let dial = match &*sweep.dial {
        "foliage" => "foliage density".to_owned(),
        "fruit" => "fruit requested per tree".to_owned(),
        "terrain" => "terrain amplitude".to_owned(),
        other => plain(other),
    };
    match &*sweep.unit {
        "" | "1" | "fruit" => dial,
        unit => format!("{dial} [{unit}]"),
    }
}

fn panel(
    harvest: &Summary,
    name: &str,
    sweep: &Sweep,
    metrics: &[&str],
    paper: &PaperFigures,
) -> Result<Figure, FigureError> {
    let several = metrics.len() > 1;
    let mut series = Vec::new();
    let mut description = Vec::new();
    for (i, metric) in metrics.iter().enumerate() {
        let colour = colour::SERIES[i];
        let published = paper.of_sweep(name, metric);
        if !published.is_empty() {
            series.push(Series {
                name: if several { format!("paper, {}", short(metric)) } else { "paper".to_owned() },
                colour: if several { colour } else { colour::SOFT },
                mark: Mark::Hollow,
                line: Line::Dashed,
                points: published.iter().map(|at| Point { x: at.at, y: at.value, ci95: None }).collect(),
                shift: 0,
            });
        }
        let measured = |point: &SweepPoint| {
            let found = metric_of(harvest, &point.condition, metric)?;
            Some((point.value, found))
        };
        let measured: Vec<(f64, &Metric)> = sweep.points.iter().filter_map(measured).collect();
        series.push(Series {
            name: if several { short(metric) } else { "this run, 95 % interval".to_owned() },
            colour,
            mark: Mark::Disc,
            line: Line::Solid,
            points: measured
                .iter()
                .filter_map(|(x, m)| Some(Point { x: *x, y: m.mean?, ci95: ends(m.ci95) }))
                .collect(),
            shift: if several { 4 * i as i32 - 2 } else { 0 },
        });
        let digits = digits(metric);
        let texts: Vec<String> = measured
            .iter()
            .map(|(x, m)| format!("at {x} {} ({})", number(m.mean, digits), interval(m.ci95, digits)))
            .collect();
        description.push(format!("{} over {}: {}", title(metric), dial(sweep), texts.join("; ")));
    }
    let places: Vec<f64> = sweep.points.iter().map(|point| point.value).collect();
    let all = series.iter().flat_map(|s| &s.points).flat_map(|p| [p.y, p.ci95.map_or(p.y, |[_, high]| high)]);
    let y = Axis::from_zero("", all, 5);
    let chart = Chart {
        stem: format!("sweep-{name}-{}", if several { "detection" } else { metrics[0] }.replace('_', "-")),
        title: if several { "Detection while picking".to_owned() } else { title_with_unit(metrics[0]) },
        x: Axis::at(dial(sweep), &places),
        y,
        series,
        bands: Vec::new(),
    };
    chart.figure(&(description.join(". ") + "."))
}

/// Title of a metric without the word "Detection".
fn short(metric: &str) -> String {
    title(metric).replace("Detection ", "")
}
