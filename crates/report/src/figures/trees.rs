//! Figures by tree: fruit deposited, completeness and damage.

use orchard_tasks::harvest::summary::{ConditionSummary, EpisodeLine, Summary};
use plotters::element::{PathElement, Rectangle, Text};
use plotters::style::text_anchor::{HPos, VPos};
use plotters::style::{Color, ShapeStyle};

use crate::axis::Axis;
use crate::chart::{Chart, Line, Mark, Point, Series};
use crate::figure::{Figure, FigureError, LETTERS, WIDTH, colour, drawn, heading, letters};
use crate::results::{conditions, ends, main_condition, metric_of};
use crate::words::{number, title_with_unit};

/// Histogram of fruit deposited per episode.
pub(crate) fn deposited(condition: &str, results: &ConditionSummary) -> Result<Figure, FigureError> {
    let counts: Vec<u32> = results.episodes.iter().map(|episode| episode.deposited).collect();
    let most = counts.iter().copied().max().unwrap_or(0);
    // Largest number of bins; the bins get wider for larger numbers of fruit.
    let width = (most + 1).div_ceil(14).max(1);
    let bin = |bin: u32| {
        let (first, next) = (bin * width, (bin + 1) * width);
        let name = if width == 1 { first.to_string() } else { format!("{first}-{}", next - 1) };
        (name, counts.iter().filter(|&&n| n / width == bin).count())
    };
    let values: Vec<f64> = counts.iter().map(|&n| f64::from(n)).collect();
    Histogram {
        stem: "trees-deposited",
        title: "Fruit deposited",
        label: "fruit in the bucket at the end",
        spread: spread(&values),
        bins: (0..=most / width).map(bin).collect(),
    }
    .figure(condition)
}

/// Histogram of completeness per episode; none if no tree has reachable fruit.
pub(crate) fn completeness(
    condition: &str,
    results: &ConditionSummary,
) -> Result<Option<Figure>, FigureError> {
    let values: Vec<f64> = results.episodes.iter().filter_map(|episode| episode.completeness).collect();
    if values.is_empty() {
        return Ok(None);
    }
    // Bins are tenths; a completeness of 1 belongs to the last.
    let tenth = |value: f64| ((10.0 * value + 1e-9).floor().max(0.0) as u32).min(9);
    let last = values.iter().map(|&value| tenth(value)).max().unwrap_or(0).max(4);
    let bin =
        |i: u32| (format!("{:.1}", f64::from(i) / 10.0), values.iter().filter(|&&v| tenth(v) == i).count());
    Histogram {
        stem: "trees-completeness",
        title: "Harvest completeness",
        label: "completeness (lower end of a bin of 0.1)",
        spread: spread(&values),
        bins: (0..=last).map(bin).collect(),
    }
    .figure(condition)
    .map(Some)
}

/// Mean and standard deviation in words.
fn spread(values: &[f64]) -> String {
    let n = values.len() as f64;
    let mean = (!values.is_empty()).then(|| values.iter().sum::<f64>() / n);
    let squares = |mean: f64| values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>();
    let deviation = mean.filter(|_| values.len() > 1).map(|mean| (squares(mean) / (n - 1.0)).sqrt());
    format!(
        "{} episodes, mean {}, standard deviation {}",
        values.len(),
        number(mean, 2),
        number(deviation, 2)
    )
}

/// Histogram of a quantity over the episodes.
struct Histogram {
    stem: &'static str,
    title: &'static str,
    /// Quantity that is binned.
    label: &'static str,
    /// Mean and spread in words.
    spread: String,
    /// Names and counts.
    bins: Vec<(String, usize)>,
}

impl Histogram {
    fn figure(&self, condition: &str) -> Result<Figure, FigureError> {
        const MARGIN: i32 = 10;
        const TOP: i32 = 52;
        const HEIGHT: i32 = 160;
        let bins = &self.bins;
        let highest = bins.iter().map(|(_, count)| *count).max().unwrap_or(1).max(1) as f64;
        let texts: Vec<String> = bins.iter().map(|(name, count)| format!("{name}: {count}")).collect();
        let description = format!(
            "{} under {condition}: {}. Episodes by {}: {}.",
            self.title,
            self.spread,
            self.label,
            texts.join("; ")
        );
        let size = (WIDTH, (TOP + HEIGHT + 46) as u32);
        drawn(self.stem, self.title, &description, size, |area| {
            area.draw(&Text::new(
                format!("{}, number of episodes", self.title),
                (MARGIN, MARGIN),
                heading(),
            ))?;
            let small = |h, v| letters(LETTERS - 1.0, colour::SOFT, h, v);
            area.draw(&Text::new(self.spread.clone(), (MARGIN, MARGIN + 21), small(HPos::Left, VPos::Top)))?;
            let step = f64::from(WIDTH as i32 - 2 * MARGIN) / bins.len().max(1) as f64;
            let left_of = |bin: usize| MARGIN + (bin as f64 * step).round() as i32;
            let base = TOP + HEIGHT;
            for (bin, (name, count)) in bins.iter().enumerate() {
                let top = base - (*count as f64 / highest * f64::from(HEIGHT - 20)).round() as i32;
                let (left, right) = (left_of(bin) + 3, left_of(bin + 1) - 3);
                area.draw(&Rectangle::new([(left, top), (right, base)], colour::BLUE.filled()))?;
                let middle = (left + right) / 2;
                if *count > 0 {
                    let above = small(HPos::Center, VPos::Bottom);
                    area.draw(&Text::new(count.to_string(), (middle, top - 4), above))?;
                }
                area.draw(&Text::new(name.clone(), (middle, base + 6), small(HPos::Center, VPos::Top)))?;
            }
            let axis = ShapeStyle::from(colour::AXIS).stroke_width(1);
            area.draw(&PathElement::new([(MARGIN, base), (WIDTH as i32 - MARGIN, base)], axis))?;
            let label = letters(LETTERS, colour::INK, HPos::Center, VPos::Top);
            area.draw(&Text::new(self.label, (WIDTH as i32 / 2, base + 25), label))?;
            Ok(())
        })
    }
}

/// Damage against throughput: a point for each episode of the main condition, and the mean of every condition.
pub(crate) fn damage(harvest: &Summary, damage: &'static str) -> Result<Option<Figure>, FigureError> {
    const THROUGHPUT: &str = "throughput_fruit_per_min";
    let Some((main, results)) = main_condition(harvest) else { return Ok(None) };
    let per_minute = |e: &EpisodeLine| {
        if e.duration_s > 0.0 { 60.0 * f64::from(e.deposited) / e.duration_s } else { 0.0 }
    };
    let snapped = damage == "branches_snapped_per_tree";
    let harm = |e: &EpisodeLine| f64::from(if snapped { e.snapped } else { e.dropped });
    let episodes: Vec<Point> =
        results.episodes.iter().map(|e| Point { x: per_minute(e), y: harm(e), ci95: None }).collect();
    let mean = |name: &str| {
        let (x, y) = (metric_of(harvest, name, THROUGHPUT)?, metric_of(harvest, name, damage)?);
        Some(Point { x: x.mean?, y: y.mean?, ci95: ends(y.ci95) })
    };
    let others: Vec<Point> = conditions(harvest)
        .iter()
        .filter(|(name, _)| *name != main)
        .filter_map(|(name, _)| mean(name))
        .collect();
    let published = orchard_tasks::protocol::Protocol::paper().published;
    let paper: Vec<Point> = match (published.get(THROUGHPUT), published.get(damage)) {
        (Some(x), Some(y)) => vec![Point { x: x.value, y: y.value, ci95: None }],
        _ => Vec::new(),
    };
    let series = |name: &str, colour, mark, points| Series {
        name: name.to_owned(),
        colour,
        mark,
        line: Line::None,
        points,
        shift: 0,
    };
    let mut all = vec![series(&format!("an episode, {main}"), colour::BLUE, Mark::Dot, episodes)];
    if !others.is_empty() {
        all.push(series("mean of another condition", colour::ORANGE, Mark::Disc, others));
    }
    all.push(series(
        &format!("mean, {main}"),
        colour::VERMILION,
        Mark::Disc,
        mean(main).into_iter().collect(),
    ));
    if !paper.is_empty() {
        all.push(series("paper", colour::SOFT, Mark::Hollow, paper));
    }
    let points = || all.iter().flat_map(|s| &s.points);
    let x = Axis::from_zero("throughput [fruit/min]", points().map(|p| p.x), 6);
    let highest = points().map(|p| p.ci95.map_or(p.y, |[_, high]| high.max(p.y)));
    let y = Axis::from_zero("", highest, 5);
    // Points at 0 are drawn a little above the axis.
    let room =
        |axis: Axis, part: f64| Axis { ends: [-part * axis.ends[1], (1.0 + part) * axis.ends[1]], ..axis };
    let description = format!(
        "{} against throughput, {} episodes under {main}; mean at {} fruit/min and {} per tree.",
        title_with_unit(damage),
        results.episodes.len(),
        number(metric_of(harvest, main, THROUGHPUT).and_then(|m| m.mean), 2),
        number(metric_of(harvest, main, damage).and_then(|m| m.mean), 2),
    );
    let chart = Chart {
        stem: format!("damage-{}", if snapped { "snapped" } else { "dropped" }),
        title: title_with_unit(damage),
        x: room(x, 0.03),
        y: room(y, 0.04),
        series: all,
        bands: Vec::new(),
    };
    chart.figure(&description).map(Some)
}
