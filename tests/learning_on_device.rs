//! Task environments whose worlds move on a graphics device.

use orchard_env::{Backend, Env, EnvError, Settings, Task, TaskEnv};
use orchard_policy::{Spaces, Values};
use orchard_scenario::Scenario;

use crate::steppers::testing::device;

const SEED: u64 = 20_250_704;

fn env(task: Task, backend: Backend, envs: u32) -> TaskEnv {
    started(Settings { backend, ..Settings::of(task) }, envs)
}

/// Environments that see depth images.
fn seeing(backend: Backend, envs: u32) -> TaskEnv {
    let spaces = Spaces { depth: true, ..Spaces::default() };
    started(Settings { backend, spaces, ..Settings::of(Task::Reach) }, envs)
}

fn started(settings: Settings, envs: u32) -> TaskEnv {
    started_in(&Scenario::of(&[]).unwrap(), settings, envs)
}

fn started_in(scenario: &Scenario, settings: Settings, envs: u32) -> TaskEnv {
    let mut env = TaskEnv::new(scenario, &settings, 0..envs).unwrap();
    env.reset(&vec![Some(SEED); envs as usize], &vec![true; envs as usize]).unwrap();
    env
}

/// Largest difference of two observations.
fn apart(a: &[Values], b: &[Values]) -> f32 {
    let numbers = |values: &[Values]| -> Vec<f32> {
        let floats =
            values.iter().filter_map(|value| if let Values::F32(x) = value { Some(x) } else { None });
        floats.flatten().copied().collect()
    };
    let (a, b) = (numbers(a), numbers(b));
    assert_eq!(a.len(), b.len());
    a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

/// Every task gives what it gives on the CPU, but for rounding, while the robot touches nothing; a reset of one environment, which gets another tree, leaves the others as they are.
#[test]
fn observations_and_rewards_are_those_of_the_cpu() {
    if device().is_none() {
        return;
    }
    for task in Task::ALL {
        let (mut here, mut there) = (env(task, Backend::Cpu, 2), env(task, Backend::Gpu, 2));
        let size = here.interface().policy.action.len();
        let actions: Vec<f32> = (0..2 * size).map(|i| (i % 5) as f32 / 10.0 - 0.2).collect();
        for step in 0..4 {
            for env in [&mut here, &mut there] {
                env.step(&actions, &[true; 2]).unwrap();
                if step == 1 {
                    env.reset(&[None; 2], &[false, true]).unwrap();
                }
            }
            for k in 0..2 {
                assert_eq!(here.world(k), there.world(k));
                let off = apart(here.observation(k), there.observation(k));
                assert!(off < 1e-3, "{task:?}, step {step}, environment {k}: {off}");
                let off = here.report(k).reward - there.report(k).reward;
                assert!(off.abs() < 1e-4, "{task:?}, step {step}, environment {k}: {off}");
            }
        }
        assert!(there.tally().unwrap().share_on_device() > 0.99, "{:?}", there.tally());
        assert!(here.tally().is_none());
    }
}

/// The device draws the images: those of the first worlds, of later steps, and after a reset show what the processor's show, but for pixels at silhouettes.
#[test]
fn images_are_those_of_the_cpu() {
    if device().is_none() {
        return;
    }
    let (mut here, mut there) = (seeing(Backend::Cpu, 2), seeing(Backend::Gpu, 2));
    let field = here.interface().policy.observation.iter().position(|field| field.key == "depth").unwrap();
    let image = |env: &TaskEnv, k: usize| match &env.observation(k)[field] {
        Values::F32(depth) => depth.clone(),
        other => panic!("{other:?}"),
    };
    let actions = vec![0.3; 2 * here.interface().policy.action.len()];
    for step in 0..4 {
        for k in 0..2 {
            let (a, b) = (image(&here, k), image(&there, k));
            let differ = a.iter().zip(&b).filter(|(a, b)| (*a - *b).abs() > 1e-4).count();
            assert!(a.iter().filter(|z| **z > 0.0).count() > 1000, "step {step}: nothing is in view");
            assert!(1000 * differ <= a.len(), "step {step}, environment {k}: {differ} pixels differ");
            // Drawn in f32.
            assert!(a != b, "step {step}, environment {k}: the processor drew both");
        }
        for env in [&mut here, &mut there] {
            env.step(&actions, &[true; 2]).unwrap();
            if step == 2 {
                env.reset(&[None; 2], &[false, true]).unwrap();
            }
        }
    }
}

/// The device adds the errors of a stereo camera, too: with the same random numbers, so that only pixels at silhouettes differ.
#[test]
fn images_of_a_stereo_camera_are_those_of_the_cpu() {
    if device().is_none() {
        return;
    }
    let scenario = Scenario::of(&[("camera", "d435i")]).unwrap();
    let images = [Backend::Cpu, Backend::Gpu].map(|backend| {
        let spaces = Spaces { depth: true, ..Spaces::default() };
        let mut env = started_in(&scenario, Settings { backend, spaces, ..Settings::of(Task::Reach) }, 1);
        let hold = vec![0.0; env.interface().policy.action.len()];
        // The first image comes after its latency.
        for _ in 0..2 {
            env.step(&hold, &[true]).unwrap();
        }
        let field = env.interface().policy.observation.iter().position(|field| field.key == "depth").unwrap();
        let Values::F32(depth) = &env.observation(0)[field] else { panic!("no depth") };
        depth.clone()
    });
    let differ = images[0].iter().zip(&images[1]).filter(|(a, b)| a != b).count();
    assert!(images[0].iter().filter(|z| **z > 0.0).count() > 10_000);
    assert!(10_000 * differ <= images[0].len(), "{differ} pixels differ");
}

#[test]
fn an_environment_goes_on_with_the_same_bits_from_a_saved_state() {
    if device().is_none() {
        return;
    }
    let mut first = seeing(Backend::Gpu, 2);
    let actions = vec![0.3; 2 * first.interface().policy.action.len()];
    first.step(&actions, &[true; 2]).unwrap();
    let saved = first.snapshot().unwrap();
    let mut second = seeing(Backend::Gpu, 2);
    second.restore(&saved).unwrap();
    assert_eq!(first.observation(0), second.observation(0));
    for _ in 0..3 {
        first.step(&actions, &[true; 2]).unwrap();
        second.step(&actions, &[true; 2]).unwrap();
    }
    for k in 0..2 {
        assert_eq!(first.observation(k), second.observation(k));
        assert_eq!(first.report(k), second.report(k));
    }
}

#[test]
fn worlds_that_a_device_cannot_step_are_refused() {
    if device().is_none() {
        return;
    }
    let stems = Scenario::of(&[("preset", "calibrated")]).unwrap();
    let e = Env::new(&stems, 1, 0..1, Backend::Gpu).unwrap_err();
    assert!(matches!(&e, EnvError::Device(why) if why.contains("fruit.stem")), "{e}");
    let mut env = Env::new(&Scenario::of(&[]).unwrap(), 1, 0..2, Backend::Gpu).unwrap();
    let hold = vec![Scenario::of(&[]).unwrap().robot().start_command(); 2];
    env.step(&hold).unwrap();
    assert_eq!(env.worlds()[1].frame(), 1);
    assert!(env.step(&hold[..1]).is_err());
}
