//! The paper's own regression cases on grown trees.

use super::fixture::{GRAVITY, Wood};
use super::ledger::{Ledger, ROUND_OFF};
use orchard_geometry::Vec3;
use orchard_robot::RobotModel;
use orchard_spec::{Spec, wood::WoodSpec};
use orchard_treegen::grow;
use orchard_world::{Status, World, WorldEvent};
use rayon::prelude::*;
use std::sync::Arc;

/// Pull of the paper's bending case \[N\].
const PULL: f64 = 17.0;
/// Yank \[N\].
const YANK: f64 = 800.0;
/// Joint rate of a tree at rest \[rad/s\]: the creep of friction in a break, which sticks below 0.01 rad/s.
const AT_REST: f64 = 0.01;

/// The tree of seed 42 at rest, and the tip segment of its first scaffold.
fn sample(spec: WoodSpec, gravity: f64) -> (Wood, usize) {
    let mut wood = Wood::new(grow(&Spec::paper(), 42, 0).unwrap(), spec);
    wood.settings.gravity = Vec3::new(0.0, 0.0, -gravity);
    wood.settle();
    let segments = &wood.skeleton.segments;
    let mut tip = segments.iter().position(|s| s.order == 1).unwrap();
    while let Some(next) =
        (tip + 1..segments.len()).find(|&i| segments[i].parent == Some(tip) && segments[i].order == 1)
    {
        tip = next;
    }
    (wood, tip)
}

/// Displacement of a tip under a small force, in linear theory at the present pose: each joint of the path to the trunk turns by the force's moment across
/// its segment over its stiffness, theta_j = (I - z_j z_j^T) (r_j x F) / K_j, and carries the tip by theta_j x r_j, with the arm r_j from the joint to the tip.
fn linear_displacement(wood: &Wood, tip: usize, force: Vec3) -> Vec3 {
    let p_tip = wood.p_tip(tip);
    let path = std::iter::successors(Some(tip), |&segment| wood.skeleton.segments[segment].parent);
    let of_joint = |segment: usize| {
        let x_world_segment = wood.data.x_world_body(wood.tree.bodies[segment]);
        let z = x_world_segment.rotation * Vec3::z();
        let arm = p_tip - x_world_segment.translation.vector;
        let moment = arm.cross(&force);
        ((moment - z * z.dot(&moment)) / wood.tree.stiffness[segment]).cross(&arm)
    };
    path.map(of_joint).sum()
}

/// Displacement of the tip under a pull at rest, by linear theory, and the distance from rest 20 s after the release \[m\].
fn bend(spec: WoodSpec, gravity: f64, pull: f64) -> (f64, f64, f64) {
    let (mut wood, tip) = sample(spec, gravity);
    let rest = wood.p_tip(tip);
    let force = Vec3::new(0.0, 0.0, -pull);
    let linear = linear_displacement(&wood, tip, force).norm();
    wood.load_tip(tip, force);
    wood.settle();
    let bent = (wood.p_tip(tip) - rest).norm();
    wood.data.body_force_world.fill(Vec3::zeros());
    wood.data.body_torque_world.fill(Vec3::zeros());
    for _ in 0..20 * 180 {
        wood.step();
    }
    (bent, linear, (wood.p_tip(tip) - rest).norm())
}

/// A light pull without gravity bends the sample branch as linear theory says, up to a relative error of the order of the slope, some 1e-3.
#[test]
fn a_light_pull_bends_the_sample_branch_as_linear_theory_says() {
    let (bent, linear, _) = bend(Spec::paper().wood, 0.0, 0.01 * PULL);
    assert!((bent / linear - 1.0).abs() < 5e-3, "{bent} m, {linear} m by linear theory");
}

/// 17 N bend the sample branch by 10.2 mm, and it comes back. The released code of the paper prints 6.4 mm for a branch of its own tree, whose segments are not published,
/// so that this figure cannot be reproduced. The branch of this test is held to linear theory at its rest pose (10.1 mm). The deviation of 1.2 % is geometric: the weight beyond a joint
/// pulls further on bent wood, which linear theory leaves out.
#[test]
fn a_pull_bends_the_sample_branch() {
    const GEOMETRIC: f64 = 0.02;
    let (bent, linear, back) = bend(Spec::paper().wood, GRAVITY, PULL);
    println!("{bent} m, {linear} m by linear theory");
    assert!((bent / linear - 1.0).abs() < GEOMETRIC, "{bent} m, {linear} m by linear theory");
    assert!(back < 1e-6, "{back}");
}

/// The wood of a sapling, with a tenth of the modulus, bends ten times as far: at a hundredth of the pull and
/// without weight, so that the pull's arm turns by a slope of some 1e-3 only, which bounds the deviation.
#[test]
fn a_softer_sapling_bends_in_proportion() {
    let stiff = Spec::paper().wood;
    let mut soft = stiff.clone();
    soft.youngs_modulus = soft.youngs_modulus.with_value(0.1 * stiff.youngs_modulus.value()).unwrap();
    let [(bent, ..), (bent_soft, _, back_soft)] = [stiff, soft].map(|wood| bend(wood, 0.0, 0.01 * PULL));
    let ratio = bent_soft / bent;
    assert!((ratio / 10.0 - 1.0).abs() < 5e-3, "{ratio}");
    assert!(back_soft < 1e-3 * bent_soft, "{back_soft}");
}

/// 800 N for a fifth of a second on every twig (a segment that bears none) of a tree, one after the other, in
/// worlds of their own. Without the paper's cap on a fruit's reaction, whose excess is carried by nothing, there is never more energy
/// than there was and the yank and lost supports added.
#[test]
fn a_hard_yank_on_every_twig_gains_no_more_than_its_work() {
    let mut spec = Spec::paper();
    let cap = spec.fruit.reaction_cap.clone();
    spec.fruit.reaction_cap = cap.with_value(1e4).unwrap();
    yank_every_twig(spec, -ROUND_OFF);
}

/// The hard yank with the paper's cap: every value is finite, and 8 s after the yank began the tree and its fruit are at
/// rest.
#[test]
fn a_tree_comes_to_rest_after_a_hard_yank() {
    yank_every_twig(Spec::paper(), f64::NEG_INFINITY);
}

/// `margin_min`: how far the energy must stay under its bound \[J\].
fn yank_every_twig(spec: Spec, margin_min: f64) {
    let robot = RobotModel::paper();
    let world = World::new(Arc::new(spec), Arc::new(robot.clone()), 42, 0).unwrap();
    let children = world.skeleton().children();
    let twigs: Vec<usize> = (0..children.len()).filter(|&i| children[i].is_empty()).collect();
    assert!(twigs.len() > 20);
    let hold = robot.start_command();
    let snapped: usize = twigs
        .par_iter()
        .map(|&twig| {
            let mut world = world.clone();
            let mut ledger = Ledger::open(&world, &robot);
            let body = world.tree().bodies[twig];
            let outward = (world.skeleton().segments[twig].heading() + Vec3::new(0.0, 0.0, -1.0)).normalize();
            for frame in 0..480 {
                let is_loaded = frame < 12 && !world.rupture().is_debris(twig);
                let force = if is_loaded { outward * YANK } else { Vec3::zeros() };
                world.data_mut().body_force_world[body.index()] = force;
                let before = world.data().com_p_world(body);
                world.step(&hold);
                assert_eq!(*world.status(), Status::Running, "twig {twig}, frame {frame}");
                let work = force.dot(&(world.data().com_p_world(body) - before));
                let margin = ledger.enter(&world, work);
                assert!(margin >= margin_min, "twig {twig}, frame {frame}: {margin} J gained");
            }
            let dofs = world.tree().bodies.iter().flat_map(|&body| world.model().dofs(body));
            let rate = dofs.map(|dof| world.data().v[dof].abs()).fold(0.0, f64::max);
            assert!(rate < AT_REST, "twig {twig}: {rate} rad/s");
            let events = world.drain_events();
            events.iter().filter(|e| matches!(e, WorldEvent::BranchSnapped { .. })).count()
        })
        .sum();
    assert!(snapped > 0, "800 N snap no twig");
}

/// A pull of 25 N, over every stem's strength, picks each fruit of a world after its frames; 5 N picks none.
#[test]
fn a_firm_pull_detaches_and_a_tug_does_not() {
    let hold = RobotModel::paper().start_command();
    let world = World::new(Arc::new(Spec::paper()), Arc::new(RobotModel::paper()), 42, 0).unwrap();
    let fruit = world.fruit().len();
    assert!(fruit > 0);
    for (pull, picked) in [(5.0, 0), (25.0, fruit)] {
        let mut world = world.clone();
        for _ in 0..30 {
            for i in 0..fruit {
                let point = world.fruit().points[i].index();
                let down = if world.data().tethered[point] { -pull } else { 0.0 };
                world.data_mut().point_force_world[point] = Vec3::new(0.0, 0.0, down);
            }
            world.step(&hold);
        }
        let events = world.drain_events();
        let gone = events.iter().filter(|e| matches!(e, WorldEvent::FruitDetached { .. })).count();
        assert_eq!(gone, picked, "{pull} N");
    }
}
