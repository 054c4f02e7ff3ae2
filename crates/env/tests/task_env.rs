//! Task environments: the same bits alone and among others, the benchmark's ends, saved states, bad input.

use orchard_env::{EnvError, Pool, Settings, Task, TaskEnv};
use orchard_policy::{Spaces, Values};
use orchard_scenario::Scenario;
use std::ops::Range;

const SEED: u64 = 20250704;

fn env(settings: &Settings, worlds: Range<u32>) -> TaskEnv {
    let mut env = TaskEnv::new(&Scenario::of(&[]).unwrap(), settings, worlds).unwrap();
    let all = vec![true; env.len()];
    env.reset(&vec![Some(SEED); env.len()], &all).unwrap();
    env
}

/// Actions that differ by world and step.
fn actions(worlds: Range<u32>, size: usize, step: u32) -> Vec<f32> {
    let of = |world: u32| (0..size).map(move |i| ((world * 7 + step * 3 + i as u32) % 11) as f32 / 5.0 - 1.0);
    worlds.flat_map(of).collect()
}

fn step(env: &mut TaskEnv, worlds: Range<u32>, number: u32) {
    let (size, all) = (env.interface().policy.action.len(), vec![true; env.len()]);
    env.step(&actions(worlds, size, number), &all).unwrap();
}

#[test]
fn a_world_has_the_same_bits_alone_and_among_others_and_after_it_was_saved() {
    for task in Task::ALL {
        let spaces = Spaces { depth: true, ..Spaces::default() };
        let settings = Settings { spaces, ..Settings::of(task) };
        let (mut many, mut alone) = (env(&settings, 0..3), env(&settings, 2..3));
        assert_eq!((many.world(2), many.world(0)), (alone.world(0), Some((SEED, 0))));
        for number in 0..3 {
            assert_eq!(many.observation(2), alone.observation(0));
            assert_eq!(many.report(2), alone.report(0));
            step(&mut many, 0..3, number);
            step(&mut alone, 2..3, number);
        }
        assert_ne!(many.observation(0), many.observation(1));
        let saved = alone.snapshot().unwrap();
        step(&mut alone, 2..3, 3);
        let mut later = env(&settings, 2..3);
        later.restore(&saved).unwrap();
        assert_eq!(later.observation(0), many.observation(2));
        step(&mut later, 2..3, 3);
        assert_eq!(later.observation(0), alone.observation(0));
        assert_eq!(later.report(0), alone.report(0));
    }
}

#[test]
fn rest_ends_as_the_benchmark_ends_it_and_the_next_episode_has_another_world() {
    let spaces = Spaces { control_hz: 1, ..Spaces::default() };
    let mut env = env(&Settings { spaces, ..Settings::of(Task::Harvest) }, 0..1);
    let still = vec![0.0; env.interface().policy.action.len()];
    let mut steps = 0;
    while !(env.report(0).terminated || env.report(0).truncated) {
        env.step(&still, &[true]).unwrap();
        steps += 1;
    }
    // `rules.stall_time`.
    assert_eq!((steps, env.report(0).outcome.as_deref()), (15, Some("stalled")));
    assert!(!env.report(0).terminated && !env.report(0).is_success);
    assert!(matches!(env.step(&still, &[true]), Err(EnvError::Ended { env: 0 })));
    env.reset(&[None], &[true]).unwrap();
    assert_eq!(env.world(0), Some((SEED, orchard_env::WORLDS)));
    assert_eq!(env.report(0).statistics.length, 0);
}

/// A fault of sensors or hand would change nothing that a policy sees or does, so it is refused.
#[test]
fn faults_between_robot_and_controller_are_refused() {
    let scenario = Scenario::of(&[]).unwrap();
    let of = |kind: &str| {
        let fault = format!("[fault]\nbase = 'standard'\nkind = '{kind}'").parse().unwrap();
        let scenario = scenario.with_spec(scenario.spec().overlaid("x", fault).unwrap());
        TaskEnv::new(&scenario, &Settings::of(Task::Harvest), 0..1).err().map(|e| e.to_string())
    };
    let said = of("camera_dead").unwrap();
    assert!(
        said.contains("fault") && said.contains("camera_dead") && said.contains("weight_on_arm"),
        "{said}"
    );
    assert_eq!(of("weight_on_arm"), None);
}

#[test]
fn bad_input_changes_nothing() {
    let settings = Settings::of(Task::Harvest);
    let mut env = env(&settings, 0..2);
    let size = env.interface().policy.action.len();
    let mut action = vec![0.0; 2 * size];
    action[size] = f32::NAN;
    let before = env.snapshot().unwrap();
    let said = env.step(&action, &[true; 2]).unwrap_err().to_string();
    assert!(said.starts_with("action of environment 1: ") && said.contains("NaN"), "{said}");
    let said = env.step(&action[1..], &[true; 2]).unwrap_err().to_string();
    assert_eq!(said, format!("{} numbers of actions for 2 environments", 2 * size - 1));
    assert!(env.reset(&[None], &[true; 2]).is_err() && env.restore(&before[..1]).is_err());
    assert_eq!(env.snapshot().unwrap(), before);
    // The numbers of an environment that does not step are not looked at.
    env.step(&action, &[true, false]).unwrap();
    let mut damaged = before.clone();
    damaged[1].truncate(100);
    assert!(env.restore(&damaged).unwrap_err().to_string().starts_with("state of environment 1: "));
}

#[test]
fn the_tool_is_told_where_it_is() {
    let robots = ["ridgeback-fr3", "fr3-fixed", "rail-xarm6-suction", "husky-ur5e-2f85"];
    for robot in robots {
        let scenario = Scenario::of(&[("robot", robot)]).unwrap();
        let mut env = TaskEnv::new(&scenario, &Settings::of(Task::Harvest), 0..1).unwrap();
        env.reset(&[Some(SEED)], &[true]).unwrap();
        let size = env.interface().policy.action.len();
        for number in 0..3 {
            let at = env.interface().policy.observation.iter().position(|field| field.key == "tool_pose");
            let Some(Values::F32(pose)) = at.map(|at| env.observation(0)[at].clone()) else {
                panic!("{robot}")
            };
            let world = env.truth(0).unwrap().unwrap();
            let truth = world.x_world_odom().inverse() * world.handle().x_world_tcp(world.data());
            let (p, q) = (truth.translation.vector, truth.rotation.coords);
            let p_error = (0..3).map(|k| (f64::from(pose[k]) - p[k]).abs()).fold(0.0, f64::max);
            let alike: f64 = (0..4).map(|k| f64::from(pose[3 + k]) * q[k]).sum();
            assert!(
                p_error < 1e-5 && alike.abs() > 1.0 - 1e-6 && pose[6] >= 0.0,
                "{robot}: {pose:?} {truth}"
            );
            env.step(&actions(0..1, size, number), &[true]).unwrap();
        }
    }
}

/// A kept start is that of a world that was just grown, and so is what follows.
#[test]
fn episodes_of_a_pool_have_the_bits_of_its_worlds() {
    for task in Task::ALL {
        let settings = Settings::of(task);
        let kept = Settings { pool: Some(Pool { trees: 2, seed: SEED }), ..settings.clone() };
        let mut pool = TaskEnv::new(&Scenario::of(&[]).unwrap(), &kept, 0..3).unwrap();
        // With a seed that the number of trees divides the first episodes are those of the pool's first worlds.
        pool.reset(&[Some(4); 3], &[true; 3]).unwrap();
        let mut own = env(&settings, 0..2);
        for episode in 0..2 {
            for number in 0..2 {
                assert_eq!([0, 1, 2].map(|k| pool.world(k)), [0, 1, 0].map(|k| Some((SEED, k))));
                for (kept, grown) in [(0, 0), (1, 1), (2, 0)] {
                    assert_eq!(pool.observation(kept), own.observation(grown), "{task:?} {episode} {number}");
                    assert_eq!(pool.report(kept), own.report(grown));
                }
                let size = own.interface().policy.action.len();
                let two = actions(0..2, size, number);
                own.step(&two, &[true; 2]).unwrap();
                pool.step(&[&two[..], &two[..size]].concat(), &[true; 3]).unwrap();
            }
            if episode == 0 {
                // The next episodes begin in the other world each; those after them in these.
                pool.reset(&[None; 3], &[true; 3]).unwrap();
                assert_eq!([0, 1, 2].map(|k| pool.world(k)), [1, 0, 1].map(|k| Some((SEED, k))));
                pool.reset(&[None; 3], &[true; 3]).unwrap();
                own.reset(&[Some(SEED); 2], &[true; 2]).unwrap();
            }
        }
        let saved = pool.snapshot().unwrap();
        let mut later = TaskEnv::new(&Scenario::of(&[]).unwrap(), &kept, 0..3).unwrap();
        later.restore(&saved).unwrap();
        assert_eq!((later.observation(1), later.world(1)), (pool.observation(1), pool.world(1)));
        // They belong to the pool.
        assert!(env(&settings, 0..3).restore(&saved).is_err());
    }
}
