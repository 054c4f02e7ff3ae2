//! Suite `trees`: speed of growing trees and of building worlds.

use std::time::Instant;

use orchard_env::{Backend, Env};
use orchard_scenario::Scenario;
use orchard_spec::Spec;
use orchard_treegen::grow;

use super::timing::{Rounds, alternate, cpu_time, rate};
use orchard_program::rows::{Effort, Measured, Row};

/// Target: a default tree with leaves and fruit sites takes less than 2 ms of one core.
const TREES_PER_SECOND: f64 = 500.0;

/// Worlds of the second row, and its target: the processor time of two cores in 2 s.
const WORLDS: u32 = 512;
const WORLDS_CPU_SECONDS: f64 = 4.0;

const BUDGET: &str = "processor time of all threads; the target is that of two cores in 2 s";

/// Rounds of the second row.
const ROUNDS: usize = 5;

/// Measures the growth of default trees on one core, a new tree each time, and the building of batches of different randomised worlds.
pub fn measure(effort: Effort) -> anyhow::Result<Measured> {
    let spec = Spec::paper();
    let per_second = rate(|world| {
        std::hint::black_box(grow(&spec, 1, world)?);
        Ok(())
    })?;
    let (wall, processor) = build_worlds(if effort == Effort::Quick { 1 } else { ROUNDS })?;
    let wall_row = Row::measured("worlds.build_512", wall.median(), "s");
    let processor_row = Row::measured("worlds.build_512.cpu", processor.median(), "s");
    Ok(vec![
        Row::measured("trees.grow", per_second, "trees/s").at_least(TREES_PER_SECOND),
        Row { spread: Some(wall.spread()), note: Some(threads()), ..wall_row },
        Row { spread: Some(processor.spread()), note: Some(BUDGET.to_owned()), ..processor_row }
            .at_most(WORLDS_CPU_SECONDS),
    ]
    .into())
}

fn threads() -> String {
    format!("elapsed, {} threads", rayon::current_num_threads())
}

/// Time elapsed and processor time of all threads \[s\].
fn build_worlds(rounds: usize) -> anyhow::Result<(Rounds, Rounds)> {
    let scenario = Scenario::of(&[("preset", "randomised")])?;
    let mut seed = 0;
    let mut elapsed = Vec::new();
    let processor = || {
        seed += 1;
        let (start, cpu_start) = (Instant::now(), cpu_time());
        let env = Env::new(&scenario, seed, 0..WORLDS, Backend::Cpu)?;
        let (wall, cpu) = (start.elapsed(), cpu_time() - cpu_start);
        std::hint::black_box(env);
        elapsed.push(wall.as_secs_f64());
        Ok(cpu.as_secs_f64())
    };
    let mut figures = alternate(rounds, &mut [Box::new(processor)])?;
    Ok((Rounds::new(elapsed), figures.remove(0)))
}
