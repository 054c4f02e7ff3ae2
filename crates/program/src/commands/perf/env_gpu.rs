//! Suite `env-gpu`: speed of the learning environments whose worlds move on a graphics device.

use std::time::Instant;

use orchard_env::{Backend, Detail, Pool, Settings, Task, TaskEnv};
use orchard_policy::{Pixels, Spaces};
use orchard_scenario::Scenario;
use orchard_spec::camera::CameraSpec;
use orchard_spec::{Purpose, Stream};

use crate::rows::{Effort, Measured, Rounds, Row};

/// Seed of worlds and actions.
const SEED: u64 = 20250704;
/// Actions a second.
const CONTROL_HZ: u32 = 20;
/// Target: control steps a second of all environments together with 4,096 of them, on one card.
const TARGET: f64 = 500_000.0;
const TARGET_ENVS: u32 = 4096;

/// Side of the square depth images, and of colour pictures \[px\].
const SIDE: u32 = 128;
const PICTURE: u32 = 64;
/// Target: steps a second with a depth image each, with as many environments.
const DEPTH_TARGET: f64 = 250_000.0;

/// Resets: one of so many environments begins an episode with a new tree in each step.
const RESETTING: usize = 100;
/// Target: rate with those resets over that without.
const RESETTING_SHARE: f64 = 0.95;

/// Measures environments by their number, from state and with depth images. The actions keep the base in place and move the arm at random, so that hands meet the canopy. Those with images run on the processor alone
/// besides, for comparison.
pub fn measure(effort: Effort) -> anyhow::Result<Measured> {
    let (numbers, rounds, steps): (&[u32], u32, u32) = match effort {
        Effort::Full => (&[512, 4096], 5, 10),
        Effort::Quick => (&[2], 1, 1),
    };
    let (state, depth) = (Scenario::of(&[])?, with_square_camera()?);
    let mut rows = Vec::new();
    for &envs in numbers {
        let is_many = envs == TARGET_ENVS;
        let case = Case {
            scenario: &state,
            sees: Sees::State,
            pool: None,
            backend: Backend::Gpu,
            envs,
            rounds,
            steps,
        };
        let target = is_many.then_some(TARGET);
        rows.extend(rows_of(&format!("env.gpu_{envs}"), &case, target)?);
        let case = Case { pool: Some(Pool { trees: envs, seed: SEED }), ..case };
        rows.extend(rows_of(&format!("env.gpu_pool_{envs}"), &case, target)?);
        let pixels = Case { sees: Sees::Pixels, ..case };
        let case = Case { scenario: &depth, sees: Sees::Depth { stays: false }, ..case };
        let target = is_many.then_some(DEPTH_TARGET);
        rows.extend(rows_of(&format!("env.gpu_depth_{envs}"), &case, target)?);
        let case = Case { sees: Sees::Depth { stays: true }, ..case };
        rows.extend(rows_of(&format!("env.gpu_depth_stays_{envs}"), &case, target)?);
        rows.extend(rows_of(&format!("env.gpu_pixels_stays_{envs}"), &pixels, None)?);
    }
    let envs = numbers[0];
    let case = Case {
        scenario: &depth,
        sees: Sees::Depth { stays: false },
        pool: None,
        backend: Backend::Cpu,
        envs,
        rounds,
        steps,
    };
    rows.extend(rows_of(&format!("env.cpu_depth_{envs}"), &case, None)?);
    let case = Case { scenario: &state, sees: Sees::Pixels, ..case };
    rows.extend(rows_of(&format!("env.cpu_pixels_{envs}"), &case, None)?);
    Ok(rows.into())
}

/// The paper's scenario with a square depth image for each action.
fn with_square_camera() -> anyhow::Result<Scenario> {
    let paper = Scenario::of(&[])?;
    let mut spec = (**paper.spec()).clone();
    if let CameraSpec::Paper(camera) = &mut spec.camera {
        let view = &mut camera.view;
        view.rate = view.rate.with_value(f64::from(CONTROL_HZ)).map_err(anyhow::Error::msg)?;
        view.width = view.width.with_value(SIDE).map_err(anyhow::Error::msg)?;
        view.height = view.height.with_value(SIDE).map_err(anyhow::Error::msg)?;
    }
    Ok(paper.with_spec(spec))
}

/// Images that the environments observe in each step.
#[derive(Clone, Copy, PartialEq)]
enum Sees {
    State,
    /// Depth; `stays`: on the device.
    Depth {
        stays: bool,
    },
    /// Colour pictures of both cameras, which stay on the device if the worlds move there.
    Pixels,
}

/// Environments whose steps are timed.
struct Case<'a> {
    scenario: &'a Scenario,
    sees: Sees,
    /// Worlds that are kept for resets.
    pool: Option<Pool>,
    backend: Backend,
    envs: u32,
    rounds: u32,
    /// Steps of a round.
    steps: u32,
}

fn rows_of(name: &str, case: &Case<'_>, target: Option<f64>) -> anyhow::Result<Vec<Row>> {
    let Case { envs, steps, .. } = *case;
    let depth = matches!(case.sees, Sees::Depth { .. });
    let pixels =
        (case.sees == Sees::Pixels).then_some(Pixels { height: PICTURE, width: PICTURE, hz: CONTROL_HZ });
    let spaces = Spaces { control_hz: CONTROL_HZ, depth, pixels, ..Spaces::default() };
    let settings = Settings { spaces, backend: case.backend, pool: case.pool, ..Settings::of(Task::Reach) };
    let mut env = TaskEnv::new(case.scenario, &settings, 0..envs)?;
    let stays = case.sees == Sees::Depth { stays: true } || case.sees == Sees::Pixels;
    if stays && case.backend == Backend::Gpu {
        env.keep_on_device(false)?;
    }
    let (all, mut draws) = (vec![true; envs as usize], Stream::new(SEED, 0, Purpose::Test));
    let size = env.interface().policy.action.len();
    let start = Instant::now();
    env.reset(&vec![Some(SEED); envs as usize], &all)?;
    let reset = start.elapsed().as_secs_f64() / f64::from(envs);
    let [mut rates, mut resetting] = [Vec::new(), Vec::new()];
    let mut turn = 0;
    let mut run = |env: &mut TaskEnv, resets: bool| {
        let start = Instant::now();
        for _ in 0..steps {
            if resets {
                turn += 1;
                let mask: Vec<bool> =
                    (0..envs as usize).map(|k| (k + turn).is_multiple_of(RESETTING)).collect();
                env.reset(&vec![None; envs as usize], &mask)?;
            }
            let actions: Vec<f32> =
                (0..envs as usize * size).map(|_| draws.uniform(-1.0, 1.0) as f32).collect();
            let goes_on: Vec<bool> =
                (0..envs as usize).map(|k| !(env.report(k).terminated || env.report(k).truncated)).collect();
            env.step(&actions, &goes_on)?;
            env.send()?;
        }
        anyhow::Ok(start.elapsed().as_secs_f64())
    };
    // The first round warms up.
    for round in 0..=case.rounds {
        for (rates, resets) in [(&mut rates, false), (&mut resetting, true)] {
            let seconds = run(&mut env, resets)?;
            if round > 0 {
                rates.push(f64::from(envs * steps) / seconds);
            }
        }
    }
    let (rates, resetting) = (Rounds::new(rates), Rounds::new(resetting));
    let place = if stays { ", which stay where they are drawn," } else { "" };
    let seen = match case.sees {
        Sees::State => "from state".to_owned(),
        Sees::Depth { .. } => format!("with depth images of {SIDE} x {SIDE}{place} in every step"),
        Sees::Pixels => format!("with two colour pictures of {PICTURE} x {PICTURE}{place} in every step"),
    };
    let place = env.tally().map_or("on the processor".to_owned(), |tally| {
        let calm = 100.0 * tally.calm as f64 / tally.total().max(1) as f64;
        let there = 100.0 * tally.share_on_device();
        format!("{there:.1} % of the frames on the device, {calm:.1} % calm: {:?}", tally.frames)
    });
    let note = format!("Reach-v1 {seen} at {CONTROL_HZ} Hz, distinct trees; {place}");
    let row = Row::measured(name, rates.median(), "steps/s");
    let row = target.map_or(row.clone(), |target| row.at_least(target));
    let resets = Row::measured(&format!("{name}.reset"), reset, "s");
    let of_reset = "wall time of a reset that grows a new tree, a world".to_owned();
    let mut rows = vec![
        Row { spread: Some(rates.spread()), note: Some(note), ..row },
        Row { note: Some(of_reset), ..resets },
    ];
    rows.extend(resetting_rows(name, &rates, &resetting, case));
    if case.backend == Backend::Gpu && case.sees == Sees::State {
        for (part, resets) in [("", false), (".resetting", true)] {
            for detail in [Detail::Parts, Detail::Kernels] {
                env.keep_profile(Some(detail));
                let seconds = run(&mut env, resets)?;
                rows.extend(step_rows(&format!("{name}{part}"), &env, detail, (seconds, steps)));
            }
        }
    }
    Ok(rows)
}

/// Rate with resets, and its share of that without.
fn resetting_rows(name: &str, rates: &Rounds, resetting: &Rounds, case: &Case<'_>) -> [Row; 2] {
    let tree = if case.pool.is_some() { "another kept tree" } else { "a new tree" };
    let note = format!(
        "one of {RESETTING} environments begins an episode with {tree} in each step; measured in turns with steps that reset none"
    );
    let rate = Row::measured(&format!("{name}.resetting"), resetting.median(), "steps/s");
    let share = resetting.median() / rates.median();
    let share = Row::measured(&format!("{name}.resetting.share"), share, "1");
    [
        Row { spread: Some(resetting.spread()), note: Some(note), ..rate },
        if case.backend == Backend::Gpu { share.at_least(RESETTING_SHARE) } else { share },
    ]
}

/// Parts of the mean step of all environments, all crews together: of a run in which the processor's parts are timed, or of one in which every kernel is.
fn step_rows(name: &str, env: &TaskEnv, detail: Detail, (seconds, steps): (f64, u32)) -> Vec<Row> {
    let Some(profile) = env.profile().filter(|profile| profile.rounds > 0) else { return Vec::new() };
    let row = |part: &str, seconds: f64, what: &str| {
        let row = Row::measured(&format!("{name}.step{part}"), 1e3 * seconds / f64::from(steps), "ms");
        Row { note: Some(format!("{what}, a step of all environments; {steps} steps")), ..row }
    };
    if detail == Detail::Kernels {
        let timed = profile.device.iter().map(|(kernel, seconds)| {
            row(&format!(".device.{kernel}"), *seconds, "time of the device by its own clock")
        });
        return timed.chain(contact_rows(name, &profile.solves)).collect();
    }
    let mut rows = vec![row("", seconds, "wall time where the processor's parts are timed")];
    let rounds = profile.rounds as f64 / f64::from(steps);
    let rounds = Row::measured(&format!("{name}.step.rounds"), rounds, "1");
    rows.push(Row {
        note: Some("rounds of the crews, in which each submits frames once, a step".to_owned()),
        ..rounds
    });
    for (part, seconds) in &profile.host {
        rows.push(row(&format!(".host.{part}"), *seconds, "wall time of the processor"));
    }
    rows
}

/// Contacts in the last substep, since the world with most of them is what the others wait for.
fn contact_rows(name: &str, solves: &[[u32; 2]]) -> [Row; 4] {
    let touching = solves.iter().filter(|[contacts, _]| *contacts > 0).count();
    let all: u32 = solves.iter().map(|[contacts, _]| contacts).sum();
    let most = |k: usize| f64::from(solves.iter().map(|numbers| numbers[k]).max().unwrap_or(0));
    let each = |number: f64| number / solves.len().max(1) as f64;
    [
        ("touching", each(touching as f64), "share of the worlds that have contact points"),
        ("mean", each(f64::from(all)), "contact points of a world"),
        ("most", most(0), "contact points of the world with most of them"),
        ("iterations", most(1), "Newton iterations of the world that needs most of them"),
    ]
    .map(|(part, number, what)| {
        let row = Row::measured(&format!("{name}.step.contacts.{part}"), number, "1");
        Row { note: Some(format!("{what}, in the last substep")), ..row }
    })
}
