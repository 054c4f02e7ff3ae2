//! Rows of trees whose fruit hang on stems that bend, in still air and in wind, beside the same trees with fruit on tethers.

use orchard_gpu::{Gpu, GpuBatch};

use super::super::physics::forest::{Hold, Planting};
use super::super::timing::{Rounds, Side, alternate};
use super::counters::Counters;
use super::{FRAMES, MANY, ROUNDS, WARM_UP, rate_of, repeated, settled, wake};
use orchard_program::rows::Row;

/// Target: share of the rate on tethers.
const SHARE: f64 = 0.8;

/// Rates of `worlds` worlds that repeat `kinds` trees, measured alternately, their shares, and the memory of a batch.
pub fn rows(
    gpu: &Gpu,
    typical: &Planting,
    kinds: usize,
    worlds: usize,
    substeps: f64,
    awake: f64,
    counters: Option<&Counters>,
) -> anyhow::Result<Vec<Row>> {
    let mut batches = Vec::new();
    for hold in Hold::ALL {
        let all = repeated(&hold.worlds(typical, kinds.min(worlds))?, worlds);
        batches.push(GpuBatch::new(gpu, &all)?);
    }
    // Few worlds take more frames: a round is long beside the time in which the device's clock rises.
    let frames = FRAMES * (MANY / worlds).max(1) as u32;
    for world in settled(std::slice::from_ref(typical))? {
        wake(gpu, &world, awake)?;
    }
    let bytes: Vec<f64> = batches.iter().map(|batch| batch.bytes() as f64).collect();
    let mut sides: Vec<Side<'_>> = Vec::new();
    for batch in &mut batches {
        batch.advance(WARM_UP);
        batch.wait()?;
        sides.push(Box::new(move || Ok(rate_of(batch, frames)? * worlds as f64 * substeps)));
    }
    let figures: Vec<Rounds> = alternate(ROUNDS, &mut sides)?;
    drop(sides);
    let mut rows = Vec::new();
    for (((hold, own), bytes), batch) in Hold::ALL.into_iter().zip(&figures).zip(bytes).zip(&mut batches) {
        let name = format!("gpu.{}_{worlds}", hold.name());
        let rate = Row::measured(&name, own.median(), "substeps/s");
        rows.push(Row { spread: Some(own.spread()), ..rate });
        rows.push(Row::measured(&format!("{name}.memory"), bytes, "bytes"));
        rows.extend(Counters::rows_of(counters, &name, batch));
        if hold != Hold::Tethers {
            let shares = own.over(&figures[0]);
            let share = Row::measured(&format!("{name}.share"), shares.median(), "1");
            let share = if gpu.info().is_software { share } else { share.at_least(SHARE) };
            rows.push(Row { spread: Some(shares.spread()), ..share });
        }
    }
    Ok(rows)
}
