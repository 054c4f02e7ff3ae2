//! The detection task: precision and recall over foliage, errors, precision-recall curves, and calibration.

use orchard_tasks::detect::{DensitySummary, DetectRules, DetectSummary};

use crate::axis::Axis;
use crate::chart::{Chart, Line, Mark, Point, Series};
use crate::figure::{Figure, FigureError, colour};
use crate::results::ends;
use crate::words::{interval, number};

/// Precision and recall over foliage density, beside the published values.
pub fn detection(summary: &DetectSummary, rules: &DetectRules) -> Result<Figure, FigureError> {
    let found = &rules.found;
    let lines = [
        ("precision", "precision".to_owned(), colour::BLUE, -3),
        (
            "recall",
            format!("recall, at least {:.0} % visible", 100.0 * found.visible_fraction.si()),
            colour::VERMILION,
            0,
        ),
        ("recall_visible", "recall, any pixel visible".to_owned(), colour::GREEN, 3),
    ];
    let mut series = Vec::new();
    let mut description = vec![format!(
        "Precision and recall over foliage density in single images, camera {}, detector {}",
        summary.camera.name(),
        summary.detector
    )];
    for at in rules.published.get("precision").into_iter().take(1) {
        series.push(Series {
            name: "precision, published".to_owned(),
            colour: colour::BLUE,
            mark: Mark::Hollow,
            line: Line::Dashed,
            points: at.iter().map(|at| Point { x: at.foliage, y: at.value, ci95: None }).collect(),
            shift: -3,
        });
    }
    for (metric, name, colour, shift) in lines {
        let at = |density: &DensitySummary| {
            let m = density.results.metrics.get(metric)?;
            Some(Point { x: density.foliage, y: m.mean?, ci95: ends(m.ci95) })
        };
        let points: Vec<Point> = summary.densities.iter().filter_map(at).collect();
        let texts: Vec<String> = points
            .iter()
            .map(|p| {
                let ci95 = p.ci95.map_or([None; 2], |ends| ends.map(Some));
                format!("at {} {} ({})", p.x, number(Some(p.y), 3), interval(ci95, 3))
            })
            .collect();
        description.push(format!("{name}: {}", texts.join("; ")));
        series.push(Series { name, colour, mark: Mark::Disc, line: Line::Solid, points, shift });
    }
    let places: Vec<f64> = summary.densities.iter().map(|density| density.foliage).collect();
    let chart = Chart {
        stem: "detect-foliage".to_owned(),
        title: "Precision and recall in single images".to_owned(),
        x: Axis::at("foliage density", &places),
        y: Axis::from_zero("", [1.0].into_iter(), 5),
        series,
        bands: Vec::new(),
    };
    chart.figure(&(description.join(". ") + "."))
}

/// Draws the centre errors of detections over foliage density.
pub(crate) fn errors(summary: &DetectSummary) -> Result<Figure, FigureError> {
    let lines = [
        ("centre_error_p95_m", "centre, 95th percentile", colour::VERMILION, 3),
        ("centre_error_median_m", "centre, median", colour::BLUE, -3),
        ("radius_error_median_m", "radius, median", colour::GREEN, 0),
    ];
    let mut description = vec!["Errors of true detections in millimetres over foliage density".to_owned()];
    let line = |(error, name, colour, shift): (&str, &str, _, _)| {
        let at = |density: &DensitySummary| {
            let e = density.results.errors.get(error)?;
            Some(Point {
                x: density.foliage,
                y: 1e3 * e.value?,
                ci95: ends(e.ci95.map(|x| x.map(|x| 1e3 * x))),
            })
        };
        let points: Vec<Point> = summary.densities.iter().filter_map(at).collect();
        let texts: Vec<String> = points.iter().map(|p| format!("at {} {:.2}", p.x, p.y)).collect();
        description.push(format!("{name}: {}", texts.join("; ")));
        Series { name: name.to_owned(), colour, mark: Mark::Disc, line: Line::Solid, points, shift }
    };
    let series: Vec<Series> = lines.into_iter().map(line).collect();
    let places: Vec<f64> = summary.densities.iter().map(|density| density.foliage).collect();
    let all = series.iter().flat_map(|s| &s.points).flat_map(|p| [p.y, p.ci95.map_or(p.y, |[_, high]| high)]);
    let y = Axis::from_zero("", all, 5);
    let chart = Chart {
        stem: "detect-errors".to_owned(),
        title: "Errors of true detections [mm]".to_owned(),
        x: Axis::at("foliage density", &places),
        y,
        series,
        bands: Vec::new(),
    };
    chart.figure(&(description.join(". ") + "."))
}

/// Colours of the foliage densities.
const DENSITIES: [plotters::style::RGBColor; 6] =
    [colour::BLUE, colour::VERMILION, colour::GREEN, colour::PURPLE, colour::ORANGE, colour::SKY];

/// Draws a line for each foliage density from 0 to 1 on both axes.
fn lines(summary: &DetectSummary, points: impl Fn(&DensitySummary) -> Vec<Point>, mark: Mark) -> Vec<Series> {
    let line = |(density, colour): (&DensitySummary, &plotters::style::RGBColor)| Series {
        name: format!("foliage {}", density.foliage),
        colour: *colour,
        mark,
        line: Line::Solid,
        points: points(density),
        shift: 0,
    };
    summary.densities.iter().zip(DENSITIES.iter().cycle()).map(line).collect()
}

/// Draws precision over recall within the widest distance, a curve for each foliage density.
pub fn precision_recall(summary: &DetectSummary) -> Result<Figure, FigureError> {
    let mut description = vec![format!(
        "Precision over recall as the least score falls, camera {}, detector {}",
        summary.camera.name(),
        summary.detector
    )];
    for DensitySummary { foliage, ranking, .. } in &summary.densities {
        if let Some((radii, ap)) = ranking.ap.last_key_value() {
            let (value, ci95) = (number(ap.value, 3), interval(ap.ci95, 3));
            description
                .push(format!("foliage {foliage}: average precision {value} ({ci95}) within {radii} radius"));
        }
    }
    let curve = |density: &DensitySummary| {
        let curve = density.ranking.curves.last_key_value().map_or(&[][..], |(_, curve)| curve);
        curve.iter().map(|p| Point { x: p.recall, y: p.precision, ci95: None }).collect()
    };
    let chart = Chart {
        stem: "detect-precision-recall".to_owned(),
        title: "Precision over recall".to_owned(),
        x: Axis::from_zero("recall", [1.0].into_iter(), 5),
        y: Axis::from_zero("", [1.0].into_iter(), 5),
        series: lines(summary, curve, Mark::None),
        bands: Vec::new(),
    };
    chart.figure(&(description.join(". ") + "."))
}

/// Draws the share of detections that is right over their score, for each foliage density.
pub(crate) fn calibration(summary: &DetectSummary) -> Result<Figure, FigureError> {
    let mut description = vec!["Share of detections that is right over their mean score".to_owned()];
    for DensitySummary { foliage, ranking, .. } in &summary.densities {
        let error = number(ranking.calibration.expected_error, 3);
        description.push(format!("foliage {foliage}: expected calibration error {error}"));
    }
    let ends = [0.0, 1.0].map(|x| Point { x, y: x, ci95: None });
    let mut series = vec![Series {
        name: "as scored".to_owned(),
        colour: colour::AXIS,
        mark: Mark::None,
        line: Line::Dashed,
        points: ends.into(),
        shift: 0,
    }];
    let bins = |density: &DensitySummary| {
        let point = |bin: &orchard_statistics::ranking::ReliabilityBin| {
            Some(Point { x: bin.mean_score?, y: bin.right?, ci95: None })
        };
        density.ranking.calibration.bins.iter().filter_map(point).collect()
    };
    series.extend(lines(summary, bins, Mark::Disc));
    let chart = Chart {
        stem: "detect-calibration".to_owned(),
        title: "Share of detections that is right".to_owned(),
        x: Axis::from_zero("mean score", [1.0].into_iter(), 5),
        y: Axis::from_zero("", [1.0].into_iter(), 5),
        series,
        bands: Vec::new(),
    };
    chart.figure(&(description.join(". ") + "."))
}
