//! Throughput over parallel worlds.

use orchard_bench::scaling::{PublishedScaling, Row, Scaling, SolverName};
use orchard_spec::randomisation::Mode;

use crate::axis::Axis;
use crate::chart::{Band, Chart, Line, Mark, Point, Series};
use crate::figure::{Figure, FigureError, colour};
use crate::words::{mode as mode_name, plain};

/// What is drawn of a row, with the smallest and the largest of its repeats.
type Value = fn(&Row) -> Option<(f64, Option<[f64; 2]>)>;

/// Lines of solvers, in their order.
const LINES: [Line; 3] = [Line::Solid, Line::Dashed, Line::Dotted];

/// Throughput, step rate and memory over the number of worlds.
pub(crate) fn figures(scaling: &Scaling, paper: &PublishedScaling) -> Result<Vec<Figure>, FigureError> {
    // Smallest and largest of the repeats.
    let throughput: Value = |row| {
        let ends = row.spread.map(|rate| rate * f64::from(row.worlds));
        Some((row.env_steps_per_s, Some(ends)))
    };
    let rate: Value = |row| Some((row.step_rate_per_s, Some(row.spread)));
    let memory: Value = |row| Some((row.memory_mib?, None));
    let mut figures = vec![
        figure(scaling, "scaling-throughput", "Throughput [env-steps/s]", throughput, bands(paper))?,
        figure(scaling, "scaling-steps", "Frames of the batch [1/s]", rate, Vec::new())?,
    ];
    if scaling.rows.iter().any(|row| row.memory_mib.is_some()) {
        figures.push(figure(scaling, "scaling-memory", "Memory of the batch [MiB]", memory, Vec::new())?);
    }
    Ok(figures)
}

/// What the paper's largest batches reach, modes of one rate together.
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

fn figure(
    scaling: &Scaling,
    stem: &str,
    title: &str,
    value: Value,
    bands: Vec<Band>,
) -> Result<Figure, FigureError> {
    let has = |of: &dyn Fn(&Row) -> bool| scaling.rows.iter().any(of);
    let solvers: Vec<SolverName> =
        SolverName::ALL.into_iter().filter(|s| has(&|row| row.solver == *s)).collect();
    let modes: Vec<Mode> = Mode::ALL.into_iter().filter(|m| has(&|row| row.mode == *m)).collect();
    let mut series = Vec::new();
    let mut told = Vec::new();
    // A colour a mode, a kind of line a solver: the legend tells them apart.
    let colour_of = |i: usize| colour::SERIES[i % colour::SERIES.len()];
    let key = |name: &str, colour, mark, line| Series {
        name: plain(name),
        colour,
        mark,
        line,
        points: Vec::new(),
        shift: 0,
    };
    series.extend(
        modes.iter().enumerate().map(|(i, mode)| key(mode_name(*mode), colour_of(i), Mark::Disc, Line::None)),
    );
    if solvers.len() > 1 {
        let sign = |(j, solver): (usize, &SolverName)| {
            key(solver.name(), colour::SOFT, Mark::None, LINES[j % LINES.len()])
        };
        series.extend(solvers.iter().enumerate().map(sign));
    }
    for (i, mode) in modes.iter().enumerate() {
        for (j, solver) in solvers.iter().enumerate() {
            let own = scaling.rows.iter().filter(|row| row.solver == *solver && row.mode == *mode);
            let mut points: Vec<Point> = own
                .filter_map(|row| value(row).map(|(y, ci95)| Point { x: f64::from(row.worlds), y, ci95 }))
                .filter(|point| point.x > 0.0 && point.y > 0.0)
                .collect();
            if points.is_empty() {
                continue;
            }
            points.sort_by(|a, b| a.x.total_cmp(&b.x));
            let list: Vec<String> = points.iter().map(|p| format!("{:.0} at {}", p.y, p.x)).collect();
            told.push(format!("{}, {}: {}", mode_name(*mode), plain(solver.name()), list.join(", ")));
            let line = LINES[j % LINES.len()];
            series.push(Series {
                name: String::new(),
                colour: colour_of(i),
                mark: Mark::Disc,
                line,
                points,
                shift: 0,
            });
        }
    }
    let points = || series.iter().flat_map(|s| &s.points);
    let compared = bands.iter().flat_map(|band| band.ends);
    let x = Axis::doublings("parallel worlds", points().map(|p| p.x), 6);
    let y = Axis::decades("", points().map(|p| p.y).chain(compared));
    let chart = Chart { stem: stem.to_owned(), title: title.to_owned(), x, y, series, bands };
    chart.figure(&format!("{title} over parallel worlds. {}.", told.join("; ")))
}
