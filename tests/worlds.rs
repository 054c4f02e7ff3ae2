//! Invariants of whole worlds.

use orchard_geometry::Vec3;
use orchard_multibody::BodyId;
use orchard_robot::RobotModel;
use orchard_spec::{Purpose, Spec, Stream};
use orchard_world::truth::FruitState;
use orchard_world::{Status, World, WorldEvent};
use rayon::prelude::*;
use std::sync::Arc;

fn world(seed: u64, index: u32) -> World {
    World::new(Arc::new(Spec::paper()), Arc::new(RobotModel::paper()), seed, index)
        .unwrap_or_else(|e| panic!("seed {seed}, world {index}: {e}"))
}

/// A settled default tree stays where it is: every segment's base and every fruit, to 1e-9 m over 10 s.
#[test]
fn a_settled_tree_does_not_drift() {
    let mut world = world(42, 0);
    let hold = RobotModel::paper().start_command();
    let places = |w: &World| {
        let bodies = w.tree().bodies.iter().map(|&b| w.data().x_world_body(b).translation.vector);
        bodies.chain(w.fruit().points.iter().map(|p| w.data().point_p_world[p.index()])).collect::<Vec<_>>()
    };
    let start = places(&world);
    for _ in 0..600 {
        world.step(&hold);
    }
    let drift = places(&world).iter().zip(&start).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    assert!(drift <= 1e-9, "{drift:e} m");
    assert!(world.drain_events().is_empty());
}

/// After a pull on a default tree with its fruit is released, its energy never rises. The fruit's weight, which the
/// paper takes off the wood, is part of the balance.
#[test]
fn energy_never_rises_after_a_pull_is_released() {
    let mut world = world(42, 0);
    let hold = RobotModel::paper().start_command();
    let tip = world.skeleton().segments.iter().rposition(|s| s.order == 1).expect("a scaffold");
    let body = world.tree().bodies[tip].index();
    let gravity = Vec3::new(0.0, 0.0, -world.spec().sim.gravity.si());
    let mut last = f64::INFINITY;
    for frame in 0..360 {
        let pull = if frame < 60 { Vec3::new(6.0, 4.0, -10.0) } else { Vec3::zeros() };
        world.data_mut().body_force_world[body] = pull;
        world.step(&hold);
        let now = orchard_multibody::energy(world.model(), world.data(), &gravity).total();
        if frame >= 60 {
            // Round-off of a sum of some thousand joules (the robot's and the tree's height) in f64.
            assert!(now <= last + 1e-11, "frame {frame}: {last} -> {now}");
        }
        last = now;
    }
    assert!(world.drain_events().is_empty(), "the pull broke something");
}

/// 300 random seeds grow, settle and step one second: nothing non-finite, nothing out of its box, no event.
#[test]
fn three_hundred_seeds_live_for_a_second() {
    let hold = RobotModel::paper().start_command();
    (0..300_u64).into_par_iter().for_each(|seed| {
        let mut world = world(seed * 7919 + 1, 0);
        let mut events = Vec::new();
        for _ in 0..60 {
            world.step(&hold);
            events.extend(world.drain_events());
        }
        assert_eq!(*world.status(), Status::Running, "seed {seed}");
        assert!(events.is_empty(), "seed {seed}: {events:?}");
    });
}

/// A world that turns non-finite, wherever, is quarantined with the reason; a neighbour does not notice.
#[test]
fn a_broken_world_is_quarantined() {
    let hold = RobotModel::paper().start_command();
    let (mut sound, mut alone) = (world(3, 1), world(3, 1));
    let spoil: [fn(&mut World); 6] = [
        |w| w.data_mut().v[5] = f64::NAN,
        |w| w.data_mut().point_v_world[0].x = f64::INFINITY,
        |w| set_robot_q(w, |w| *w.handle().base_joint.moving().unwrap(), f64::NAN),
        |w| set_robot_q(w, |w| w.handle().height.unwrap(), f64::INFINITY),
        |w| set_robot_q(w, |w| w.handle().arm[3], f64::NAN),
        |w| set_robot_q(w, |w| w.handle().fingers[0].drive, f64::NAN),
    ];
    for spoil in spoil {
        let mut sick = world(3, 0);
        spoil(&mut sick);
        for _ in 0..3 {
            sick.step(&hold);
            sound.step(&hold);
            alone.step(&hold);
        }
        assert!(matches!(sick.status(), Status::Quarantined { frame: 1, .. }), "{:?}", sick.status());
        assert_eq!(sick.frame(), 1);
        assert_eq!(sound.data().q, alone.data().q);
    }
}

/// Whatever number turns up in the state, however large or small, the world steps on or is quarantined: no panic, no
/// endless loop, and nothing that is not finite in a world that runs.
#[test]
fn absurd_numbers_are_survived() {
    let hold = RobotModel::paper().start_command();
    let start = world(3, 0);
    (0..400_u64).into_par_iter().for_each(|case| {
        let mut world = start.clone();
        let mut draws = Stream::new(case, 0, Purpose::Test);
        let size = draws.uniform(-320.0, 310.0);
        let value = draws.normal(0.0, 1.0).signum() * orchard_geometry::math::pow(10.0, size);
        let data = world.data_mut();
        let dof = draws.integer(0, data.v.len() as u32 - 1) as usize;
        let fruit = draws.integer(0, data.point_p_world.len() as u32 - 1) as usize;
        let axis = draws.integer(0, 2) as usize;
        match draws.integer(0, 6) {
            0 => data.q[dof] = value,
            1 => data.v[dof] = value,
            2 => data.stiffness[dof] = value,
            3 => data.damping[dof] = value,
            4 => data.torque[dof] = value,
            5 => data.point_p_world[fruit][axis] = value,
            _ => data.point_v_world[fruit][axis] = value,
        }
        for _ in 0..3 {
            world.step(&hold);
            world.observe();
        }
        let finite = world.data().is_finite();
        assert!(finite || *world.status() != Status::Running, "case {case}: {value:e}");
    });
}

fn set_robot_q(world: &mut World, body: fn(&World) -> BodyId, value: f64) {
    let q = world.model().qs(body(world)).start;
    world.data_mut().q[q] = value;
}

/// Arm servos never exert more than their published limits, pressed against the ground included. (With limits
/// that only foresee free motion, the wrist exerted 2.5 and 7.2 times its limit in these two postures.)
#[test]
fn effort_limits_hold_in_contact() {
    let robot = RobotModel::paper();
    let start = robot.start_command().arm_q;
    for goal in [[1.78, -1.4, 2.6], [1.78, -2.3, 3.6]] {
        let mut world = world(3, 0);
        let mut command = robot.start_command();
        let mut pressed = false;
        for frame in 0..240 {
            // Upper arm forward, forearm down: the hand presses on the ground before the base.
            let share = f64::from(frame.min(60)) / 60.0;
            for (joint, goal) in [1, 3, 5].into_iter().zip(goal) {
                command.arm_q[joint] = start[joint] + (goal - start[joint]) * share;
            }
            world.step(&command);
            pressed |= world.report().contacts.iter().any(|c| c.force_world.norm() > 20.0);
            for (torque, limit) in world.observe().arm_torque.iter().zip(robot.kinematics().limits()) {
                let effort = limit.effort;
                assert!(torque.abs() <= effort * (1.0 + 1e-6), "frame {frame}: {torque} N m of {effort}");
            }
        }
        assert!(pressed, "the hand never pressed on anything");
    }
}

/// A world run twice, or run again after a reset, gives the same bits; another index gives another tree.
#[test]
fn worlds_repeat_bit_for_bit() {
    let run = |world: &mut World| {
        let mut command = RobotModel::paper().start_command();
        command.base_velocity = [0.6, 0.05, 0.1];
        let mut depth = Vec::new();
        for _ in 0..240 {
            if let Some(image) = world.observe().depth {
                depth.extend(image.pixels().iter().map(|d| d.to_bits()));
            }
            world.step(&command);
        }
        (world.data().q.clone(), world.data().point_p_world.clone(), depth)
    };
    let mut first = world(11, 2);
    let result = run(&mut first);
    assert!(result == run(&mut world(11, 2)), "not repeatable");
    first.reset();
    assert!(result == run(&mut first), "not repeatable after a reset");
    assert_ne!(world(11, 2).skeleton().segments.len(), 0);
    assert_ne!(world(11, 2).skeleton(), world(11, 3).skeleton());
}

/// A hard pull on a scaffold breaks wood; the rest of the world stays sane, and broken limbs fall.
#[test]
fn breaking_a_limb_keeps_the_world_sane() {
    let mut world = world(17, 0);
    let hold = RobotModel::paper().start_command();
    let lateral = world.skeleton().segments.iter().position(|s| s.order == 2).expect("a lateral");
    let body = world.tree().bodies[lateral];
    let mut snapped = Vec::new();
    for frame in 0..240 {
        let pull = if frame < 30 { -400.0 } else { 0.0 };
        world.data_mut().body_force_world[body.index()].z = pull;
        world.step(&hold);
        snapped.extend(world.drain_events().into_iter().filter_map(|e| match e {
            WorldEvent::BranchSnapped { segment, .. } => Some(segment),
            _ => None,
        }));
    }
    assert!(!snapped.is_empty());
    assert_eq!(*world.status(), Status::Running);
    for s in snapped {
        assert!(world.rupture().is_debris(s));
    }
}

/// Joints break four times a second, anywhere, while the live wood is kicked: twigs whip, whole trees come down.
/// Nothing turns by more than one radian a substep, and the fruit
/// that the fall shakes off lands within reach of the tree.
#[test]
fn breaking_everything_stays_bounded() {
    let hold = RobotModel::paper().start_command();
    (0..24_u64).into_par_iter().for_each(|seed| {
        let mut world = world(seed, 0);
        let mut draws = Stream::new(seed, 0, Purpose::Test);
        let segments = world.skeleton().segments.len() as u32;
        let fastest = 1.0 / world.spec().sim.substep();
        for frame in 0..900 {
            if frame % 15 == 0 {
                world.break_branch(draws.integer(1, segments - 1) as usize);
            }
            let body = world.tree().bodies[draws.integer(1, segments - 1) as usize].index();
            let kick = Vec3::from_fn(|_, _| draws.normal(0.0, 3.0));
            world.data_mut().body_force_world[body] = if frame < 600 { kick } else { Vec3::zeros() };
            world.step(&hold);
            world.data_mut().body_force_world[body] = Vec3::zeros();
            assert_eq!(*world.status(), Status::Running, "seed {seed}, frame {frame}");
            let dofs = world.tree().bodies.iter().flat_map(|&b| world.model().dofs(b));
            let peak = dofs.map(|dof| world.data().v[dof].abs()).fold(0.0, f64::max);
            assert!(peak < fastest, "seed {seed}, frame {frame}: {peak} rad/s");
        }
        let fallen = world.fruit_truth().into_iter().filter(|f| f.state == FruitState::Dropped);
        assert!(fallen.into_iter().all(|f| f.p_world.norm() < 5.0), "seed {seed}");
    });
}
