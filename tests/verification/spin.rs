//! Broken trees, flung: broken joints at rates above those of falling limbs.

use super::fixture::{GRAVITY, Wood};
use super::ledger::Ledger;
use orchard_geometry::Vec3;
use orchard_multibody::{energy, forward_kinematics};
use orchard_robot::RobotModel;
use orchard_spec::{Purpose, Spec, Stream};
use orchard_treegen::grow;
use orchard_treephys::Rupture;
use orchard_world::{Status, World};
use rayon::prelude::*;
use std::sync::Arc;

/// Round-off of the energy of a tree, relative to its energy at the start.
const ROUND_OFF: f64 = 1e-9;
const SECONDS: f64 = 20.0;

/// Energy of the velocities at the pose that they led from, of the weights and springs at the pose that they led to.
///
/// The step with carried momentum cannot raise this energy: a velocity's kinetic energy is taken at the pose for which
/// it was solved.
fn staggered_energy(wood: &Wood) -> f64 {
    let mut back = wood.data.clone();
    for (q, v) in back.q.iter_mut().zip(&back.v) {
        *q -= wood.settings.h * v;
    }
    forward_kinematics(&wood.model, &mut back);
    let now = energy(&wood.model, &wood.data, &wood.settings.gravity);
    now.total() - now.kinetic + energy(&wood.model, &back, &wood.settings.gravity).kinetic
}

/// Flings a tree whose joints are broken with the chance `share`, tips first so that breaks nest.
fn fling(seed: u64, share: f64, rate: f64, all_one_way: bool) -> Result<(), String> {
    let spec = Spec::paper();
    let mut wood = Wood::new(grow(&spec, seed, 0).unwrap(), spec.wood);
    wood.settings.gravity.z = -GRAVITY;
    let mut draws = Stream::new(seed, 0, Purpose::Test);
    let mut rupture = Rupture::new(&wood.tree);
    for segment in (1..wood.tree.len()).rev() {
        if draws.uniform(0.0, 1.0) < share {
            let Wood { tree, model, data, spec, .. } = &mut wood;
            rupture.break_joint(tree, model, data, spec, GRAVITY, segment);
        }
    }
    for (dof, v) in wood.data.v.iter_mut().enumerate() {
        let one_way = if dof % 2 == 0 { rate } else { 0.0 };
        *v = if all_one_way { one_way } else { draws.uniform(-rate, rate) };
    }
    forward_kinematics(&wood.model, &mut wood.data);
    let start = staggered_energy(&wood);
    let mut bound = start;
    for substep in 0..(SECONDS / wood.settings.h) as u32 {
        rupture.begin_substep(&wood.tree, &wood.model, &mut wood.data, &wood.spec, wood.settings.h);
        wood.step();
        let now = staggered_energy(&wood);
        // Not a number is not bounded either.
        let is_bounded = now <= bound + ROUND_OFF * start.abs();
        if !is_bounded {
            return Err(format!("substep {substep}: {now} J after {bound} J, {start} J at the start"));
        }
        bound = now;
    }
    Ok(())
}

/// Any set of broken joints, nested ones included, every joint flung at 3 to 200 rad/s, at random or all the same way (the
/// tips then turn at the sum of all rates on their way to the root): the energy never rises in 20 s of substeps of 1/180 s.
///
/// The law: weight, springs, dampers, friction and drag are implicit or conservative and take energy away; velocity products of slow
/// links are explicit and gain `h w^2` a second and joule, less than these take; those of fast links project the velocities,
/// which cannot add energy. With explicit velocity products everywhere, most of these trees went
/// to overflow within 20 substeps.
#[test]
fn flung_trees_in_pieces_only_lose_energy() {
    let mut cases = Vec::new();
    for seed in 0..3_u64 {
        for share in [0.1, 0.5, 1.0] {
            for rate in [3.0, 20.0, 60.0, 200.0] {
                cases.extend([(seed, share, rate, false), (seed, share, rate, true)]);
            }
        }
    }
    cases.into_par_iter().for_each(|(seed, share, rate, all_one_way)| {
        let case = format!("seed {seed}, {share} broken, {rate} rad/s, one way: {all_one_way}");
        fling(seed, share, rate, all_one_way).unwrap_or_else(|e| panic!("{case}: {e}"));
    });
}

/// Every joint of a tree breaks at once, with its fruit on, while the base comes in at 3 m/s: nothing is gained beyond what motors and lost
/// supports add, and the world runs on.
#[test]
fn a_ram_into_a_tree_that_falls_to_pieces() {
    (0..3_u64).into_par_iter().for_each(|seed| {
        let robot = RobotModel::paper();
        let mut world = World::new(Arc::new(Spec::paper()), Arc::new(robot.clone()), seed, 0).unwrap();
        let mut command = robot.start_command();
        command.base_velocity = [3.0, 0.0, 0.0];
        let drive = world.model().dofs(*world.handle().base_joint.moving().unwrap()).start;
        world.data_mut().v[drive] = 3.0;
        let model = world.model().clone();
        forward_kinematics(&model, world.data_mut());
        let mut ledger = Ledger::open(&world, &robot);
        for segment in (1..world.tree().len()).rev() {
            world.break_branch(segment);
        }
        for frame in 0..300 {
            world.step(&command);
            assert_eq!(*world.status(), Status::Running, "seed {seed}, frame {frame}");
            let margin = ledger.enter(&world, 0.0);
            assert!(margin >= -1e-9, "seed {seed}, frame {frame}: {margin} J gained");
        }
    });
}

/// Whatever finite rates a tree starts with, its world runs on or is quarantined, and never runs with a number that is not
/// finite.
#[test]
fn absurd_rates_end_in_quarantine_or_rest() {
    (0..24_u64).into_par_iter().for_each(|seed| {
        let robot = RobotModel::paper();
        let mut world = World::new(Arc::new(Spec::paper()), Arc::new(robot.clone()), seed % 3, 0).unwrap();
        let mut draws = Stream::new(seed, 0, Purpose::Test);
        for segment in (1..world.tree().len()).rev() {
            if draws.unit() < 0.5 {
                world.break_branch(segment);
            }
        }
        let rate = orchard_geometry::math::pow(10.0, draws.uniform(0.0, 300.0));
        let dofs: Vec<usize> =
            world.tree().bodies.iter().flat_map(|&body| world.model().dofs(body)).collect();
        for dof in dofs {
            world.data_mut().v[dof] = draws.uniform(-rate, rate);
        }
        for frame in 0..120 {
            world.step(&robot.start_command());
            let data = world.data();
            let p_is_finite = |v: &Vec3| v.iter().all(|x| x.is_finite());
            let is_finite = data.is_finite() && data.point_p_world.iter().all(p_is_finite);
            assert!(is_finite || *world.status() != Status::Running, "seed {seed}, {rate:e}, frame {frame}");
        }
    });
}
