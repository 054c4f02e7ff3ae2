//! Rows of trees whose fruit hang on stems that bend, in still air and in wind, beside the same trees with fruit on tethers.

use orchard_batch::{Batch, Isa};

use super::forest::{Hold, Planting};
use super::{Bench, FRAMES};
use crate::perf::timing::{Side, alternate, cpu_time};
use orchard_program::rows::Row;

/// Target: share of the rate on tethers.
const SHARE: f64 = 0.8;
/// Vectors of worlds of a batch.
const TILES: usize = 4;

/// Rates in lanes on one thread, measured alternately, and their shares.
pub fn rows(bench: &Bench, typical: &Planting) -> anyhow::Result<Vec<Row>> {
    bench.say("stems and wind");
    let worlds = TILES * Isa::best().lanes();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let mut sides: Vec<Side<'_>> = Vec::new();
    for hold in Hold::ALL {
        let start = Batch::new(&hold.worlds(typical, worlds)?)?;
        let (pool, repeats) = (&pool, bench.plan.batch_repeats);
        sides.push(Box::new(move || {
            let mut spent = 0.0;
            for _ in 0..repeats {
                let mut batch = start.clone();
                let from = cpu_time();
                pool.install(|| batch.step(FRAMES));
                spent += (cpu_time() - from).as_secs_f64();
            }
            Ok(f64::from(FRAMES * bench.substeps * repeats) * worlds as f64 / spent)
        }));
    }
    let figures = alternate(bench.plan.rounds, &mut sides)?;
    let mut rows = Vec::new();
    for (hold, own) in Hold::ALL.into_iter().zip(&figures) {
        let name = format!("physics.{}", hold.name());
        rows.push(bench.row(&name, own, None));
        if hold != Hold::Tethers {
            let shares = own.over(&figures[0]);
            let share = Row::measured(&format!("{name}.share"), shares.median(), "1").at_least(SHARE);
            rows.push(Row { spread: Some(shares.spread()), ..share });
        }
    }
    Ok(rows)
}
