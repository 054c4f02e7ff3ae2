//! Histograms of generated populations of trees, with measured values drawn over them.

use orchard_treegen::GrowthUnit;
use orchard_treegen::calibration::{Measured, Moments, Population, Sample, Target};
use orchard_treegen::morphometry::allometry::{area_ratios, pipe_exponents};
use orchard_treegen::morphometry::distribution::{normal_cdf, quantile_cdf};
use orchard_treegen::morphometry::shoots::{angle_from_vertical, branches_on_leader, divergences};
use plotters::prelude::*;

use crate::figure::{Area, Drawn, Figure, FigureError, drawn};

/// Size of a picture \[px\].
const SIZE: (u32, u32) = (720, 420);
/// Bars of a histogram.
const BARS: usize = 36;
const GROWN: RGBColor = RGBColor(122, 160, 92);
const SAMPLE: RGBColor = RGBColor(170, 60, 40);
const NORMAL: RGBColor = RGBColor(40, 70, 150);
const WANTED: RGBColor = RGBColor(230, 200, 120);

/// One histogram.
struct Histogram<'a> {
    name: &'a str,
    title: String,
    axis: &'a str,
    /// Range of the bars.
    span: (f64, f64),
    values: Vec<f64>,
    sample: Option<&'a Sample>,
    normal: Option<&'a Moments>,
    target: Option<&'a Target>,
}

/// Draws the histograms of three generated populations beside what was measured.
///
/// # Errors
/// A figure cannot be drawn.
pub fn populations(
    measured: &Measured,
    young: &Population,
    mature: &Population,
    dwarf: &Population,
) -> Result<Vec<Figure>, FigureError> {
    let degrees = |values: Vec<f64>| values.into_iter().map(f64::to_degrees).collect::<Vec<f64>>();
    let units: Vec<GrowthUnit> = young.trees.iter().flat_map(|tree| tree.units.iter().copied()).collect();
    let on_leaders: Vec<f64> = young
        .trees
        .iter()
        .flat_map(|tree| branches_on_leader(&tree.units).map(angle_from_vertical))
        .collect();
    let forks: Vec<f64> = mature.surveys().iter().flat_map(|s| pipe_exponents(&s.branches)).collect();
    let areas: Vec<f64> = mature.surveys().iter().flat_map(|s| area_ratios(&s.branches)).collect();
    let turns: Vec<f64> = young.trees.iter().flat_map(|tree| divergences(&tree.units)).collect();
    let plain = |name, title: &str, axis, span, values| Histogram {
        name,
        title: title.to_owned(),
        axis,
        span,
        values,
        sample: None,
        normal: None,
        target: None,
    };
    let (y, m, d) = (&measured.young, &measured.mature, &measured.dwarf.targets);
    let all = [
        Histogram {
            sample: Some(&y.angle_sample),
            normal: Some(&y.angle),
            ..plain(
                "young-angle",
                "Young: branches on the leader",
                "angle from the vertical [deg]",
                (0.0, 180.0),
                degrees(on_leaders),
            )
        },
        Histogram {
            sample: Some(&m.angle_sample),
            normal: Some(&m.angle),
            ..plain(
                "mature-angle",
                "Mature: limbs",
                "angle from the vertical [deg]",
                (0.0, 180.0),
                degrees(mature.limb_angles()),
            )
        },
        Histogram {
            target: Some(&y.targets.divergence_mode),
            ..plain(
                "young-divergence",
                "Young: successive branches",
                "divergence, folded [deg]",
                (0.0, 180.0),
                degrees(turns),
            )
        },
        plain(
            "young-shoots",
            "Young: growth units",
            "length [cm]",
            (0.0, 60.0),
            units.iter().map(|u| 1e2 * u.length).collect(),
        ),
        Histogram {
            target: Some(&y.targets.growth_units_mean),
            ..plain(
                "young-growth-units",
                "Young: growth units a tree",
                "growth units",
                (0.0, 1200.0),
                young.each(|t| t.units.len() as f64),
            )
        },
        Histogram {
            target: Some(&m.targets.scaffolds_mean),
            ..plain(
                "mature-scaffolds",
                "Mature: limbs a tree",
                "limbs",
                (0.0, 18.0),
                mature.each_survey(|s| s.limbs().count() as f64),
            )
        },
        Histogram {
            target: Some(&m.targets.pipe_exponent),
            ..plain("mature-pipe-exponent", "Mature: pipe exponent at forks", "exponent", (0.0, 3.6), forks)
        },
        Histogram {
            target: Some(&m.targets.area_ratio),
            ..plain(
                "mature-area-ratio",
                "Mature: area above over area below a fork",
                "area ratio",
                (0.0, 1.8),
                areas,
            )
        },
        Histogram {
            target: Some(&d.branch_length),
            ..plain(
                "dwarf-branch-length",
                "Dwarf: wood between forks",
                "length [m]",
                (0.0, 14.4),
                dwarf.each_survey(|s| s.length()),
            )
        },
        Histogram {
            target: Some(&d.stem_mass),
            ..plain(
                "dwarf-stem-mass",
                "Dwarf: dry mass of the wood between forks",
                "mass [kg]",
                (0.0, 5.4),
                dwarf.each_survey(|s| measured.survey.dry_density.si() * s.volume()),
            )
        },
    ];
    all.iter().map(figure).collect()
}

/// Draws one histogram: bars show the generated trees, lines the measurements, the band the target interval of mean, median or mode.
fn figure(histogram: &Histogram) -> Result<Figure, FigureError> {
    let (n, (low, high)) = (histogram.values.len(), histogram.span);
    let mean = histogram.values.iter().sum::<f64>() / n.max(1) as f64;
    let description = format!("{n} values of {}, mean {mean:.3}; bars from {low} to {high}", histogram.axis);
    drawn(histogram.name, &histogram.title, &description, SIZE, |area| draw(area, histogram))
}

fn draw(root: &Area, histogram: &Histogram) -> Drawn {
    let (low, high) = histogram.span;
    let width = (high - low) / BARS as f64;
    let edge = |k: usize| low + width * k as f64;
    let n = histogram.values.len() as f64;
    let mut bars = [0.0_f64; BARS];
    for value in histogram.values.iter().filter(|v| (low..high).contains(*v)) {
        bars[(((value - low) / width) as usize).min(BARS - 1)] += 1.0 / n;
    }
    let measured: Vec<(RGBColor, String, Vec<f64>)> = [
        histogram.sample.map(|s| {
            let parts =
                |k: usize| quantile_cdf(&s.quantiles, edge(k + 1)) - quantile_cdf(&s.quantiles, edge(k));
            (SAMPLE, format!("measured, {} branches", s.n), (0..BARS).map(parts).collect())
        }),
        histogram.normal.map(|m| {
            let parts = |k: usize| normal_cdf(edge(k + 1), m.mean, m.sd) - normal_cdf(edge(k), m.mean, m.sd);
            (NORMAL, format!("published {} +- {}", m.mean, m.sd), (0..BARS).map(parts).collect())
        }),
    ]
    .into_iter()
    .flatten()
    .collect();
    let lines = measured.iter().flat_map(|(_, _, parts)| parts.iter());
    let top = 1.1 * bars.iter().chain(lines).copied().fold(0.0, f64::max);

    let mut chart = ChartBuilder::on(root)
        .caption(&histogram.title, ("sans-serif", 20))
        .margin(12)
        .x_label_area_size(40)
        .y_label_area_size(60)
        .build_cartesian_2d(low..high, 0.0..top)?;
    chart.configure_mesh().disable_mesh().x_desc(histogram.axis).y_desc("part").draw()?;
    if let Some(target) = histogram.target {
        let band = Rectangle::new([(target.low, 0.0), (target.high, top)], WANTED.mix(0.5).filled());
        chart
            .draw_series(std::iter::once(band))?
            .label(format!("target: {} to {}", target.low, target.high))
            .legend(|(x, y)| Rectangle::new([(x, y - 5), (x + 18, y + 5)], WANTED.filled()));
    }
    let bar =
        |(k, part): (usize, &f64)| Rectangle::new([(edge(k), 0.0), (edge(k + 1), *part)], GROWN.filled());
    chart
        .draw_series(bars.iter().enumerate().map(bar))?
        .label(format!("grown, {}", histogram.values.len()))
        .legend(|(x, y)| Rectangle::new([(x, y - 5), (x + 18, y + 5)], GROWN.filled()));
    for (color, label, parts) in measured {
        // A step over every bar.
        let steps = parts.iter().enumerate().flat_map(|(k, part)| [(edge(k), *part), (edge(k + 1), *part)]);
        chart
            .draw_series(LineSeries::new(steps, color.stroke_width(2)))?
            .label(label)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], color.stroke_width(2)));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperLeft)
        .background_style(WHITE.mix(0.8))
        .border_style(BLACK.mix(0.3))
        .draw()?;
    Ok(())
}
