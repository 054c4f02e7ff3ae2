//! Throughput over parallel worlds.

use std::collections::BTreeSet;

use crate::axis::Axis;
use crate::chart::{Band, Chart, Line, Mark, Point, Series};
use crate::figure::{Figure, FigureError, colour};
use crate::published::PaperScaling;
use crate::results::{Scaling, ScalingRow};
use crate::words::plain;

/// What is drawn of a row.
type Value = fn(&ScalingRow) -> Option<f64>;

/// Lines of solvers, in their order.
const LINES: [Line; 3] = [Line::Solid, Line::Dashed, Line::Dotted];

/// Throughput, step rate and memory over the number of worlds.
pub(crate) fn figures(scaling: &Scaling, paper: &PaperScaling) -> Result<Vec<Figure>, FigureError> {
    let bands = || {
        let plateau = [&paper.plateau_low, &paper.plateau_high].map(|count| f64::from(count.get()));
        let distinct = f64::from(paper.distinct.get());
        vec![
            Band { name: "paper, plateau".to_owned(), ends: plateau },
            Band { name: "paper, distinct".to_owned(), ends: [distinct; 2] },
        ]
    };
    let mut figures = vec![
        figure(
            scaling,
            "scaling-throughput",
            "Throughput [env-steps/s]",
            |row| Some(row.env_steps_per_s),
            bands(),
        )?,
        figure(
            scaling,
            "scaling-steps",
            "Frames of the batch [1/s]",
            |row| Some(row.step_rate_per_s),
            Vec::new(),
        )?,
    ];
    if scaling.rows.iter().any(|row| row.memory_mib.is_some()) {
        figures.push(figure(scaling, "scaling-memory", "Memory [MiB]", |row| row.memory_mib, Vec::new())?);
    }
    Ok(figures)
}

fn figure(
    scaling: &Scaling,
    stem: &str,
    title: &str,
    value: Value,
    bands: Vec<Band>,
) -> Result<Figure, FigureError> {
    let solvers: Vec<&str> =
        scaling.rows.iter().map(|row| &*row.solver).collect::<BTreeSet<_>>().into_iter().collect();
    let modes: Vec<&str> =
        scaling.rows.iter().map(|row| &*row.mode).collect::<BTreeSet<_>>().into_iter().collect();
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
    series.extend(modes.iter().enumerate().map(|(i, mode)| key(mode, colour_of(i), Mark::Disc, Line::None)));
    if solvers.len() > 1 {
        let sign =
            |(j, solver): (usize, &&str)| key(solver, colour::SOFT, Mark::None, LINES[j % LINES.len()]);
        series.extend(solvers.iter().enumerate().map(sign));
    }
    for (i, mode) in modes.iter().enumerate() {
        for (j, solver) in solvers.iter().enumerate() {
            let own = scaling.rows.iter().filter(|row| row.solver == *solver && row.mode == *mode);
            let mut points: Vec<Point> = own
                .filter_map(|row| Some(Point { x: f64::from(row.worlds), y: value(row)?, ci95: None }))
                .filter(|point| point.x > 0.0 && point.y > 0.0)
                .collect();
            if points.is_empty() {
                continue;
            }
            points.sort_by(|a, b| a.x.total_cmp(&b.x));
            let list: Vec<String> = points.iter().map(|p| format!("{:.0} at {}", p.y, p.x)).collect();
            told.push(format!("{}, {}: {}", plain(mode), plain(solver), list.join(", ")));
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
