//! Precision and recall against foliage density.

use anyhow::anyhow;
use orchard_bench::detect::{DetectRules, DetectSummary};
use orchard_bench::metrics::Metric;
use plotters::prelude::*;

/// Size of the figure [px].
const SIZE: (u32, u32) = (720, 460);
/// Half width of the ends of an interval, in densities.
const CAP: f64 = 0.012;

/// A line of the figure.
struct Line<'a> {
    name: &'a str,
    title: String,
    color: RGBColor,
    /// Shift along the axis, so that intervals do not hide one another.
    shift: f64,
}

/// The figure as SVG.
pub fn svg(summary: &DetectSummary, rules: &DetectRules) -> anyhow::Result<String> {
    let mut svg = String::new();
    draw(&mut svg, summary, rules).map_err(|e| anyhow!("{e}"))?;
    Ok(svg)
}

fn draw(
    svg: &mut String,
    summary: &DetectSummary,
    rules: &DetectRules,
) -> Result<(), Box<dyn std::error::Error>> {
    let found = &rules.found;
    let lines = [
        Line { name: "precision", title: "precision".into(), color: RGBColor(40, 70, 150), shift: -0.01 },
        Line {
            name: "recall",
            title: format!(
                "recall, fruit at least {:.0} % visible, {} px, in range",
                100.0 * found.visible_fraction.si(),
                found.pixels.get()
            ),
            color: RGBColor(170, 60, 40),
            shift: 0.0,
        },
        Line {
            name: "recall_visible",
            title: "recall, all fruit that shows a pixel".into(),
            color: RGBColor(140, 120, 90),
            shift: 0.01,
        },
    ];
    let last = summary.densities.last().map_or(1.0, |density| density.foliage).max(0.1);
    let root = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    let caption = format!("Single images, camera {}, detector {}", summary.camera.name(), summary.detector);
    let mut chart = ChartBuilder::on(&root)
        .caption(caption, ("sans-serif", 20))
        .margin(12)
        .x_label_area_size(40)
        .y_label_area_size(50)
        .build_cartesian_2d(-0.05..last + 0.05, 0.0..1.05)?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .x_desc("foliage density")
        .y_desc("precision, recall")
        .y_labels(11)
        .draw()?;
    for Line { name, title, color, shift } in lines {
        let at: Vec<(f64, &Metric)> = summary
            .densities
            .iter()
            .filter_map(|density| Some((density.foliage + shift, density.results.metrics.get(name)?)))
            .collect();
        let points: Vec<(f64, f64)> = at.iter().filter_map(|(x, metric)| Some((*x, metric.mean?))).collect();
        chart
            .draw_series(LineSeries::new(points.clone(), color.stroke_width(2)))?
            .label(title)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], color.stroke_width(2)));
        chart.draw_series(points.iter().map(|&point| Circle::new(point, 3, color.filled())))?;
        for (x, metric) in at {
            let [Some(low), Some(high)] = metric.ci95 else { continue };
            let strokes =
                [[(x, low), (x, high)], [(x - CAP, low), (x + CAP, low)], [(x - CAP, high), (x + CAP, high)]];
            chart.draw_series(strokes.map(|stroke| PathElement::new(stroke, color.stroke_width(1))))?;
        }
    }
    let paper: Vec<(f64, f64)> =
        rules.published.get("precision").into_iter().flatten().map(|at| (at.foliage, at.value)).collect();
    chart
        .draw_series(paper.iter().map(|&point| Cross::new(point, 5, BLACK.stroke_width(2))))?
        .label("precision, published")
        .legend(|(x, y)| Cross::new((x + 9, y), 5, BLACK.stroke_width(2)));
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::LowerLeft)
        .background_style(WHITE.mix(0.8))
        .border_style(BLACK.mix(0.3))
        .draw()?;
    root.present()?;
    Ok(())
}
