//! Images that a graphics device draws of environments and worlds: depth, and colour.

use orchard_env::{Backend, Pool, Settings, Task, TaskEnv};
use orchard_lockstep::Eyes;
use orchard_policy::{Pixels, Spaces, Values};
use orchard_robot::Command;
use orchard_scenario::Scenario;
use orchard_world::World;

use crate::learning_on_device::{SEED, env, has_device, started_in};
use crate::steppers::testing::device;

/// Arrays on the device have the bits of the observations that are read back, after each step, after a reset of one environment, from a saved state; with a camera without errors, whose images stay there, and with one whose errors are
/// added here.
#[test]
fn observations_that_stay_on_the_device_have_the_same_bits() {
    if !has_device() {
        return;
    }
    // Pictures whose rows have whole words stay there, others are sent.
    for (camera, width) in [(&[][..], 6), (&[("camera", "d435i")], 5)] {
        let scenario = Scenario::of(camera).unwrap();
        let pixels = Some(Pixels { height: 6, width, hz: 30 });
        let spaces = Spaces { depth: true, pixels, description: true, ..Spaces::default() };
        let settings =
            Settings { backend: Backend::Gpu, spaces, privileged: true, ..Settings::of(Task::Reach) };
        let (seeds, all) = ([Some(SEED); 2], [true; 2]);
        let has_colour = |env: &TaskEnv, key: &str| {
            let field = env.interface().policy.observation.iter().position(|field| field.key == key).unwrap();
            matches!(&env.observation(1)[field], Values::U8(bytes) if bytes.iter().any(|byte| *byte > 30))
        };
        let [mut here, mut there] = [(); 2].map(|()| TaskEnv::new(&scenario, &settings, 0..2).unwrap());
        // Memory that others can open where the driver has it.
        if there.keep_on_device(true).is_err() {
            there.keep_on_device(false).unwrap();
        }
        for env in [&mut here, &mut there] {
            env.reset(&seeds, &all).unwrap();
        }
        let actions = vec![0.3; 2 * here.interface().policy.action.len()];
        let steps = if camera.is_empty() { 4 } else { 2 };
        for step in 0..steps {
            agree(&here, &mut there, step);
            if step == 1 {
                // Other arrays: what lay in the former ones goes along.
                there.keep_on_device(false).unwrap();
                agree(&here, &mut there, step);
            }
            if step == steps - 2 {
                let saved = here.snapshot().unwrap();
                for env in [&mut here, &mut there] {
                    env.restore(&saved).unwrap();
                }
                agree(&here, &mut there, step);
            }
            for env in [&mut here, &mut there] {
                env.step(&actions, &all).unwrap();
                if step == steps - 1 {
                    env.reset(&[None; 2], &[false, true]).unwrap();
                }
            }
        }
        let measured = agree(&here, &mut there, steps);
        assert!(["pixels_wrist", "pixels_base"].into_iter().all(|key| has_colour(&here, key)));
        assert!(measured > 1000, "{camera:?}: {measured} pixels have a depth");
    }
}

/// Compares the observations of environments with the arrays of others; returns the number of pixels that have a depth.
fn agree(here: &TaskEnv, there: &mut TaskEnv, step: usize) -> usize {
    let mut measured = 0;
    there.send().unwrap();
    let fields = here.interface().policy.observation.clone();
    for (i, (field, array)) in fields.iter().zip(there.device_arrays().unwrap()).enumerate() {
        let expected: Vec<u8> = (0..2)
            .flat_map(|k| match &here.observation(k)[i] {
                Values::F32(numbers) => numbers.iter().flat_map(|x| x.to_le_bytes()).collect(),
                Values::U8(bytes) => bytes.clone(),
                Values::Text(_) => Vec::new(),
            })
            .collect();
        let found = array.as_ref().map(|array| array.read().unwrap()).unwrap_or_default();
        assert!(found == expected, "{} differs after step {step}", field.key);
        if field.key == "depth_valid" {
            measured = found.iter().filter(|valid| **valid == 1).count();
        }
    }
    measured
}

#[test]
fn observations_of_the_processor_are_not_on_a_device() {
    let e = env(Task::Reach, Backend::Cpu, 1).keep_on_device(false).unwrap_err().to_string();
    assert_eq!(e, "backend gpu: the observations are the processor's");
}

/// The device adds the errors of a stereo camera, too: with the same random numbers, so that only pixels at silhouettes differ.
#[test]
fn images_of_a_stereo_camera_are_those_of_the_cpu() {
    if !has_device() {
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

/// Differences of bytes of two pictures: the share above two steps, and the mean.
fn differences(a: &[u8], b: &[u8]) -> (f64, f64) {
    assert!(a.len() == b.len() && !a.is_empty());
    let steps = || a.iter().zip(b).map(|(a, b)| f64::from(a.abs_diff(*b)));
    let n = a.len() as f64;
    (steps().filter(|step| *step > 2.0).count() as f64 / n, steps().sum::<f64>() / n)
}

/// Pictures of an episode's start are those of the processor, from the hand and from the base, in the light of a low sun.
#[test]
fn pictures_of_an_environment_are_those_of_the_cpu() {
    if !has_device() {
        return;
    }
    let scenario = Scenario::of(&[("preset", "randomised")]).unwrap();
    let pictures = [Backend::Cpu, Backend::Gpu].map(|backend| {
        let pixels = Some(Pixels { height: 48, width: 64, hz: 20 });
        let spaces = Spaces { pixels, ..Spaces::default() };
        let env = started_in(&scenario, Settings { backend, spaces, ..Settings::of(Task::Reach) }, 2);
        let bytes = |k: usize| {
            let of =
                |values: &Values| if let Values::U8(bytes) = values { bytes.clone() } else { Vec::new() };
            env.observation(k).iter().flat_map(of).collect::<Vec<u8>>()
        };
        [bytes(0), bytes(1)].concat()
    });
    let (beyond, mean) = differences(&pictures[0], &pictures[1]);
    assert!(beyond < 0.005 && mean < 0.05, "{beyond} of the bytes differ, by {mean} in the mean");
}

/// Pictures for which the device has no room are drawn by the processor: on software Vulkan the uneven ground of so many worlds is larger than a buffer may be.
#[test]
fn pictures_without_room_are_drawn_by_the_processor() {
    if !has_device() {
        return;
    }
    let level = Scenario::of(&[]).unwrap();
    let mut spec = (**level.spec()).clone();
    spec.terrain.enabled = true;
    let scenario = level.with_spec(spec);
    let pictures = [(Backend::Cpu, 1), (Backend::Gpu, 32)].map(|(backend, envs)| {
        let pixels = Some(Pixels { height: 16, width: 16, hz: 20 });
        // One tree, so that it is grown once.
        let pool = Some(Pool { trees: 1, seed: SEED });
        let spaces = Spaces { pixels, ..Spaces::default() };
        let settings = Settings { backend, spaces, pool, ..Settings::of(Task::Reach) };
        let env = started_in(&scenario, settings, envs);
        bytes_of(env.observation(envs as usize - 1))
    });
    let (beyond, mean) = differences(&pictures[0], &pictures[1]);
    assert!(beyond < 0.005 && mean < 0.05, "{beyond} of the bytes differ, by {mean} in the mean");
}

/// The pictures of an observation.
fn bytes_of(observation: &[Values]) -> Vec<u8> {
    let of = |values: &Values| if let Values::U8(bytes) = values { bytes.clone() } else { Vec::new() };
    observation.iter().flat_map(of).collect()
}

/// Images that are prepared on the device are what a world observes: depth with its noise, and colour that shows the moment of the depth, after a latency.
#[test]
fn prepared_images_are_those_that_a_world_would_take() {
    let Some(gpu) = device() else { return };
    let scenario = Scenario::of(&[("camera", "d435i")]).unwrap();
    let mut worlds: Vec<World> = (0..2).map(|index| scenario.world(SEED, index, 0).unwrap()).collect();
    let command = scenario.robot().start_command();
    let mut eyes = Eyes::new(&gpu);
    worlds.iter_mut().for_each(|world| world.deliver_colour(true));
    let mut seen = 0;
    for _ in 0..8 {
        let mut alone = worlds.clone();
        eyes.prepare(&mut worlds.iter_mut().enumerate().collect::<Vec<_>>()).unwrap();
        for (there, here) in worlds.iter_mut().zip(&mut alone) {
            let (peeked, there, here) = (there.peek(), there.observe(), here.observe());
            assert!(peeked.depth == there.depth && peeked.colour == there.colour);
            assert_eq!(there.depth_time, here.depth_time);
            let (Some(a), Some(b)) = (&there.depth, &here.depth) else {
                assert!(there.depth.is_none() && here.depth.is_none() && there.colour.is_none());
                continue;
            };
            let differ = a.pixels().iter().zip(b.pixels()).filter(|(a, b)| a != b).count();
            assert!(10_000 * differ <= a.pixels().len(), "{differ} depths differ");
            let bytes = |colour: &Option<std::sync::Arc<orchard_geometry::Image<[u8; 3]>>>| {
                colour.as_ref().unwrap().pixels().as_flattened().to_vec()
            };
            let (beyond, mean) = differences(&bytes(&there.colour), &bytes(&here.colour));
            assert!(beyond < 0.005 && mean < 0.05, "{beyond} of the bytes differ, by {mean} in the mean");
            seen += 1;
        }
        worlds.iter_mut().for_each(|world| world.step(&command));
    }
    assert_eq!(seen, 2);
    // An image that was prepared and not seen is of no other episode.
    let mut left = worlds.swap_remove(0);
    while left.delivers().is_none() {
        left.step(&command);
    }
    let frames = left.frame();
    let images = [true, false].map(|prepares| {
        if prepares {
            eyes.prepare(&mut [(0, &mut left)]).unwrap();
        }
        left.reset();
        let drives = Command { base_velocity: [0.4, 0.0, 0.0], ..command };
        (0..frames).for_each(|_| left.step(&drives));
        left.observe().depth.unwrap()
    });
    assert!(images[0] == images[1]);
}
