//! Suite `episode`: speed of a whole nominal episode, by controller.

use std::sync::atomic::AtomicBool;

use anyhow::Context;
use orchard_scenario::{Scenario, controllers};
use orchard_tasks::harvest::Harvest;
use orchard_tasks::harvest::{WorldFactory, run_episode};

use super::timing::{Rounds, cpu_time};
use super::{say, spinner};
use orchard_program::rows::{Effort, Measured, Row};

/// World-seconds per wall second of the released OrchardBench while picking, on its laptop GPU.
const RELEASED_RATE: f64 = 0.45;
/// Target time of a whole nominal episode, picker and camera included \[s of one core\].
const ASKED: f64 = 3.0;

/// Runs episodes of the full profile's length, one tree per tuning seed, in sequence; two rows per controller.
pub fn measure(_: Effort) -> anyhow::Result<Measured> {
    let bar = spinner();
    let mut rows = Vec::new();
    for kind in controllers() {
        say(&bar, &format!("episodes of the controller {}", kind.name()));
        let (seconds, rates) = episodes(kind.name())?;
        let row = |name: &str, rounds: &Rounds, unit: &str| Row {
            spread: Some(rounds.spread()),
            ..Row::measured(&format!("episode.{name}.{}", kind.name()), rounds.median(), unit)
        };
        rows.push(row("nominal_75s", &seconds, "s").at_most(ASKED));
        let rate = row("rate", &rates, "world-s/s");
        rows.push(rate.beside("released OrchardBench, laptop GPU", RELEASED_RATE));
    }
    bar.finish_and_clear();
    Ok(rows.into())
}

/// Processor seconds of whole episodes, and world-seconds per processor second.
fn episodes(controller: &str) -> anyhow::Result<(Rounds, Rounds)> {
    let harvest = Harvest::new(Scenario::of(&[("controller", controller)])?)?;
    let protocol = harvest.protocol();
    let plan = harvest.plan("full", protocol.tuning_seeds.clone(), 1, protocol.full.horizon.si());
    let (mut seconds, mut rates) = (Vec::new(), Vec::new());
    for key in plan.episodes() {
        let (mut world, mut picker) =
            harvest.build(&key).map_err(|reason| anyhow::anyhow!("seed {}: {reason}", key.seed))?;
        let start = cpu_time();
        let never = AtomicBool::new(false);
        let record = run_episode(key, &mut world, &mut picker, protocol, plan.frame, &never, &mut || ())
            .context("the episode was stopped")?;
        let spent = (cpu_time() - start).as_secs_f64();
        seconds.push(spent);
        rates.push(record.duration_s / spent);
    }
    Ok((Rounds::new(seconds), Rounds::new(rates)))
}
