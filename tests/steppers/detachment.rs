//! Joints that break and fruit that come off.

use super::backends::{Backend, backends};
use super::forces::{pull, push};
use super::trees::{Errors, grown, kick, measured_with, state, stemmed, tips};
use orchard_batch::{BatchEvent, TreeEvent, TreeWorld};
use orchard_fruit::Release;
use orchard_geometry::Vec3;

/// Joint rates at the start \[rad/s\].
const KICK: f64 = 1.0;
const LIGHTLY_DAMPED_KICK: f64 = 0.2;
/// Load that breaks a limb \[N\].
const LOAD: Vec3 = Vec3::new(0.0, 0.0, -400.0);
/// Pulls on fruit 0 and 1, over their direct thresholds. The first stem breaks by its tension, the second by the direct pull.
const PULLS: [f64; 2] = [1.5, 3.0];
/// Frames of the run, of the run in which unions break, and between two comparisons.
const FRAMES: u32 = 60;
const UNION_FRAMES: u32 = 10;
const LOOK: u32 = 5;
/// Frames of the run on stems that bend: the pulled fruit fly on for some metres.
const STEM_FRAMES: u32 = 10;
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
        let mut worlds = grown(4);
        kick(&mut worlds, KICK);
        let limbs: Vec<_> = worlds.iter().map(overload).collect();
        let events = come_off(&backend, worlds, &limbs, FRAMES, backend.tolerance.falling);
        let count = |is: fn(&TreeEvent) -> bool| events.iter().filter(|e| is(&e.event)).count();
        let snapped = count(|event| matches!(event, TreeEvent::Snapped { .. }));
        let detached = count(|event| matches!(event, TreeEvent::Detached { .. }));
        assert!(snapped >= limbs.len() && detached >= 2 * limbs.len(), "{events:?}");
    }
}

/// In wood as measured, with unions of a fifth of its branches' strength and less, an overloaded limb tears off at a union. Broken limbs whip faster than
/// 18 rad/s, from where on f64 takes velocity products otherwise (decision 10): events are compared while they break, positions are not.
#[test]
fn unions_break_in_the_same_frame() {
    for backend in backends() {
        let mut worlds = measured_with(4, |wood| {
            let union = wood.union.as_mut().unwrap();
            union.codominant = union.codominant.with_value(0.0).unwrap();
            union.equal_stems = union.equal_stems.with_value(0.2).unwrap();
        });
        kick(&mut worlds, LIGHTLY_DAMPED_KICK);
        let limbs: Vec<_> = worlds.iter().map(overload).collect();
        let trees: Vec<_> = worlds.iter().map(|world| world.plant().clone()).collect();
        let events = come_off(&backend, worlds, &limbs, UNION_FRAMES, f64::INFINITY);
        let at_union = |e: &&BatchEvent| matches!(e.event, TreeEvent::Snapped { segment } if trees[e.world].tree.union_fails[segment]);
        let broken = events.iter().filter(at_union).count();
        assert!(broken * 2 >= limbs.len(), "{}: {events:?}", backend.name);
    }
}

/// Pulls on stems that bend, over their strengths along the zone: down and sideways; and how the stems then give way.
const ON_STEMS: [(Vec3, Release); 2] =
    [(Vec3::new(0.1, 0.0, -1.3), Release::Pull), (Vec3::new(0.8, 0.5, 0.1), Release::Bend)];

/// Fruit on stems that bend come off in the same frame and in the same way as in f64, and fly on.
#[test]
fn stems_give_way_in_the_same_frame_and_way() {
    for backend in backends() {
        let name = &backend.name;
        let mut worlds = stemmed(4);
        kick(&mut worlds, LIGHTLY_DAMPED_KICK);
        let mut stepper = backend.build(&worlds);
        let (mut happened, mut expected) = (Vec::new(), Vec::new());
        let mut has_landed = vec![false; worlds.len()];
        for (index, world) in worlds.iter_mut().enumerate() {
            for (fruit, (along, _)) in ON_STEMS.iter().enumerate() {
                let force = along * world.plant().fruit.fruit[fruit].detach_force;
                pull(world, &mut *stepper, index, fruit, force);
            }
        }
        for end in (LOOK..=STEM_FRAMES).step_by(LOOK as usize) {
            stepper.advance(LOOK);
            happened.extend(stepper.events().unwrap());
            for (index, world) in worlds.iter_mut().enumerate() {
                for frame in end - LOOK + 1..=end {
                    let events = world.step().into_iter();
                    expected.extend(events.map(|event| BatchEvent { frame, world: index, event }));
                    has_landed[index] |= is_near_ground(world);
                }
                let data = state(&mut *stepper, world, index);
                let errors = Errors::of(world, &data);
                let falling = backend.tolerance.falling;
                assert!(
                    has_landed[index] || (errors.tip <= falling && errors.fruit <= falling),
                    "{name}, world {index}: {errors:?}"
                );
                assert_eq!(data.tethered, world.data().tethered, "{name}, world {index}");
            }
        }
        expected.sort_unstable();
        assert_eq!(happened, expected, "{name}");
        for (fruit, (_, way)) in ON_STEMS.into_iter().enumerate() {
            let is_this = |e: &&BatchEvent| e.event == TreeEvent::Detached { fruit, release: Some(way) };
            // A spur may be weaker than its zone.
            assert!(expected.iter().filter(is_this).count() + 1 >= worlds.len(), "{name}: {expected:?}");
        }
    }
}

/// A limb, and a load that breaks it.
fn overload(world: &TreeWorld) -> (usize, [Vec3; 2]) {
    (world.plant().tree.len() / 3, [LOAD, Vec3::zeros()])
}

/// Loads a limb of each world and pulls two fruit off it; returns the events, which are those of f64.
fn come_off(
    backend: &Backend,
    mut worlds: Vec<TreeWorld>,
    limbs: &[(usize, [Vec3; 2])],
    frames: u32,
    falling: f64,
) -> Vec<BatchEvent> {
    let name = &backend.name;
    let mut stepper = backend.build(&worlds);
    for (index, world) in worlds.iter_mut().enumerate() {
        let (segment, load) = limbs[index];
        push(world, &mut *stepper, index, segment, load);
        for (fruit, factor) in PULLS.into_iter().enumerate() {
            let size = factor * world.plant().fruit.fruit[fruit].detach_force;
            pull(world, &mut *stepper, index, fruit, Vec3::new(0.0, 0.0, -size));
        }
    }
    let mut happened = Vec::new();
    let mut expected = Vec::new();
    // Last frame of each world that is compared.
    let mut landed = vec![frames; worlds.len()];
    for end in (LOOK..=frames).step_by(LOOK as usize) {
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
            if landed[index] == frames {
                let errors = Errors::of(world, &state(&mut *stepper, world, index));
                assert!(
                    errors.tip <= falling && errors.fruit <= falling,
                    "{name}, world {index}: {errors:?}"
                );
            }
        }
    }
    let is_compared = |event: &BatchEvent| event.frame <= landed[event.world];
    happened.retain(is_compared);
    expected.retain(is_compared);
    expected.sort_unstable();
    assert_eq!(happened, expected, "{name}");
    expected
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
