//! The paper's own regression cases on grown trees.

use crate::fixture::{GRAVITY, Wood};
use orchard_geometry::Vec3;
use orchard_robot::RobotModel;
use orchard_spec::{Spec, wood::WoodSpec};
use orchard_treegen::grow;
use orchard_world::{Status, World, WorldEvent};
use rayon::prelude::*;
use std::sync::Arc;

/// Pull of the paper's bending case [N].
const PULL: f64 = 17.0;
/// Yank [N].
const YANK: f64 = 800.0;

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

/// How far the tip goes under a pull at rest, and how far from rest it is 20 s after the release [m].
fn bend(spec: WoodSpec, gravity: f64, pull: f64) -> (f64, f64) {
    let (mut wood, tip) = sample(spec, gravity);
    let rest = wood.p_tip(tip);
    wood.load_tip(tip, Vec3::new(0.0, 0.0, -pull));
    wood.settle();
    let bent = (wood.p_tip(tip) - rest).norm();
    wood.data.body_force_world.fill(Vec3::zeros());
    wood.data.body_torque_world.fill(Vec3::zeros());
    for _ in 0..20 * 180 {
        wood.step();
    }
    (bent, (wood.p_tip(tip) - rest).norm())
}

/// 17 N bend the sample branch by millimetres and it comes back.
#[test]
fn a_pull_bends_the_sample_branch() {
    let (bent, back) = bend(Spec::paper().wood, GRAVITY, PULL);
    assert!(bent > 1e-3 && bent < 0.1, "{bent} m");
    assert!(back < 1e-6, "{back}");
}

/// The wood of a sapling, with a tenth of the modulus, bends ten times as far: at a hundredth of the pull and
/// without weight, so that the pull's arm turns by a slope of some 1e-3 only, which bounds the deviation.
#[test]
fn a_softer_sapling_bends_in_proportion() {
    let stiff = Spec::paper().wood;
    let mut soft = stiff.clone();
    soft.youngs_modulus = soft.youngs_modulus.with_value(0.1 * stiff.youngs_modulus.value()).unwrap();
    let [(bent, _), (bent_soft, back_soft)] = [stiff, soft].map(|wood| bend(wood, 0.0, 0.01 * PULL));
    let ratio = bent_soft / bent;
    assert!((ratio / 10.0 - 1.0).abs() < 5e-3, "{ratio}");
    assert!(back_soft < 1e-3 * bent_soft, "{back_soft}");
}

/// 800 N for a fifth of a second on every twig (a segment that bears none) of a tree, one after the other, in
/// worlds of their own: no non-finite value, and no more energy than the yank's work and what was stored: in the
/// springs, and in the supports that hold the fruit's weight until a stem breaks. That last share is tens of
/// joules, so the bound sees a blow-up, not a gain of a few joules.
#[test]
fn a_hard_yank_on_every_twig_gains_no_more_than_its_work() {
    let world = World::new(Arc::new(Spec::paper()), Arc::new(RobotModel::paper()), 42, 0).unwrap();
    let children = world.skeleton().children();
    let twigs: Vec<usize> = (0..children.len()).filter(|&i| children[i].is_empty()).collect();
    assert!(twigs.len() > 20);
    let hold = RobotModel::paper().start_command();
    let gravity = Vec3::new(0.0, 0.0, -GRAVITY);
    let start = orchard_multibody::energy(world.model(), world.data(), &gravity);
    let support: f64 = world
        .fruit()
        .points
        .iter()
        .map(|&p| world.model().point(p).mass * GRAVITY * world.data().point_p_world[p.index()].z)
        .sum();
    let stored = start.gravitational + start.joint_springs + start.tethers + support;
    let snapped: usize = twigs
        .par_iter()
        .map(|&twig| {
            let mut world = world.clone();
            let body = world.tree().bodies[twig];
            let outward = (world.skeleton().segments[twig].heading() + Vec3::new(0.0, 0.0, -1.0)).normalize();
            let mut work = 0.0;
            for frame in 0..480 {
                let is_loaded = frame < 12 && !world.rupture().is_debris(twig);
                let force = if is_loaded { outward * YANK } else { Vec3::zeros() };
                world.data_mut().body_force_world[body.index()] = force;
                let before = world.data().com_p_world(body);
                world.step(&hold);
                assert_eq!(*world.status(), Status::Running, "twig {twig}, frame {frame}");
                work += force.dot(&(world.data().com_p_world(body) - before));
                let now = orchard_multibody::energy(world.model(), world.data(), &gravity);
                let energy = now.kinetic + now.gravitational + now.joint_springs + now.tethers;
                assert!(
                    energy <= stored + work,
                    "twig {twig}, frame {frame}: {energy} J of {stored} + {work}"
                );
            }
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
