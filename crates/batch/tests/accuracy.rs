//! A batch against the f64 worlds that it was made of.

mod common;

use common::{grown, kick, siblings, state, tips};
use orchard_batch::{Batch, Isa, TreeEvent, TreeWorld};
use orchard_geometry::Vec3;

/// A force on a segment of every world [N].
const PULL: Vec3 = Vec3::new(15.0, -8.0, -20.0);

/// The outermost segment that bears the pull at an arm's length: the motion is large against rounding.
fn pulled(world: &TreeWorld) -> usize {
    const ARM: f64 = 0.7;
    let tree = &world.plant().tree;
    let depth = |mut segment: usize| {
        let mut depth = 0;
        while let Some(parent) = tree.parent[segment] {
            (segment, depth) = (parent, depth + 1);
        }
        depth
    };
    let strong = (0..tree.len()).filter(|&i| tree.rupture_moment[i] > PULL.norm() * ARM);
    strong.max_by_key(|&segment| depth(segment)).unwrap()
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

    fn relative(&self) -> f64 {
        (self.q / self.q_size).max(self.v / self.v_size)
    }
}

/// Pull for 0.5 s, release for 0.5 s. Gives the largest error of any world's joint angles and rates over the
/// largest of that world, and the largest of a tip [m].
fn pull_and_release(mut worlds: Vec<TreeWorld>, isa: Isa) -> (f64, f64) {
    let mut batch = Batch::with_isa(&worlds, isa).unwrap();
    let mut errors: Vec<Error> = worlds.iter().map(|_| Error::default()).collect();
    for force in [PULL, Vec3::zeros()] {
        for (index, world) in worlds.iter_mut().enumerate() {
            let segment = pulled(world);
            batch.push(index, segment, force, Vec3::zeros());
            let body = world.plant().tree.bodies[segment];
            world.data_mut().body_force_world[body.index()] = force;
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
    let relative = errors.iter().fold(0.0, |m: f64, error| m.max(error.relative()));
    (relative, errors.iter().fold(0.0, |m: f64, error| m.max(error.tip)))
}

/// f32 carries 6e-8 relative; a chain of 20 links and 180 substeps may lose three digits of it.
#[test]
fn pull_and_release_agrees_with_f64() {
    for isa in Isa::available() {
        for (kind, worlds) in [("siblings", siblings(3)), ("grown", grown(5))] {
            let (relative, tip) = pull_and_release(worlds, isa);
            println!("{isa:?} {kind}: relative {relative:.1e}, tip {tip:.1e} m");
            assert!(relative < 1e-4, "{isa:?} {kind}: relative {relative:.1e}");
            assert!(tip < 5e-5, "{isa:?} {kind}: tip {tip:.1e} m");
        }
    }
}

/// Hard kicks, a limb broken by hand, a limb overloaded and fruit torn off: the same things happen to the same
/// worlds in the same frames.
#[test]
fn what_comes_off_comes_off_in_the_same_frame() {
    let mut worlds = grown(3);
    kick(&mut worlds, 1.0);
    let mut batch = Batch::new(&worlds).unwrap();
    let mut expected = Vec::new();
    let load = Vec3::new(0.0, 0.0, -400.0);
    for (index, world) in worlds.iter_mut().enumerate() {
        let plant = world.plant().clone();
        let segment = pulled(world);
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
    for frame in 1..=60 {
        happened.extend(batch.step(1).into_iter().map(|e| (e.frame, e.world, e.event)));
        for (index, world) in worlds.iter_mut().enumerate() {
            let mut events = world.step();
            events.sort();
            expected.extend(events.into_iter().map(|event| (frame, index, event)));
        }
    }
    assert_eq!(happened, expected);
    let snapped = expected.iter().filter(|e| matches!(e.2, TreeEvent::Snapped { .. })).count();
    println!("{snapped} of {} events are breaks", expected.len());
    assert!(snapped >= 3 && expected.len() >= snapped + 6, "{expected:?}");
    // What fell, fell alike: a broken limb swings, which multiplies errors, so that it is held to a centimetre.
    for (index, world) in worlds.iter().enumerate() {
        let mut error = Error::default();
        let data = state(&batch, &worlds, index);
        error.take(world, &data);
        println!("world {index}: tip {:.1e} m, rate {:.1e}", error.tip, error.v / error.v_size);
        assert!(error.tip < 1e-2, "{}", error.tip);
        for (a, b) in data.point_p_world.iter().zip(&world.data().point_p_world) {
            assert!((a - b).norm() < 1e-2);
        }
    }
}
