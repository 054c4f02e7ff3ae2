//! `cargo xtask check-combinations`: every preset with each of the first three cameras and with every other robot, each pair under the expert and one other controller, which take turns; every other camera with
//! one preset and every controller. One short episode each.

use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::Context;
use indicatif::{ProgressBar, ProgressStyle};
use orchard_program::Failure;
use orchard_scenario::{Scenario, SceneNames, cameras, controllers, presets, robots};
use orchard_tasks::harvest::Harvest;
use orchard_tasks::harvest::episode::Outcome;
use orchard_tasks::harvest::{WorldFactory, run_episode};
use rayon::prelude::*;

/// Runs a short episode of every preset with three cameras and with every other robot, under the expert and one other controller in turn, and of the other cameras with one preset each and every controller.
#[derive(clap::Args)]
#[command(
    after_help = "An episode is one tree of the first tuning seed. The command fails if a scenario cannot be resolved, a world cannot be built\n\
                  or becomes implausible, or anything panics.\n\nExample:\n  cargo xtask check-combinations --seconds 5"
)]
pub struct Args {
    /// Length of an episode [s]
    #[arg(long, default_value_t = SECONDS, value_name = "SECONDS")]
    seconds: f64,
}

/// Default length of an episode \[s\], our own choice: long enough for a controller to reach for a first fruit.
const SECONDS: f64 = 4.0;

/// Controller that is tried with every pair.
const EXPERT: &str = "expert";

/// Number of cameras that are tried with every preset.
const EVERYWHERE: usize = 3;

pub fn run(args: &Args) -> Result<(), Failure> {
    let count = check(args.seconds)?;
    say!("{count} combinations of preset, robot, camera and controller ran");
    Ok(())
}

/// Runs all combinations; returns how many there are.
fn check(seconds: f64) -> Result<usize, Failure> {
    let mut combinations = Vec::new();
    let usual = SceneNames::paper();
    let others_than_expert: Vec<String> =
        controllers().iter().map(|kind| kind.name().to_owned()).filter(|name| name != EXPERT).collect();
    for (number, preset) in presets().into_iter().enumerate() {
        // Large images take long: a camera after the first three is tried with one preset, each with another.
        let tried = |camera: usize| camera < EVERYWHERE || camera % presets().len() == number;
        let here = cameras().into_iter().enumerate().filter(|(camera, _)| tried(*camera));
        let cameras = here.map(|(camera, name)| ((usual.robot.as_str(), name), camera >= EVERYWHERE));
        let others = robots().into_iter().filter(|robot| *robot != usual.robot);
        let pairs = cameras.chain(others.map(|robot| ((robot, usual.camera.as_str()), false)));
        for (turn, ((robot, camera), with_all)) in pairs.enumerate() {
            let in_turn = (number + turn) % others_than_expert.len();
            let chosen =
                others_than_expert.iter().enumerate().filter(|(other, _)| with_all || *other == in_turn);
            for controller in std::iter::once(EXPERT).chain(chosen.map(|(_, name)| name.as_str())) {
                combinations.push([preset, robot, camera, controller].map(str::to_owned));
            }
        }
    }
    let bar = ProgressBar::new(combinations.len() as u64).with_style(
        ProgressStyle::with_template("{bar:30} {pos}/{len} combinations")
            .unwrap_or_else(|_| ProgressStyle::default_bar()),
    );
    let failed = AtomicBool::new(false);
    combinations.par_iter().with_max_len(1).for_each(|parts| {
        if let Err(e) = episode(parts, seconds) {
            eprintln!("{}: {e:#}", parts.join(" x "));
            failed.store(true, Ordering::Relaxed);
        }
        bar.inc(1);
    });
    bar.finish_and_clear();
    if failed.load(Ordering::Relaxed) {
        return Err(Failure::Failed("at least one combination failed".to_owned()));
    }
    Ok(combinations.len())
}

fn episode([preset, robot, camera, controller]: &[String; 4], seconds: f64) -> anyhow::Result<()> {
    let options: [(&str, &str); 4] =
        [("preset", preset), ("robot", robot), ("camera", camera), ("controller", controller)];
    let harvest = Harvest::new(Scenario::of(&options)?)?;
    let seed = harvest.protocol().tuning_seeds[0];
    let plan = harvest.plan("quick", vec![seed], 1, seconds);
    plan.check()?;
    let key = plan.episodes().swap_remove(0);
    let (mut world, mut picker) = harvest.build(&key).map_err(anyhow::Error::msg)?;
    let never = AtomicBool::new(false);
    let record =
        run_episode(key, &mut world, &mut picker, harvest.protocol(), plan.frame, &never, &mut || ())
            .context("the episode was stopped")?;
    match record.outcome {
        Outcome::Quarantined { reason } => anyhow::bail!("quarantined: {reason}"),
        _ => Ok(()),
    }
}
