//! Joints that break and fruit that come off.

use super::backends::backends;
use super::forces::{pull, push};
use super::trees::{Errors, grown, kick, state, tips};
use orchard_batch::{BatchEvent, TreeEvent, TreeWorld};
use orchard_geometry::Vec3;

/// Joint rates at the start \[rad/s\].
const KICK: f64 = 1.0;
/// Load that breaks a limb \[N\].
const LOAD: Vec3 = Vec3::new(0.0, 0.0, -400.0);
/// Pulls on fruit 0 and 1, over their direct thresholds. The first stem breaks by its tension, the second by the direct pull.
const PULLS: [f64; 2] = [1.5, 3.0];
/// Frames of the run, and between two comparisons.
const FRAMES: u32 = 60;
const LOOK: u32 = 5;
/// Height of a loose part at which the comparison of a world ends \[m\]: on the ground f64 and f32 have different laws of contact. Some frames' fall at 4 m/s.
const NEAR_GROUND: f64 = 0.2;

/// True if a loose fruit or the tip of a broken limb is about to land.
fn is_near_ground(world: &TreeWorld) -> bool {
    let (data, plant) = (world.data(), world.plant());
    let low_fruit = plant.fruit.points.iter().map(|point| point.index());
    let low_tips = tips(world, data).into_iter().enumerate();
    low_fruit.into_iter().any(|at| !data.tethered[at] && data.point_p_world[at].z < NEAR_GROUND)
        || low_tips.into_iter().any(|(segment, p)| world.rupture().is_debris(segment) && p.z < NEAR_GROUND)
}

/// Hard kicks, an overloaded limb and two fruit pulled off in each world: the same events in the same frames.
#[test]
fn what_comes_off_comes_off_in_the_same_frame() {
    for backend in backends() {
        let name = &backend.name;
        let mut worlds = grown(4);
        kick(&mut worlds, KICK);
        let mut stepper = backend.build(&worlds);
        for (index, world) in worlds.iter_mut().enumerate() {
            let segment = world.plant().tree.len() / 3;
            push(world, &mut *stepper, index, segment, [LOAD, Vec3::zeros()]);
            for (fruit, factor) in PULLS.into_iter().enumerate() {
                let size = factor * world.plant().fruit.fruit[fruit].detach_force;
                pull(world, &mut *stepper, index, fruit, Vec3::new(0.0, 0.0, -size));
            }
        }
        let mut happened = Vec::new();
        let mut expected = Vec::new();
        // Last frame of each world that is compared.
        let mut landed = vec![FRAMES; worlds.len()];
        for end in (LOOK..=FRAMES).step_by(LOOK as usize) {
            stepper.advance(LOOK);
            happened.extend(stepper.events().unwrap());
            for (index, world) in worlds.iter_mut().enumerate() {
                for frame in end - LOOK + 1..=end {
                    let events = world.step().into_iter();
                    expected.extend(events.map(|event| BatchEvent { frame, world: index, event }));
                    if is_near_ground(world) {
                        landed[index] = landed[index].min(frame);
                    }
                }
                if landed[index] == FRAMES {
                    let errors = Errors::of(world, &state(&mut *stepper, world, index));
                    let most = backend.tolerance.falling;
                    assert!(errors.tip <= most && errors.fruit <= most, "{name}, world {index}: {errors:?}");
                }
            }
        }
        let is_compared = |event: &BatchEvent| event.frame <= landed[event.world];
        happened.retain(is_compared);
        expected.retain(is_compared);
        expected.sort_unstable();
        assert_eq!(happened, expected, "{name}");
        let snapped = expected.iter().filter(|e| matches!(e.event, TreeEvent::Snapped { .. })).count();
        let detached = expected.iter().filter(|e| matches!(e.event, TreeEvent::Detached { .. })).count();
        assert!(snapped >= worlds.len() && detached >= 2 * worlds.len(), "{expected:?}");
    }
}

/// A fruit that is pulled off falls on the ground and lies still. Its weight presses it in by some micrometres; f32 has a resolution of 4 nm there. How far it rolls depends on the law of contact.
#[test]
fn fruit_fall_and_lie_still() {
    const OFF: Vec3 = Vec3::new(0.0, 0.0, -60.0);
    const FALL: u32 = 240;
    const ROLL: f64 = 0.05;
    for backend in backends() {
        let mut worlds = grown(1);
        let mut stepper = backend.build(&worlds);
        let world = &mut worlds[0];
        for (force, frames) in [(OFF, 12), (Vec3::zeros(), FALL)] {
            pull(world, &mut *stepper, 0, 0, force);
            stepper.advance(frames);
            (0..frames).for_each(|_| drop(world.step()));
        }
        let data = state(&mut *stepper, world, 0);
        let point = world.plant().fruit.points[0].index();
        let (p, v) = (data.point_p_world[point], data.point_v_world[point]);
        let radius = world.plant().fruit.fruit[0].radius;
        assert!(!data.tethered[point], "{}", backend.name);
        assert!((p.z - radius).abs() < 1e-4 && v.norm() < 1e-3, "{}: {p} m, {v} m/s", backend.name);
        assert!((p - world.data().point_p_world[point]).norm() < ROLL, "{}: {p} m", backend.name);
    }
}
