//! Randomised worlds: strength zero, batches of mixed trees, episodes.

use orchard_batch::{Batch, TreeWorld};
use orchard_env::{Backend, Env};
use orchard_multibody::forward_kinematics;
use orchard_robot::RobotModel;
use orchard_scenario::Scenario;
use orchard_spec::randomisation::{Axis, Mode};
use orchard_spec::{Preset, Purpose, Spec, Stream};
use orchard_tests::state_hash;
use orchard_world::{Difference, Planting, SnapshotError, Status, World};
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::sync::Arc;

const SEED: u64 = 31;

fn randomised(mode: Mode) -> Spec {
    let mut spec = Spec::preset(Preset::Randomised);
    spec.randomisation.mode = mode;
    spec
}

fn robot() -> Arc<RobotModel> {
    Arc::new(RobotModel::paper())
}

/// With every dial at zero a world of the preset `randomised` goes through the same states as one of `paper`.
#[test]
fn strength_zero_is_the_paper_world_bit_for_bit() {
    let hash_after = |spec: &Spec, frames: u32| {
        let mut world = World::new(Arc::new(spec.clone()), robot(), SEED, 0).unwrap();
        for _ in 0..frames {
            world.step(&robot().start_command());
        }
        state_hash(&world)
    };
    let paper = Spec::paper();
    let before = (hash_after(&paper, 0), hash_after(&paper, 30));
    for mode in Mode::ALL {
        let mut spec = randomised(mode);
        assert!(mode == Mode::Homogeneous || hash_after(&spec, 0) != before.0, "{mode:?} changes nothing");
        for &axis in Axis::ALL {
            let dial = spec.randomisation.strength_mut(axis);
            *dial = dial.with_value(0.0).unwrap();
        }
        assert_eq!((hash_after(&spec, 0), hash_after(&spec, 30)), before, "{mode:?}");
    }
}

/// 10,000 randomised trees: none is refused, and none has an absurd shape.
#[test]
fn ten_thousand_plantings_make_sense() {
    let spec = Arc::new(randomised(Mode::DistinctTopology));
    let (clearance, rounding) = (spec.tree.clearance.si(), 1e-12);
    (0..10_000_u32).into_par_iter().for_each(|index| {
        let planting = Planting::draw(&spec, SEED, index, 0).unwrap_or_else(|e| panic!("tree {index}: {e}"));
        let segments = &planting.skeleton.segments;
        for s in segments {
            assert!(s.length > 1e-3 && s.radius > 1e-3, "tree {index}");
            let lowest = s.p_base_world.z.min(s.p_tip_world().z) - s.radius;
            assert!(s.order == 0 || lowest >= clearance - rounding, "tree {index}: wood at {lowest} m");
            assert!(s.p_tip_world().z > 0.0, "tree {index}");
            if let Some(parent) = s.parent.map(|p| &segments[p]) {
                assert!(s.radius <= parent.radius, "tree {index}: a child thicker than its parent");
                assert!((s.p_base_world - parent.p_tip_world()).norm() < rounding, "tree {index}");
            }
        }
        // Few trees have no twig of the order that bears leaves.
        let bears = segments.iter().any(|s| u32::from(s.order) >= planting.spec.foliage.lowest_order());
        assert_eq!(bears, !planting.skeleton.leaves.is_empty(), "tree {index}");
        assert!(!planting.fruit.is_empty(), "tree {index}");
        assert!(planting.fruit.iter().all(|fruit| fruit.radius > 0.0 && fruit.mass > 0.0));
    });
}

/// A tree of a planting with kicked joints.
fn kicked(spec: &Arc<Spec>, index: u32) -> TreeWorld {
    let Planting { spec, skeleton, fruit, .. } = Planting::draw(spec, SEED, index, 0).unwrap();
    let mut world = TreeWorld::new(spec, &skeleton, fruit).unwrap();
    let mut stream = Stream::new(SEED, index, Purpose::Test);
    for v in &mut world.data_mut().v {
        *v = stream.uniform(-0.5, 0.5);
    }
    world
}

/// 64 randomised trees, each of its own topology, constants and fruit, step together as each does alone.
#[test]
fn a_batch_of_mixed_trees() {
    const FRAMES: u32 = 60;
    let spec = Arc::new(randomised(Mode::DistinctTopology));
    let worlds: Vec<TreeWorld> = (0..64).map(|index| kicked(&spec, index)).collect();
    let topologies: BTreeSet<_> = worlds.iter().map(|world| world.plant().tree.parent.clone()).collect();
    assert_eq!(topologies.len(), 64);

    let mut together = Batch::new(&worlds).unwrap();
    together.step(FRAMES);
    for (index, world) in worlds.iter().enumerate() {
        let mut alone = Batch::new(std::slice::from_ref(world)).unwrap();
        alone.step(FRAMES);
        let mut states = [world.data().clone(), world.data().clone()];
        together.store(index, &mut states[0]);
        alone.store(0, &mut states[1]);
        let bits = states.map(|mut data| {
            forward_kinematics(&world.plant().model, &mut data);
            assert!(data.is_finite(), "world {index}");
            let points = data.point_p_world.iter().chain(&data.point_v_world).flat_map(|v| v.iter());
            data.q.iter().chain(&data.v).chain(points).map(|x| x.to_bits()).collect::<Vec<_>>()
        });
        assert!(bits[0] == bits[1], "the bits of world {index} depend on the worlds beside it");
    }
}

fn scenario(spec: &Spec) -> Scenario {
    Scenario::of(&[]).unwrap().with_spec(spec.clone())
}

/// Every reset draws new dimensions, the same for all worlds; a world of an episode is the same whatever preceded it; a
/// snapshot of one episode is not taken for another's, and going on from one gives the same bits.
#[test]
fn shared_dimensions_are_sampled_anew_at_every_reset() {
    let spec = Arc::new(randomised(Mode::SharedDimensions));
    let mut env = Env::new(&scenario(&spec), SEED, 0..3, Backend::Cpu).unwrap();
    let dimensions = |world: &World| -> Vec<u64> {
        world.skeleton().segments.iter().flat_map(|s| [s.length.to_bits(), s.radius.to_bits()]).collect()
    };
    let hold = vec![robot().start_command(); 3];
    let first: Vec<_> = env.worlds().iter().map(dimensions).collect();
    let first_start = env.snapshot();
    env.step(&hold).unwrap();
    env.reset().unwrap();
    let second: Vec<_> = env.worlds().iter().map(dimensions).collect();
    assert!(first.iter().all(|d| *d == first[0]) && second.iter().all(|d| *d == second[0]));
    assert_ne!(first[0], second[0]);
    assert!(env.worlds().iter().all(|world| (world.episode(), world.frame()) == (1, 0)));
    let others = env.worlds()[1].skeleton() != env.worlds()[2].skeleton();
    assert!(others, "habits vary from world to world");

    for world in env.worlds() {
        let direct = World::of_episode(spec.clone(), robot(), SEED, world.index(), 1).unwrap();
        assert_eq!(direct.snapshot().to_bytes(), world.snapshot().to_bytes());
    }

    let refused = env.restore(&first_start).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "snapshot 0: the snapshot belongs to another world: it is a snapshot of episode 0, this is episode 1"
    );
    let mut first_world = World::new(spec.clone(), robot(), SEED, 0).unwrap();
    let later = env.worlds()[0].snapshot();
    let refused = first_world.restore(&later).unwrap_err();
    assert_eq!(refused, SnapshotError::OtherWorld(Difference::Episode { saved: 1, here: 0 }));

    for _ in 0..10 {
        env.step(&hold).unwrap();
    }
    let saved = env.snapshot();
    let go_on = |env: &mut Env| {
        for _ in 0..10 {
            env.step(&hold).unwrap();
        }
        env.worlds().iter().map(state_hash).collect::<Vec<_>>()
    };
    let once = go_on(&mut env);
    env.restore(&saved).unwrap();
    assert_eq!(go_on(&mut env), once);
}

/// In the other modes a reset brings every world back to where it started.
#[test]
fn other_modes_stay_as_they_are() {
    for mode in [Mode::Homogeneous, Mode::DistinctDimensions, Mode::DistinctTopology] {
        let mut env = Env::new(&scenario(&randomised(mode)), SEED, 0..2, Backend::Cpu).unwrap();
        let start: Vec<_> = env.worlds().iter().map(state_hash).collect();
        env.step(&[robot().start_command(); 2]).unwrap();
        env.reset().unwrap();
        assert_eq!(env.worlds().iter().map(state_hash).collect::<Vec<_>>(), start, "{mode:?}");
        assert!(env.worlds().iter().all(|world| world.episode() == 0));
        let same_tree = env.worlds()[0].skeleton() == env.worlds()[1].skeleton();
        assert_eq!(same_tree, mode == Mode::Homogeneous);
    }
}

/// Worlds come to rest at the start and stay there for a second, whatever was drawn.
#[test]
fn randomised_worlds_stand_still() {
    let spec = Arc::new(randomised(Mode::DistinctTopology));
    for index in 0..12 {
        let mut world = World::new(spec.clone(), robot(), SEED, index).unwrap();
        let start = world.data().point_p_world.clone();
        for _ in 0..60 {
            world.step(&robot().start_command());
        }
        assert_eq!(*world.status(), Status::Running);
        assert_eq!(world.drain_events(), [], "world {index}");
        let drift = start.iter().zip(&world.data().point_p_world).map(|(a, b)| (a - b).norm());
        assert!(drift.fold(0.0, f64::max) < 1e-9, "world {index}");
    }
}
