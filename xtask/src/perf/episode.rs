//! Suite `episode`: how fast a whole nominal episode runs.

use std::sync::atomic::AtomicBool;
use std::time::Instant;

use anyhow::Context;
use orchard_bench::harvest::Harvest;
use orchard_bench::protocol::Protocol;
use orchard_bench::{WorldFactory, run_episode};
use orchard_picker::Kind;

use crate::rows::{Effort, Measured, Row};

/// World-seconds a wall second of the released OrchardBench while picking, on its laptop GPU.
const RELEASED_RATE: f64 = 0.45;

/// Episodes of the full profile's length, one after the other on one core; their median rate.
pub fn measure(_: Effort) -> anyhow::Result<Measured> {
    let harvest = Harvest::paper(Kind::Baseline);
    let protocol = Protocol::paper();
    let seeds = protocol.tuning_seeds.clone();
    let plan = harvest.plan("full", seeds, 1, protocol.full.horizon.si());
    let mut rates = Vec::new();
    for key in plan.episodes() {
        let (mut world, mut picker) = harvest
            .build(key.seed, key.world)
            .map_err(|reason| anyhow::anyhow!("seed {}: {reason}", key.seed))?;
        let start = Instant::now();
        let never = AtomicBool::new(false);
        let record = run_episode(key, &mut world, &mut picker, &protocol, plan.frame, &never, &mut || ())
            .context("the episode was stopped")?;
        rates.push(record.duration_s / start.elapsed().as_secs_f64());
    }
    rates.sort_by(f64::total_cmp);
    let median = rates[rates.len() / 2];
    Ok(vec![
        Row::measured("episode.nominal_75s", median, "world-s/s")
            .beside("released OrchardBench, laptop GPU", RELEASED_RATE),
    ]
    .into())
}
