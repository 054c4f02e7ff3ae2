use super::*;
use crate::{Snapshot, World};
use orchard_robot::{Command, Observation, RobotModel};
use orchard_spec::camera::CameraSpec;
use std::sync::Arc;

/// A world whose camera is a small d435i of some latency \[ms\] and rate \[Hz\].
fn world(latency: f64, rate: f64) -> World {
    let figure = |name: &str, value: f64, unit: &str| {
        format!("{name} = {{ value = {value}, range = [0, 9999], unit = '{unit}', source = 'x' }}\n")
    };
    let view = figure("width", 64.0, "px") + &figure("height", 48.0, "px") + &figure("rate", rate, "Hz");
    let text = format!("[d435i]\n{}[d435i.view]\n{view}", figure("latency", latency, "ms"));
    let spec = Spec { camera: CameraSpec::from_toml("test", &text).unwrap(), ..Spec::paper() };
    World::new(Arc::new(spec), Arc::new(RobotModel::paper()), 3, 0).unwrap()
}

/// A command that moves the camera.
fn command(world: &World) -> Command {
    let mut command = world.robot().start_command();
    command.arm_q[0] += 0.01 * f64::from(world.frame());
    command.base_velocity[2] = 0.2;
    command
}

/// Steps and observes up to a frame.
fn observe_until(world: &mut World, last: u32) -> Vec<Observation> {
    let mut all = vec![world.observe()];
    while world.frame() < last {
        world.step(&command(world));
        all.push(world.observe());
    }
    all
}

const LAST: u32 = 40;

/// The image that comes at a frame is, bit for bit, the one that a camera without latency delivers at the frame in which it
/// was taken, with that frame's time.
#[test]
fn images_come_late_and_say_when_they_were_taken() {
    for rate in [6.0, 20.0, 60.0] {
        let period = (60.0 / rate) as usize;
        let prompt = observe_until(&mut world(0.0, rate), LAST);
        let frame = Spec::paper().sim.frame();
        for (taken, observation) in prompt.iter().enumerate() {
            assert_eq!(observation.depth.is_some(), taken % period == 0);
            assert_eq!(observation.depth_time, observation.time);
        }
        for (latency, frames) in [(4.0, 0), (10.0, 1), (65.0, 4), (100.0, 6), (250.0, 15)] {
            let mut world = world(latency, rate);
            let late = observe_until(&mut world, LAST);
            for (now, observation) in late.iter().enumerate() {
                let taken = now.checked_sub(frames).filter(|taken| taken % period == 0);
                let expected = taken.and_then(|taken| prompt[taken].depth.as_ref());
                assert!(observation.depth.as_ref() == expected, "{rate} Hz, {latency} ms, frame {now}");
                if let Some(taken) = taken {
                    assert_eq!(observation.depth_time, taken as f64 * frame);
                }
                // Proprioception has no latency.
                assert_eq!((observation.time, observation.arm_q), (prompt[now].time, prompt[now].arm_q));
            }
            let truth = world.camera_truth().unwrap();
            let latest = (0..=LAST as usize - frames).rev().find(|taken| taken % period == 0).unwrap();
            assert_eq!(truth.sight.frame as usize, latest);
            assert_eq!(Some(truth.measured()), prompt[latest].depth.as_ref());
        }
    }
}

/// An image is taken whether or not an observation is read in that frame, and is available until its frame is over.
#[test]
fn images_need_no_observer_when_they_are_taken() {
    let prompt = observe_until(&mut world(0.0, 6.0), 10);
    let mut late = world(65.0, 6.0);
    while late.frame() < 14 {
        late.step(&command(&late));
    }
    for _ in 0..2 {
        assert_eq!(late.observe().depth, prompt[10].depth);
    }
    late.step(&command(&late));
    assert_eq!(late.observe().depth, None);
    late.reset();
    assert_eq!(observe_until(&mut late, 4)[4].depth, prompt[0].depth);
}

/// Snapshots in memory and through bytes hold the images that are under way.
#[test]
fn images_in_flight_are_saved() {
    // One and several at a time under way.
    for (latency, rate) in [(65.0, 6.0), (100.0, 30.0)] {
        let mut first = world(latency, rate);
        let mut snapshots = vec![first.snapshot()];
        let mut seen = vec![first.observe()];
        while first.frame() < LAST {
            first.step(&command(&first));
            snapshots.push(first.snapshot());
            seen.push(first.observe());
        }
        for start in [0, 1, 3, 9, 10, 12, 14, 20, 23] {
            let saved = &snapshots[start];
            let through_bytes = Snapshot::from_bytes(&saved.to_bytes()).unwrap();
            for snapshot in [saved, &through_bytes] {
                let mut again = world(latency, rate);
                again.restore(snapshot).unwrap();
                assert_eq!(again.snapshot().to_bytes(), saved.to_bytes());
                let rest = observe_until(&mut again, LAST);
                for (a, b) in rest.iter().zip(&seen[start..]) {
                    assert!(
                        a.depth == b.depth,
                        "{latency} ms, from frame {start}: other image at {} s",
                        a.time
                    );
                    assert_eq!((a.depth_time, a.arm_q), (b.depth_time, b.arm_q));
                }
                let (a, b) = (again.camera_truth().unwrap(), first.camera_truth().unwrap());
                assert_eq!((a.sight.frame, a.measured()), (b.sight.frame, b.measured()));
                assert_eq!((a.truth(), a.fruit()), (b.truth(), b.fruit()));
            }
        }
    }
}

/// Colour shows what depth shows: the moment at which it was taken. A camera without it delivers none, and the world moves alike.
#[test]
fn colour_shows_the_moment_of_its_depth_image() {
    let seen = |latency: f64, colour: bool| {
        let mut world = world(latency, 20.0);
        world.deliver_colour(colour);
        let all = observe_until(&mut world, 10);
        (all, world)
    };
    let ((prompt, _), (late, mut world), (plain, _)) = (seen(0.0, true), seen(65.0, true), seen(65.0, false));
    assert!(plain.iter().all(|seen| seen.colour.is_none()));
    for (now, (seen, plain)) in late.iter().zip(&plain).enumerate() {
        let taken = now.checked_sub(4).filter(|taken| taken.is_multiple_of(3));
        let expected = taken.and_then(|taken| prompt[taken].colour.as_deref());
        assert!(seen.colour.as_deref() == expected, "frame {now}");
        assert_eq!(expected.is_some(), taken.is_some());
        assert!(seen.depth == plain.depth && seen.arm_q == plain.arm_q);
    }
    let shown = |frame: usize| prompt[frame].colour.as_ref().unwrap().pixels();
    assert_ne!(shown(0), shown(6), "the camera moves");
    let colour = world.camera_truth().unwrap().colour.clone().unwrap();
    assert_eq!(colour.pixels(), shown(6));
    let saved = Snapshot::from_bytes(&world.snapshot().to_bytes()).unwrap();
    world.reset();
    world.restore(&saved).unwrap();
    assert_eq!(world.camera_truth().unwrap().colour.as_ref(), Some(&colour));
}

/// The light of a world's config changes its colour images, and neither their depth nor the motion; the day's own light is a clear day.
#[test]
fn light_changes_colour_alone() {
    let seen = |light: &str| {
        let lit = Spec::from_toml("test", &format!("preset = 'lit'\nbase = 'paper'\n{light}")).unwrap();
        let spec = Spec { light: lit.light, ..world(0.0, 20.0).spec().clone() };
        let mut world = World::new(Arc::new(spec), Arc::new(RobotModel::paper()), 3, 0).unwrap();
        world.deliver_colour(true);
        observe_until(&mut world, 6)
    };
    let lit = |figure: &str, value: f64, unit: &str| {
        let figure =
            format!("{figure} = {{ value = {value}, range = [0, 90], unit = '{unit}', source = 'x' }}");
        seen(&format!("[light]\nbase = 'day'\n{figure}"))
    };
    let plain = seen("");
    let change = |other: &[Observation]| {
        let [a, b] = [other, &plain].map(|seen| seen[0].colour.as_deref().unwrap().pixels().as_flattened());
        a.iter().zip(b).map(|(a, b)| f64::from(a.abs_diff(*b))).sum::<f64>() / a.len() as f64
    };
    assert!(change(&seen("[light]\nbase = 'day'")) < 0.5, "a clear day");
    for other in [lit("sun_elevation", 5.0, "deg"), lit("overcast", 1.0, "1"), lit("sun_strength", 0.0, "1")]
    {
        assert!(change(&other) > 5.0, "{}", change(&other));
        for (a, b) in other.iter().zip(&plain) {
            assert!(a.depth == b.depth && a.arm_q == b.arm_q);
        }
    }
}
