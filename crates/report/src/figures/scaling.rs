//! Throughput over parallel worlds.

use orchard_scaling::{PublishedScaling, Row, Scaling, SolverName};
use orchard_spec::randomisation::Mode;
use plotters::style::RGBColor;

use crate::axis::Axis;
use crate::chart::{Band, Chart, Line, Mark, Point, Series};
use crate::figure::{Figure, FigureError, colour};
use crate::words::{mode as mode_name, plain};

/// Reads the value of a row, with the smallest and the largest of its repeats.
type Value = fn(&Row) -> Option<(f64, Option<[f64; 2]>)>;

/// Lines of solvers, in their order.
const LINES: [Line; 3] = [Line::Solid, Line::Dashed, Line::Dotted];

/// Ratio of a gigabyte to a mebibyte.
const MIB_PER_GB: f64 = 1e9 / 1_048_576.0;
/// Shift between equal points of the paper, so that both are visible \[px\].
const APART: i32 = 5;

/// Throughput, step rate and memory over the number of worlds. With several backends, only the fastest solver of each is drawn.
pub(crate) fn figures(scalings: &[Scaling], paper: &PublishedScaling) -> Result<Vec<Figure>, FigureError> {
    // Smallest and largest of the repeats.
    let throughput: Value = |row| {
        let ends = row.spread.map(|rate| rate * f64::from(row.worlds));
        Some((row.env_steps_per_s, Some(ends)))
    };
    let rate: Value = |row| Some((row.step_rate_per_s, Some(row.spread)));
    let memory: Value = |row| Some((row.memory_mib?, None));
    let rows = drawn(scalings);
    let title = "Throughput [env-steps/s]";
    let mut figures = vec![
        figure(&rows, "scaling-throughput", title, throughput, (bands(paper), rates(paper)))?,
        figure(&rows, "scaling-steps", "Frames of the batch [1/s]", rate, Default::default())?,
    ];
    if rows.iter().any(|row| row.memory_mib.is_some()) {
        let title = "Memory of the batch [MiB]";
        figures.push(figure(&rows, "scaling-memory", title, memory, (Vec::new(), memories(paper)))?);
    }
    Ok(figures)
}

/// The rows that are drawn: all rows of a single backend, or those of the fastest solver of each of several backends.
fn drawn(scalings: &[Scaling]) -> Vec<&Row> {
    let fastest = |scaling: &Scaling| {
        let rows = scaling.rows.iter();
        rows.max_by(|a, b| a.env_steps_per_s.total_cmp(&b.env_steps_per_s)).map(|row| row.solver)
    };
    let of = |scaling| {
        let only = if scalings.len() > 1 { fastest(scaling) } else { None };
        scaling.rows.iter().filter(move |row| only.is_none_or(|solver| row.solver == solver))
    };
    scalings.iter().flat_map(of).collect()
}

/// Rates of the paper's largest batches; modes of the same rate share a band.
fn bands(paper: &PublishedScaling) -> Vec<Band> {
    let mut bands: Vec<Band> = Vec::new();
    for rate in paper.env_steps_per_s.iter().filter(|rate| rate.worlds > 1) {
        let (ends, name) = ([rate.low, rate.high], mode_name(rate.mode));
        match bands.iter_mut().find(|band| band.ends == ends) {
            Some(band) => band.name += &format!(", {name}"),
            None => bands.push(Band { name: format!("paper: {name}"), ends }),
        }
    }
    bands
}

/// The paper's rates, a point each in its mode's colour.
fn rates(paper: &PublishedScaling) -> Vec<Series> {
    let mut series: Vec<Series> = Vec::new();
    for rate in &paper.env_steps_per_s {
        let (x, ends) = (f64::from(rate.worlds), [rate.low, rate.high]);
        let point = Point { x, y: 0.5 * (rate.low + rate.high), ci95: Some(ends) };
        let equal = series.iter().filter(|other| other.points.contains(&point)).count() as i32;
        series.push(published("", colour_of(rate.mode), point, APART * equal));
    }
    series
}

/// The memory of the paper's largest batches.
fn memories(paper: &PublishedScaling) -> Vec<Series> {
    let published_memory = paper.solvers.iter().filter_map(|solver| Some((solver, solver.memory?)));
    let series = published_memory.map(|(solver, memory)| {
        let point = Point { x: f64::from(solver.most_worlds), y: MIB_PER_GB * memory, ci95: None };
        published(&format!("paper: {}", solver.name), colour::INK, point, 0)
    });
    series.collect()
}

/// Colour of a mode; it does not depend on the drawn modes.
fn colour_of(mode: Mode) -> RGBColor {
    let place = Mode::ALL.iter().position(|other| *other == mode).unwrap_or_default();
    colour::SERIES[place % colour::SERIES.len()]
}

fn published(name: &str, colour: RGBColor, point: Point, shift: i32) -> Series {
    let (mark, line) = (Mark::Hollow, Line::None);
    Series { name: name.to_owned(), colour, mark, line, points: vec![point], shift }
}

fn figure(
    rows: &[&Row],
    stem: &str,
    title: &str,
    value: Value,
    (bands, paper): (Vec<Band>, Vec<Series>),
) -> Result<Figure, FigureError> {
    let has = |of: &dyn Fn(&Row) -> bool| rows.iter().any(|row| of(row));
    let solvers: Vec<SolverName> =
        SolverName::ALL.into_iter().filter(|s| has(&|row| row.solver == *s)).collect();
    let modes: Vec<Mode> = Mode::ALL.into_iter().filter(|m| has(&|row| row.mode == *m)).collect();
    let mut series = Vec::new();
    let mut texts = Vec::new();
    // The legend has one colour by mode and one line style by solver.
    let key = |name: &str, colour, mark, line| Series {
        name: plain(name),
        colour,
        mark,
        line,
        points: Vec::new(),
        shift: 0,
    };
    series.extend(modes.iter().map(|mode| key(mode_name(*mode), colour_of(*mode), Mark::Disc, Line::None)));
    if solvers.len() > 1 {
        let sign = |(j, solver): (usize, &SolverName)| {
            key(solver.name(), colour::SOFT, Mark::None, LINES[j % LINES.len()])
        };
        series.extend(solvers.iter().enumerate().map(sign));
    }
    for mode in &modes {
        for (j, solver) in solvers.iter().enumerate() {
            let own = rows.iter().filter(|row| row.solver == *solver && row.mode == *mode);
            let mut points: Vec<Point> = own
                .filter_map(|row| value(row).map(|(y, ci95)| Point { x: f64::from(row.worlds), y, ci95 }))
                .filter(|point| point.x > 0.0 && point.y > 0.0)
                .collect();
            if points.is_empty() {
                continue;
            }
            points.sort_by(|a, b| a.x.total_cmp(&b.x));
            let list: Vec<String> = points.iter().map(|p| format!("{:.0} at {}", p.y, p.x)).collect();
            texts.push(format!("{}, {}: {}", mode_name(*mode), plain(solver.name()), list.join(", ")));
            let line = LINES[j % LINES.len()];
            series.push(Series {
                name: String::new(),
                colour: colour_of(*mode),
                mark: Mark::Disc,
                line,
                points,
                shift: 0,
            });
        }
    }
    series.extend(paper);
    let points = || series.iter().flat_map(|s| &s.points);
    let compared = bands.iter().flat_map(|band| band.ends);
    let compared = compared.chain(points().filter_map(|point| point.ci95).flatten());
    let x = Axis::doublings("parallel worlds", points().map(|p| p.x), 6);
    let y = Axis::decades("", points().map(|p| p.y).chain(compared));
    let chart = Chart { stem: stem.to_owned(), title: title.to_owned(), x, y, series, bands };
    chart.figure(&format!("{title} over parallel worlds. {}.", texts.join("; ")))
}
