//! Contacts of the robot with itself and of a fruit in its hand with the ground, computed on the device.

use std::sync::Arc;

use crate::device::device;
use orchard_fruit::Phase;
use orchard_geometry::Vec3;
use orchard_gpu::Gpu;
use orchard_lockstep::{Lockstep, Turn};
use orchard_multibody::Owner;
use orchard_robot::{Command, RobotModel};
use orchard_spec::Spec;
use orchard_world::World;

/// A world whose robot stands far from the tree.
fn world() -> World {
    let mut spec = Spec::paper();
    let distance = &mut spec.episode.start.distance;
    *distance = distance.with_ends(3.0, 3.0).unwrap();
    World::new(Arc::new(spec), Arc::new(RobotModel::paper()), 20_250_704, 0).unwrap()
}

/// Steps a world on the device, in a lane that a world on uneven ground has had, and a copy of it alone.
fn step_both(gpu: &Gpu, world: &mut World, command: Command, frames: u32) -> (World, Lockstep) {
    let mut alone = world.clone();
    let mut spec = world.spec().clone();
    spec.terrain = spec.terrain.with_amplitude(0.05).unwrap();
    let mut uneven = World::new(Arc::new(spec), Arc::new(world.robot().clone()), 20_250_704, 0).unwrap();
    let mut together = Lockstep::new(gpu, std::slice::from_ref(&uneven), 1, 1).unwrap();
    together.enter(&[(0, &uneven)]).unwrap();
    let start = uneven.robot().start_command();
    together.step(&mut [Turn { lane: 0, world: &mut uneven, command: start, is_whole: true }]).unwrap();
    together.enter(&[(0, world)]).unwrap();
    for _ in 0..frames {
        together.step(&mut [Turn { lane: 0, world, command, is_whole: true }]).unwrap();
        alone.step(&command);
    }
    assert_eq!(together.tally().share_on_device(), 1.0, "{:?}", together.tally());
    (alone, together)
}

/// Sum of the forces between parts of the robot in a world's latest substep \[N\].
fn force_on_itself(world: &World) -> f64 {
    let is_robots = |id| matches!(world.model().collider(id).owner, Owner::Body(body) if world.handle().bodies.contains(&body));
    let own = world.report().contacts.iter().filter(|c| is_robots(c.a) && is_robots(c.b));
    own.map(|c| c.force_world.norm()).sum()
}

/// A hand that is pressed on the chassis stays on the device, and presses as alone.
#[test]
fn a_hand_presses_on_its_chassis_on_the_device() {
    let Some(gpu) = device() else { return };
    let mut world = world();
    let mut command = world.robot().start_command();
    let low = [2.6, 1.7, 0.0, -1.2, 0.0, 2.0, 0.8];
    command.arm_q.iter_mut().zip(low).for_each(|(q, low)| *q = low);
    let (alone, _) = step_both(&gpu, &mut world, command, 90);
    let (own, expected) = (force_on_itself(&world), force_on_itself(&alone));
    assert!(expected > 50.0 && (own - expected).abs() < 0.2 * expected, "{own} N, {expected} N");
    let qs = world.handle().bodies.iter().flat_map(|&body| world.model().qs(body));
    let apart = qs.map(|q| (world.data().q[q] - alone.data().q[q]).abs()).fold(0.0, f64::max);
    assert!(apart < 2e-3, "{apart}");
}

/// A fruit that leaves the hand over level ground meets it on the device as alone: it lands, slides and begins to roll.
#[test]
fn a_fruit_in_the_hand_meets_the_ground_on_the_device() {
    let Some(gpu) = device() else { return };
    let mut world = world();
    let command = world.robot().start_command();
    let point = world.fruit().points[0].index();
    while world.data().tethered[point] {
        world.data_mut().point_force_world[point] = Vec3::new(0.0, 0.0, 60.0);
        world.step(&command);
    }
    let radius = world.fruit().fruit[0].radius;
    let data = world.data_mut();
    data.point_force_world[point] = Vec3::zeros();
    data.point_p_world[point] = Vec3::new(-2.0, 2.0, radius + 0.01);
    data.point_v_world[point] = Vec3::new(0.8, 0.0, -1.0);
    data.point_w_world[point] = Vec3::zeros();
    let (alone, _) = step_both(&gpu, &mut world, command, 1);
    assert_eq!(world.fruit_lives().phase(0), Phase::InHand);
    let (own, expected) = (world.data(), alone.data());
    let apart = |a: &[Vec3], b: &[Vec3]| (a[point] - b[point]).norm();
    let spin = expected.point_w_world[point].norm();
    assert!(expected.point_v_world[point].z.abs() < 0.1 && spin > 5.0, "{expected:?}");
    assert!(apart(&own.point_p_world, &expected.point_p_world) < 1e-5);
    assert!(apart(&own.point_v_world, &expected.point_v_world) < 1e-3);
    assert!(apart(&own.point_w_world, &expected.point_w_world) < 0.02 * spin);
}
