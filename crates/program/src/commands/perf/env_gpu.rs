//! Suite `env-gpu`: speed of the learning environments whose worlds move on a graphics device.

use std::time::Instant;

use orchard_env::{Backend, Settings, Task, TaskEnv};
use orchard_policy::Spaces;
use orchard_scenario::Scenario;
use orchard_spec::{Purpose, Stream};

use crate::rows::{Effort, Measured, Rounds, Row};

/// Seed of worlds and actions.
const SEED: u64 = 20250704;
/// Actions a second.
const CONTROL_HZ: u32 = 20;
/// Target: control steps a second of all environments together with 4,096 of them, on one card.
const TARGET: f64 = 500_000.0;
const TARGET_ENVS: u32 = 4096;

/// Measures environments by their number. The actions keep the base in place and move the arm at random, so that hands meet the canopy.
pub fn measure(effort: Effort) -> anyhow::Result<Measured> {
    let (numbers, rounds, steps): (&[u32], u32, u32) = match effort {
        Effort::Full => (&[512, 4096], 5, 10),
        Effort::Quick => (&[2], 1, 1),
    };
    let mut rows = Vec::new();
    for &envs in numbers {
        let spaces = Spaces { control_hz: CONTROL_HZ, ..Spaces::default() };
        let settings = Settings { spaces, backend: Backend::Gpu, ..Settings::of(Task::Reach) };
        let mut env = TaskEnv::new(&Scenario::of(&[])?, &settings, 0..envs)?;
        let (all, mut draws) = (vec![true; envs as usize], Stream::new(SEED, 0, Purpose::Test));
        let size = env.interface().policy.action.len();
        let start = Instant::now();
        env.reset(&vec![Some(SEED); envs as usize], &all)?;
        let reset = start.elapsed().as_secs_f64() / f64::from(envs);
        let mut rates = Vec::new();
        // The first round warms up.
        for round in 0..=rounds {
            let start = Instant::now();
            for _ in 0..steps {
                let actions: Vec<f32> =
                    (0..envs as usize * size).map(|_| draws.uniform(-1.0, 1.0) as f32).collect();
                let goes_on: Vec<bool> = (0..envs as usize)
                    .map(|k| !(env.report(k).terminated || env.report(k).truncated))
                    .collect();
                env.step(&actions, &goes_on)?;
            }
            if round > 0 {
                rates.push(f64::from(envs * steps) / start.elapsed().as_secs_f64());
            }
        }
        let (rates, name) = (Rounds::new(rates), format!("env.gpu_{envs}"));
        let share = env.tally().map_or(0.0, |tally| tally.share_on_device());
        let note = format!(
            "Reach-v1 from state at {CONTROL_HZ} Hz, distinct trees; {:.1} % of the frames on the device: {:?}",
            100.0 * share,
            env.tally().map(|tally| tally.frames).unwrap_or_default()
        );
        let row = Row::measured(&name, rates.median(), "steps/s");
        let row = if envs == TARGET_ENVS { row.at_least(TARGET) } else { row };
        rows.push(Row { spread: Some(rates.spread()), note: Some(note), ..row });
        let row = Row::measured(&format!("{name}.reset"), reset, "s");
        rows.push(Row {
            note: Some("wall time of a reset that grows a new tree, a world".to_owned()),
            ..row
        });
    }
    Ok(rows.into())
}
