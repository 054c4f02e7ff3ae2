//! Suite `env`: speed and memory of the learning environments.

use std::process::{Command, Stdio};

use orchard_env::{Settings, Task, TaskEnv};
use orchard_policy::{Pixels, Spaces};
use orchard_scaling::{processor_time, resident_bytes};
use orchard_scenario::Scenario;
use orchard_spec::camera::CameraSpec;
use orchard_spec::{Purpose, Stream};

use crate::rows::{Effort, Measured, Rounds, Row};

/// Seed of worlds and actions.
const SEED: u64 = 20250704;
/// Targets: control steps a second of one core, and the memory of 256 worlds in 24 GiB, a world \[MiB\].
const STATE: f64 = 400.0;
const DEPTH: f64 = 150.0;
const PIXELS: f64 = 100.0;
const MEMORY: f64 = 24.0 * 1024.0 / 256.0;

/// Largest time that Python may take on top of a native step, as a share of it.
const BINDING: f64 = 0.02;
/// Measures it: environments, rounds, steps -> share. The first steps take longer, so that a shorter measurement would say nothing.
const BINDING_SIZE: [&str; 3] = ["4", "5", "50"];
const BINDING_PY: &str = include_str!("binding.py");

/// Size of a measurement.
struct Size {
    rounds: u32,
    /// Steps of a round, and environments.
    steps: u32,
    envs: u32,
    /// Environments whose memory is measured.
    many: u32,
}

/// Measures the environments.
pub fn measure(effort: Effort) -> anyhow::Result<Measured> {
    let size = match effort {
        Effort::Full => Size { rounds: 5, steps: 50, envs: 4, many: 32 },
        Effort::Quick => Size { rounds: 1, steps: 2, envs: 1, many: 2 },
    };
    let paper = Scenario::of(&[])?;
    let mut spec = (**paper.spec()).clone();
    if let CameraSpec::Paper(camera) = &mut spec.camera {
        camera.view.rate = camera
            .view
            .rate
            .with_value(f64::from(Spaces::default().control_hz))
            .map_err(anyhow::Error::msg)?;
    }
    let at_10_hz = paper.with_spec(spec);
    // Before other environments leave free memory behind.
    let memory = memory(&paper, size.many)?;
    let depth = Spaces { depth: true, ..Spaces::default() };
    let pixels = Spaces { pixels: Some(Pixels::default()), ..Spaces::default() };
    let rows = [
        ("env.state", &paper, Spaces::default(), STATE),
        ("env.depth", &at_10_hz, depth, DEPTH),
        ("env.pixels", &paper, pixels, PIXELS),
    ];
    let mut measured = Vec::new();
    for (name, scenario, spaces, target) in rows {
        let rates = rates(scenario, spaces, &size)?;
        let row = Row::measured(name, rates.median(), "steps/s").at_least(target);
        measured.push(Row { spread: Some(rates.spread()), ..row });
    }
    if let Some(memory) = memory {
        measured.push(Row::measured("env.memory", memory, "MiB").at_most(MEMORY));
    }
    measured.push(match binding() {
        Ok(share) => Row::measured("env.binding", share, "1").at_most(BINDING),
        Err(why) => Row { note: Some(why), ..Row::measured("env.binding", f64::NAN, "1") },
    });
    Ok(measured.into())
}

/// Measures the time that the Python package takes on top of a native step; the error gives the reason why it cannot be measured.
fn binding() -> Result<f64, String> {
    let script = [&["-c", BINDING_PY][..], &BINDING_SIZE].concat();
    let done = Command::new("python3").args(script).stdin(Stdio::null()).output();
    let done = done.map_err(|e| format!("python3: {e}"))?;
    let (said, problem) = (String::from_utf8_lossy(&done.stdout), String::from_utf8_lossy(&done.stderr));
    said.trim().parse().map_err(|_| {
        let last = problem.lines().last().unwrap_or("it printed no number");
        format!("not measured, python3 with the package orchardbench is needed: {last}")
    })
}

/// Control steps a second of processor time, round by round; each round begins new episodes.
fn rates(scenario: &Scenario, spaces: Spaces, size: &Size) -> anyhow::Result<Rounds> {
    let settings = Settings { spaces, ..Settings::of(Task::Harvest) };
    let mut env = TaskEnv::new(scenario, &settings, 0..size.envs)?;
    let mut draws = Stream::new(SEED, 0, Purpose::Test);
    let all = vec![true; env.len()];
    let numbers = env.len() * env.interface().policy.action.len();
    let mut rates = Vec::new();
    for _ in 0..size.rounds {
        env.reset(&vec![Some(SEED); env.len()], &all)?;
        let start = processor_time();
        for _ in 0..size.steps {
            let actions: Vec<f32> = (0..numbers).map(|_| draws.uniform(-1.0, 1.0) as f32).collect();
            env.step(&actions, &all)?;
        }
        let spent = (processor_time() - start).as_secs_f64();
        rates.push(f64::from(size.envs * size.steps) / spent);
    }
    Ok(Rounds::new(rates))
}

/// Memory of one of many environments after a step \[MiB\], where the system reports it.
fn memory(scenario: &Scenario, many: u32) -> anyhow::Result<Option<f64>> {
    let mut env = TaskEnv::new(scenario, &Settings::of(Task::Harvest), 0..many)?;
    let Some(before) = resident_bytes() else { return Ok(None) };
    let all = vec![true; env.len()];
    env.reset(&vec![Some(SEED); env.len()], &all)?;
    env.step(&vec![0.0; env.len() * env.interface().policy.action.len()], &all)?;
    Ok(resident_bytes().map(|after| (after - before) / f64::from(many) / f64::from(1 << 20)))
}
