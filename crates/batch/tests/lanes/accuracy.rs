//! A batch against the f64 worlds that it was made of.

use crate::common::{grown, kick, siblings, state, tips};
use orchard_batch::{Batch, Isa, TreeEvent, TreeWorld};
use orchard_geometry::Vec3;

/// A force on every tip of a tree [N]; none breaks.
const PULL: Vec3 = Vec3::new(0.4, -0.2, -0.3);

/// Segments without children.
fn tip_segments(world: &TreeWorld) -> Vec<usize> {
    let parent = &world.plant().tree.parent;
    (0..parent.len()).filter(|i| !parent.contains(&Some(*i))).collect()
}

/// Largest errors of a world, and the largest true values that they are held against.
#[derive(Default)]
struct Error {
    q: f64,
    q_size: f64,
    v: f64,
    v_size: f64,
    tip: f64,
}

impl Error {
    fn take(&mut self, world: &TreeWorld, data: &orchard_multibody::Data) {
        let size = |x: &[f64]| x.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let error = |a: &[f64], b: &[f64]| a.iter().zip(b).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
        let truth = world.data();
        self.q = self.q.max(error(&data.q, &truth.q));
        self.q_size = self.q_size.max(size(&truth.q));
        self.v = self.v.max(error(&data.v, &truth.v));
        self.v_size = self.v_size.max(size(&truth.v));
        for (a, b) in tips(world, data).iter().zip(tips(world, truth)) {
            self.tip = self.tip.max((a - b).norm());
        }
    }
}

/// From a kick, pull for 0.5 s, release for 0.5 s. Gives each world's largest errors.
fn pull_and_release(mut worlds: Vec<TreeWorld>, isa: Isa) -> Vec<Error> {
    kick(&mut worlds, 0.5);
    let mut batch = Batch::with_isa(&worlds, isa).unwrap();
    let mut errors: Vec<Error> = worlds.iter().map(|_| Error::default()).collect();
    for force in [PULL, Vec3::zeros()] {
        for (index, world) in worlds.iter_mut().enumerate() {
            for segment in tip_segments(world) {
                batch.push(index, segment, force, Vec3::zeros());
                let body = world.plant().tree.bodies[segment];
                world.data_mut().body_force_world[body.index()] = force;
            }
        }
        for _ in 0..30 {
            assert_eq!(batch.step(1), []);
            for world in &mut worlds {
                assert_eq!(world.step(), []);
            }
            for (index, (world, error)) in worlds.iter().zip(&mut errors).enumerate() {
                error.take(world, &state(&batch, &worlds, index));
            }
        }
    }
    errors
}

/// f32 carries 6e-8 relative; 20 links in a chain and 180 substeps may lose three digits of it in the angles and
/// in the tips. Rates have a floor: one unit in the last place of a fruit's position 2 m up is 1.2e-7 m, which is
/// 2e-5 m/s in a substep, and a twig of 0.1 m that follows half of it turns at 1e-4 rad/s.
#[test]
fn pull_and_release_agrees_with_f64() {
    for isa in Isa::available() {
        for (kind, worlds) in [("siblings", siblings(3)), ("grown", grown(5))] {
            for error in pull_and_release(worlds, isa) {
                let (angle, rate, tip) = (error.q / error.q_size, error.v, error.tip);
                let line =
                    format!("{isa:?} {kind}: angle {angle:.1e}, rate {rate:.1e} rad/s, tip {tip:.1e} m");
                println!("{line}");
                assert!(angle < 1e-4 && rate < 1e-4 && tip < 5e-5, "{line}");
            }
        }
    }
}

/// Hard kicks, a limb broken by hand, a limb overloaded and fruit torn off: the same things happen to the same
/// worlds in the same frames.
#[test]
fn what_comes_off_comes_off_in_the_same_frame() {
    for isa in Isa::available() {
        compare_what_comes_off(isa);
    }
}

fn compare_what_comes_off(isa: Isa) {
    let mut worlds = grown(3);
    kick(&mut worlds, 1.0);
    let mut batch = Batch::with_isa(&worlds, isa).unwrap();
    let mut expected = Vec::new();
    let load = Vec3::new(0.0, 0.0, -400.0);
    for (index, world) in worlds.iter_mut().enumerate() {
        let plant = world.plant().clone();
        let segment = plant.tree.len() / 3;
        batch.push(index, segment, load, Vec3::zeros());
        world.data_mut().body_force_world[plant.tree.bodies[segment].index()] = load;
        // Under the direct threshold for one, over it for the other; the first comes off by its stem's tension.
        for (fruit, factor) in [(0, 1.5), (1, 3.0)] {
            let force = Vec3::new(0.0, 0.0, -factor * plant.fruit.fruit[fruit].detach_force);
            batch.pull(index, fruit, force);
            world.data_mut().point_force_world[plant.fruit.points[fruit].index()] = force;
        }
    }
    let mut happened = Vec::new();
    let mut errors: Vec<Error> = worlds.iter().map(|_| Error::default()).collect();
    let mut has_landed = vec![false; worlds.len()];
    for frame in 1..=60 {
        happened.extend(batch.step(1).into_iter().map(|e| (e.frame, e.world, e.event)));
        for (index, world) in worlds.iter_mut().enumerate() {
            let mut events = world.step();
            events.sort();
            expected.extend(events.into_iter().map(|event| (frame, index, event)));
        }
        // What falls, falls alike, a broken limb by a centimetre since its swing multiplies errors. On the ground the two
        // have different laws.
        for (index, world) in worlds.iter().enumerate() {
            has_landed[index] = has_landed[index] || is_near_ground(world);
            if !has_landed[index] {
                let data = state(&batch, &worlds, index);
                errors[index].take(world, &data);
                for (a, b) in data.point_p_world.iter().zip(&world.data().point_p_world) {
                    assert!((a - b).norm() < 1e-2);
                }
            }
        }
    }
    assert_eq!(happened, expected);
    let snapped = expected.iter().filter(|e| matches!(e.2, TreeEvent::Snapped { .. })).count();
    println!("{isa:?}: {snapped} of {} events are breaks", expected.len());
    assert!(snapped >= 3 && expected.len() >= snapped + 6, "{expected:?}");
    for (index, error) in errors.iter().enumerate() {
        println!("world {index}: tip {:.1e} m, rate {:.1e}", error.tip, error.v / error.v_size);
        assert!(error.tip > 0.0 && error.tip < 1e-2, "{}", error.tip);
    }
}

/// True if a fruit or the end of a link is about to land, in the next frame or so.
fn is_near_ground(world: &TreeWorld) -> bool {
    /// Some frames' fall at 4 m/s.
    const NEAR: f64 = 0.2;
    let (data, fruit) = (world.data(), &world.plant().fruit);
    let is_loose_and_low = |point: &orchard_multibody::PointId| {
        !data.tethered[point.index()] && data.point_p_world[point.index()].z < NEAR
    };
    let low_tips = tips(world, data)
        .iter()
        .zip(&world.plant().tree.bodies)
        .zip(0..)
        .any(|((tip, _), segment)| world.rupture().is_debris(segment) && tip.z < NEAR);
    low_tips || fruit.points.iter().any(is_loose_and_low)
}
