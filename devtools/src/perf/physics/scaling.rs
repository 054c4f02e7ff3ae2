//! Cost and memory as functions of the size of a tree.

use orchard_batch::{Batch, Isa, TreeWorld};
use orchard_geometry::math;

use super::forest::{Planting, nearest, spec_with_fruit, spec_with_segments};
use super::trees::rate;
use super::{Bench, FRAMES, LINKS};
use crate::perf::timing::{Side, alternate, cpu_time};
use orchard_program::rows::Row;

/// Segments of a tree.
const SEGMENTS: [u32; 6] = [50, 100, 200, 500, 1000, 2000];
/// Fruit of a tree.
const FRUITS: [u32; 3] = [20, 40, 80];
/// Worlds among which a tree of a size is looked for.
const SEARCHED: u32 = 512;

/// Rows of both series.
pub fn rows(bench: &Bench) -> anyhow::Result<Vec<Row>> {
    bench.say("growing trees of other sizes");
    let coarse = nearest(spec_with_segments(SEGMENTS[0])?, SEGMENTS[0] as usize, 1, SEARCHED)?.remove(0);
    let by_segments = SEGMENTS.map(|segments| (segments, coarse.refined(segments as usize)));
    let by_fruit =
        FRUITS.map(|fruit| Ok((fruit, nearest(spec_with_fruit(fruit)?, LINKS, 1, SEARCHED)?.remove(0))));
    let by_fruit = by_fruit.into_iter().collect::<anyhow::Result<Vec<_>>>()?;
    let mut rows = series(bench, "physics.segments", &by_segments, Growth::Power)?;
    rows.extend(series(bench, "physics.fruit", &by_fruit, Growth::Line)?);
    Ok(rows)
}

/// Cost of a substep of each tree, in f64 and in lanes, and its growth with the size, given beside each tree.
fn series(
    bench: &Bench,
    name: &str,
    plantings: &[(u32, Planting)],
    growth: Growth,
) -> anyhow::Result<Vec<Row>> {
    bench.say(name);
    let lanes = Isa::best().lanes();
    let mut sides: Vec<Side<'_>> = Vec::new();
    let mut memory = Vec::new();
    for (_, planting) in plantings {
        let world = planting.kicked(0)?;
        let links = world.plant().tree.len() as f64;
        let courses = (bench.plan.work / (links * f64::from(FRAMES * bench.substeps))).ceil() as u32;
        let siblings: Vec<TreeWorld> =
            (0..lanes as u32).map(|i| planting.sibling(i).kicked(i)).collect::<anyhow::Result<_>>()?;
        let batch = Batch::new(&siblings)?;
        memory.push(batch.bytes() as f64 / lanes as f64);
        sides.push(Box::new(move || Ok(1e6 / rate(&world, bench.substeps, courses))));
        sides.push(Box::new(move || {
            let mut batch = batch.clone();
            let start = cpu_time();
            batch.step(FRAMES * courses);
            let seconds = (cpu_time() - start).as_secs_f64();
            Ok(1e6 * seconds / (f64::from(FRAMES * bench.substeps * courses) * lanes as f64))
        }));
    }
    let figures = alternate(bench.plan.rounds, &mut sides)?;
    let mut rows = Vec::new();
    for (which, kind) in ["f64", "lanes"].into_iter().enumerate() {
        let mut points = Vec::new();
        for (index, (count, _)) in plantings.iter().enumerate() {
            let figures = &figures[2 * index + which];
            let mut row = Row::measured(&format!("{name}.{kind}.{count}"), figures.median(), "us/substep");
            row.spread = Some(figures.spread());
            rows.push(row);
            points.push((f64::from(*count), figures.median()));
        }
        let mut fit = match growth {
            Growth::Power => Row::measured(&format!("{name}.{kind}.exponent"), exponent(&points), "1"),
            Growth::Line => Row::measured(&format!("{name}.{kind}.each"), 1e3 * slope(&points), "ns/substep"),
        };
        let each: Vec<String> = points.iter().map(|(count, us)| format!("{:.0}", 1e3 * us / count)).collect();
        fit.note = Some(match growth {
            Growth::Power => {
                format!("exponent of the cost over the count; {} ns per piece", each.join(", "))
            }
            Growth::Line => "cost of one more".to_owned(),
        });
        rows.push(fit);
    }
    for ((count, _), memory) in plantings.iter().zip(memory) {
        rows.push(Row::measured(&format!("{name}.lanes.{count}.memory"), memory, "bytes/world"));
    }
    Ok(rows)
}

/// Summary statistic of a series.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Growth {
    /// Exponent of the cost over the count.
    Power,
    /// Cost of one more, for series with a fixed cost.
    Line,
}

/// Slope of ln y against ln x: 1 is linear.
fn exponent(points: &[(f64, f64)]) -> f64 {
    slope(&points.iter().map(|(x, y)| (math::ln(*x), math::ln(*y))).collect::<Vec<_>>())
}

/// Least-squares slope of y against x.
fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let (mean_x, mean_y) = points.iter().fold((0.0, 0.0), |sum, p| (sum.0 + p.0 / n, sum.1 + p.1 / n));
    let covariance: f64 = points.iter().map(|(x, y)| (x - mean_x) * (y - mean_y)).sum();
    let variance: f64 = points.iter().map(|(x, _)| (x - mean_x) * (x - mean_x)).sum();
    covariance / variance
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exponent_is_that_of_a_power() {
        let points = [1.0, 2.0, 8.0, 32.0].map(|x: f64| (x, 3.0 * x * x.sqrt()));
        assert!((exponent(&points) - 1.5).abs() < 1e-12);
    }
}
