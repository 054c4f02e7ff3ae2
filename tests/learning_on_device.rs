//! Task environments whose worlds move on a graphics device.

use std::path::Path;
use std::sync::Once;
use std::sync::atomic::AtomicBool;

use orchard_bench::task::Task as _;
use orchard_env::{Backend, Driven, Env, Pool, Settings, Task, TaskEnv, Via};
use orchard_lockstep::{Berths, Share};
use orchard_policy::{Spaces, Values};
use orchard_scenario::Scenario;
use orchard_tasks::component::{Component, ComponentPlan, Gentle, TrialOutcome, Trials};
use orchard_tasks::stage::Processor;

use crate::steppers::testing::device;

/// True if there is a device. From the first call on an environment keeps it open, so that all tests share its kernels.
#[track_caller]
pub(crate) fn has_device() -> bool {
    static OPEN: Once = Once::new();
    let is_there = device().is_some();
    if is_there {
        OPEN.call_once(|| std::mem::forget(env(Task::Reach, Backend::Gpu, 1)));
    }
    is_there
}

pub(crate) const SEED: u64 = 20_250_704;

pub(crate) fn env(task: Task, backend: Backend, envs: u32) -> TaskEnv {
    started(Settings { backend, ..Settings::of(task) }, envs)
}

/// Environments that see depth images.
pub(crate) fn seeing(scenario: &Scenario, backend: Backend, envs: u32) -> TaskEnv {
    let spaces = Spaces { depth: true, ..Spaces::default() };
    started_in(scenario, Settings { backend, spaces, ..Settings::of(Task::Reach) }, envs)
}

fn started(settings: Settings, envs: u32) -> TaskEnv {
    started_in(&Scenario::of(&[]).unwrap(), settings, envs)
}

pub(crate) fn started_in(scenario: &Scenario, settings: Settings, envs: u32) -> TaskEnv {
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
    if !has_device() {
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
        let tally = there.tally().unwrap();
        assert!(tally.share_on_device() > 0.99 && tally.calm > 0, "{task:?}: {tally:?}");
        assert!(here.tally().is_none());
        // Wood and fruit that were behind are there when they are looked at.
        assert_eq!(there.snapshot().unwrap().len(), 2);
        for k in 0..2 {
            let places = |env: &mut TaskEnv| {
                let world = env.truth(k).unwrap().unwrap();
                world.fruit_truth().iter().map(|fruit| fruit.p_world).collect::<Vec<_>>()
            };
            for (a, b) in places(&mut here).iter().zip(places(&mut there)) {
                assert!((a - b).norm() < 1e-4, "{task:?}: {a} {b}");
            }
        }
    }
}

/// Episodes on threads of their own, each in a berth, go on as on the CPU under a controller and under actions.
#[test]
fn episodes_in_berths_are_those_of_the_cpu() {
    const STEPS: usize = 4;
    let Some(gpu) = device() else { return };
    let scenario = Scenario::of(&[("controller", "expert")]).unwrap();
    let settings = Settings::of(Task::Reach);
    let share = Share { condition: "reach", scenario: &scenario, episodes: 2 };
    let berths = Berths::new(&gpu, &[share], 2, 1).unwrap();
    let play = |mut env: TaskEnv, via: Via| -> (TaskEnv, Vec<Driven>) {
        env.reset(&[Some(SEED)], &[true]).unwrap();
        let mut controller = env.controller(0).unwrap();
        let driven = (0..STEPS).map(|_| env.drive(0, &mut *controller, via).unwrap()).collect();
        let action = vec![0.1; env.interface().policy.action.len()];
        env.step(&action, &[true]).unwrap();
        (env, driven)
    };
    std::thread::scope(|scope| {
        for (world, via) in [(0, Via::Commands), (1, Via::Actions)] {
            let (berths, scenario, settings) = (&berths, &scenario, &settings);
            scope.spawn(move || {
                let there = TaskEnv::in_berth(scenario, settings, world, berths.take("reach")).unwrap();
                let here = TaskEnv::new(scenario, settings, world..world + 1).unwrap();
                let ((there, driven), (here, expected)) = (play(there, via), play(here, via));
                assert_eq!(there.world(0), here.world(0));
                let off = apart(there.observation(0), here.observation(0));
                assert!(off < 1e-3, "world {world}: {off}");
                for (own, expected) in driven.iter().zip(&expected) {
                    let pairs = own.action.iter().zip(&expected.action);
                    let off = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
                    assert!(off < 1e-3, "world {world}: {off}");
                }
            });
        }
    });
    let (tally, frames) = (berths.tally(), 2 * (STEPS as u64 + 1) * 6);
    assert_eq!((tally.total(), tally.share_on_device()), (frames, 1.0), "{tally:?}");
    assert!(berths.refused().is_empty() && berths.lost().is_none());
}

/// A robot with more colliders than the kernels know takes berths beside the device, and says so.
#[test]
fn robots_that_a_device_cannot_step_are_beside_it() {
    let Some(gpu) = device() else { return };
    let (own, robot) = (Path::new(env!("CARGO_TARGET_TMPDIR")), Path::new("assets/robots/fr3-fixed"));
    let robot = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().join(robot);
    let folder = own.join("many-colliders");
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::copy(robot.join("robot.toml"), folder.join("robot.toml")).unwrap();
    let urdf = std::fs::read_to_string(robot.join("robot.urdf")).unwrap();
    let knob =
        r#"<collision><origin xyz="0 0 0.1"/><geometry><box size="0.02 0.02 0.02"/></geometry></collision>"#;
    let urdf = urdf.replacen("<collision>", &format!("{}<collision>", knob.repeat(30)), 1);
    std::fs::write(folder.join("robot.urdf"), urdf).unwrap();
    let scenario = Scenario::of(&[("robot", folder.to_str().unwrap())]).unwrap();
    let share = Share { condition: "nominal", scenario: &scenario, episodes: 1 };
    let berths = Berths::new(&gpu, &[share], 1, 1).unwrap();
    let [(condition, why)] = berths.refused() else { panic!("{:?}", berths.refused()) };
    assert!(condition == "nominal" && why.to_string().contains("colliders"), "{why}");
    let mut berth = berths.take("nominal");
    let world = scenario.world(SEED, 0, 0).unwrap();
    berth.enter(&world).unwrap();
    let world = berth.step(Box::new(world), &scenario.robot().start_command());
    assert_eq!((world.frame(), berths.tally().frames["refused"]), (1, 1));
}

/// The trials of a tree in a berth are those of the processor, each from the world's start.
#[test]
fn trials_in_berths_are_those_of_the_processor() {
    let Some(gpu) = device() else { return };
    let scenario = Scenario::of(&[("controller", "expert")]).unwrap();
    let mut plan = ComponentPlan::new(scenario, "quick", vec![SEED], 1).unwrap();
    let rules = &mut plan.protocol.component.gentle;
    rules.time = rules.time.with_value(1.0).unwrap();
    rules.targets = rules.targets.with_value(2).unwrap();
    let share = Share { condition: Gentle::NAME, scenario: &plan.scenario, episodes: 1 };
    let berths = Berths::new(&gpu, &[share], 1, 1).unwrap();
    let stop = AtomicBool::new(false);
    let [key] = &plan.keys(Gentle::NAME)[..] else { panic!("there is one tree") };
    let there = Trials::<Gentle, _>::of(&plan, &berths).compute(key, &stop, &mut || ()).unwrap().unwrap();
    let here = Trials::<Gentle, _>::of(&plan, &Processor).compute(key, &stop, &mut || ()).unwrap().unwrap();
    assert_eq!(here.trials.len(), 2);
    for (own, expected) in there.trials.iter().zip(&here.trials) {
        assert_eq!((own.frames, &own.ended), (60, &TrialOutcome::TimeOver));
        assert!(own.path_m > 0.1 && (own.path_m - expected.path_m).abs() < 1e-3, "{own:?}, {expected:?}");
    }
    assert_eq!((berths.tally().total(), berths.tally().share_on_device()), (120, 1.0));
}

/// Trees as measured, with dampers by ratio and fruit in clusters on stems that bend, give what they give on the CPU while the robot touches nothing.
#[test]
fn measured_trees_move_as_on_the_cpu() {
    if !has_device() {
        return;
    }
    for preset in ["measured-wood", "calibrated", "vertical-ufo"] {
        let scenario = Scenario::of(&[("preset", preset)]).unwrap();
        let of = |backend| started_in(&scenario, Settings { backend, ..Settings::of(Task::Reach) }, 1);
        let (mut here, mut there) = (of(Backend::Cpu), of(Backend::Gpu));
        let actions = vec![0.2; here.interface().policy.action.len()];
        for step in 0..4 {
            for env in [&mut here, &mut there] {
                env.step(&actions, &[true]).unwrap();
            }
            let off = apart(here.observation(0), there.observation(0));
            assert!(off < 1e-3, "{preset}, step {step}: {off}");
        }
        let tally = there.tally().unwrap();
        assert!(tally.share_on_device() > 0.99 && tally.calm > 0, "{preset}: {tally:?}");
        let fruit = |env: &mut TaskEnv| env.truth(0).unwrap().unwrap().fruit_truth();
        for (a, b) in fruit(&mut here).iter().zip(fruit(&mut there)) {
            assert!((a.p_world - b.p_world).norm() < 1e-4, "{preset}: {a:?} {b:?}");
        }
    }
}

/// In wind trees sway as on the CPU while one environment waits for the other, also after a reset, and calm frames leave them behind.
#[test]
fn trees_in_wind_sway_as_on_the_cpu() {
    if !has_device() {
        return;
    }
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join("windy.toml");
    let speed = r#"{ value = 6.0, range = [0.0, 12.0], unit = "m/s", source = "test" }"#;
    let text = format!("preset = \"windy\"\nbase = \"measured-wood\"\n[wind]\nspeed = {speed}\n");
    std::fs::write(&file, text).unwrap();
    let scenario = Scenario::of(&[("config", file.to_str().unwrap())]).unwrap();
    let of = |backend| started_in(&scenario, Settings { backend, ..Settings::of(Task::Reach) }, 2);
    let (mut here, mut there) = (of(Backend::Cpu), of(Backend::Gpu));
    let actions = vec![0.2; 2 * here.interface().policy.action.len()];
    for step in 0..5 {
        for env in [&mut here, &mut there] {
            env.step(&actions, &[true, step != 1]).unwrap();
            if step == 2 {
                env.reset(&[None; 2], &[true, false]).unwrap();
            }
        }
    }
    let tally = there.tally().unwrap();
    assert!(tally.share_on_device() == 1.0 && tally.calm > 0, "{tally:?}");
    for k in 0..2 {
        assert!(there.truth(k).unwrap().unwrap().weather().is_some());
        let fruit = |env: &mut TaskEnv| env.truth(k).unwrap().unwrap().fruit_truth();
        for (a, b) in fruit(&mut here).iter().zip(fruit(&mut there)) {
            assert!((a.p_world - b.p_world).norm() < 1e-4, "environment {k}: {a:?} {b:?}");
        }
    }
}

/// The device draws the images: those of the first worlds, of later steps, and after a reset show what the processor's show, but for pixels at silhouettes; over level and over uneven ground.
#[test]
fn images_are_those_of_the_cpu() {
    if !has_device() {
        return;
    }
    let level = Scenario::of(&[]).unwrap();
    let mut spec = (**level.spec()).clone();
    spec.terrain.enabled = true;
    spec.terrain.amplitude = spec.terrain.amplitude.with_value(0.1).unwrap();
    for scenario in [level.with_spec(spec), level] {
        let on = if scenario.spec().terrain.enabled { "uneven ground" } else { "level ground" };
        let (mut here, mut there) = (seeing(&scenario, Backend::Cpu, 2), seeing(&scenario, Backend::Gpu, 2));
        let field =
            here.interface().policy.observation.iter().position(|field| field.key == "depth").unwrap();
        let image = |env: &TaskEnv, k: usize| match &env.observation(k)[field] {
            Values::F32(depth) => depth.clone(),
            other => panic!("{other:?}"),
        };
        let actions = vec![0.3; 2 * here.interface().policy.action.len()];
        for step in 0..4 {
            for k in 0..2 {
                let (a, b) = (image(&here, k), image(&there, k));
                let differ = a.iter().zip(&b).filter(|(a, b)| (*a - *b).abs() > 1e-4).count();
                assert!(
                    a.iter().filter(|z| **z > 0.0).count() > 1000,
                    "{on}, step {step}: nothing is in view"
                );
                assert!(
                    1000 * differ <= a.len(),
                    "{on}, step {step}, environment {k}: {differ} pixels differ"
                );
                // Drawn in f32.
                assert!(a != b, "{on}, step {step}, environment {k}: the processor drew both");
            }
            for env in [&mut here, &mut there] {
                env.step(&actions, &[true; 2]).unwrap();
                if step == 2 {
                    env.reset(&[None; 2], &[false, true]).unwrap();
                }
            }
        }
        let tally = there.tally().unwrap();
        assert!(tally.share_on_device() > 0.99, "{on}: {tally:?}");
    }
}

#[test]
fn an_environment_goes_on_with_the_same_bits_from_a_saved_state() {
    if !has_device() {
        return;
    }
    let level = Scenario::of(&[]).unwrap();
    let mut first = seeing(&level, Backend::Gpu, 2);
    let actions = vec![0.3; 2 * first.interface().policy.action.len()];
    first.step(&actions, &[true; 2]).unwrap();
    let saved = first.snapshot().unwrap();
    let mut second = seeing(&level, Backend::Gpu, 2);
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

/// Worlds of a pool that come into lanes again have the bits that they have in lanes for the first time, whatever was there between.
#[test]
fn kept_starts_have_the_same_bits_in_every_lane() {
    if !has_device() {
        return;
    }
    let settings = Settings { backend: Backend::Gpu, ..Settings::of(Task::Reach) };
    let kept = Settings { pool: Some(Pool { trees: 2, seed: SEED }), ..settings.clone() };
    let mut fresh = started(settings, 2);
    // The seed is even, so that the first episodes begin in the pool's worlds 0 and 1, the second ones in 1 and 0.
    let mut pool = started(kept, 2);
    let size = fresh.interface().policy.action.len();
    let action = vec![0.5; 2 * size];
    fresh.step(&action, &[true; 2]).unwrap();
    for episode in 0..3 {
        pool.step(&action, &[true; 2]).unwrap();
        for k in 0..2 {
            let of = (k + episode) % 2;
            assert_eq!(pool.world(k), Some((SEED, of as u32)));
            assert_eq!((pool.observation(k), pool.report(k)), (fresh.observation(of), fresh.report(of)));
        }
        pool.reset(&[None; 2], &[true; 2]).unwrap();
    }
}

#[test]
fn commands_for_some_worlds_alone_are_refused() {
    if !has_device() {
        return;
    }
    let mut env = Env::new(&Scenario::of(&[]).unwrap(), 1, 0..2, Backend::Gpu).unwrap();
    let hold = vec![Scenario::of(&[]).unwrap().robot().start_command(); 2];
    env.step(&hold).unwrap();
    assert_eq!(env.worlds()[1].frame(), 1);
    assert!(env.step(&hold[..1]).is_err());
}
