use crate::World;
use orchard_geometry::{Rotation, Vec3, inverse_transform};
use orchard_robot::{Command, RobotModel};
use orchard_spec::Spec;
use orchard_treegen::{Segment, Skeleton};
use std::sync::Arc;

/// A straight upright shoot of two segments, low enough to meet nothing of the robot but its flat front. The joint
/// between them can break.
const LOWER: f64 = 0.1;
const UPPER: f64 = 0.4;
const RADIUS: f64 = 0.02;

fn shoot() -> World {
    let segment = |parent, z, length| Segment {
        parent,
        p_base_world: Vec3::new(0.0, 0.0, z),
        r_world_segment: Rotation::identity(),
        length,
        radius: RADIUS,
        order: 0,
    };
    let skeleton = Skeleton {
        segments: vec![segment(None, 0.0, LOWER), segment(Some(0), LOWER, UPPER)],
        fruit_sites: Vec::new(),
        leaves: Vec::new(),
        spurs: Vec::new(),
    };
    World::with_tree(Arc::new(Spec::paper()), Arc::new(RobotModel::paper()), skeleton, 1, 0).unwrap()
}

fn hold(world: &World) -> Command {
    world.robot().start_command()
}

/// Moment of the upper segment's weight about its joint [N m], as far as it leans.
fn weight_moment(world: &World) -> f64 {
    let body = world.tree().bodies[1];
    let mass = world.model().body(body).inertia.mass;
    let p_joint = world.data().x_world_body(body).translation.vector;
    let aside = (world.data().com_p_world(body) - p_joint).xy().norm();
    mass * world.spec().sim.gravity.si() * aside
}

#[test]
fn nothing_touches_an_upright_shoot() {
    let mut world = shoot();
    for _ in 0..60 {
        let command = hold(&world);
        world.step(&command);
    }
    let load = world.wood_load();
    assert_eq!(
        (load.contact_impulse, load.frame_impulse, load.peak_contact_force, load.peak_segment),
        (0.0, 0.0, 0.0, None)
    );
    assert_eq!((load.peak_ratio, load.excess_integral), (0.0, 0.0));
}

/// A force F at the tip of a cantilever of length l bears on its root with F l (less l's shortening by the cosine), and
/// the weight of the leaning wood adds to it.
#[test]
fn a_push_at_the_tip_is_force_times_lever() {
    let mut world = shoot();
    let force = 3.0;
    let body = world.tree().bodies[1];
    let index = body.index();
    for _ in 0..1200 {
        // A force at the tip is one at the centre of mass and its moment about that.
        let arm = world.data().x_world_body(body).rotation * Vec3::new(0.0, 0.0, 0.5 * UPPER);
        let push = Vec3::new(0.0, force, 0.0);
        world.data_mut().body_force_world[index] = push;
        world.data_mut().body_torque_world[index] = arm.cross(&push);
        let command = hold(&world);
        world.step(&command);
    }
    let arm = world.data().x_world_body(body).rotation * Vec3::new(0.0, 0.0, UPPER);
    let moment = force * arm.z + weight_moment(&world);
    let rupture_moment = std::f64::consts::FRAC_PI_4 * RADIUS.powi(3) * world.spec().wood.rupture_stress.si();
    let load = *world.wood_load();
    // 20 s are more than ten of the shoot's decay times: what still swings is below a thousandth.
    let expected = moment / rupture_moment;
    assert!((load.excess / expected - 1.0).abs() < 1e-3, "{} {expected}", load.excess);
    assert_eq!(load.peak_segment, Some(1));
    assert!(load.peak_ratio >= load.excess && load.peak_excess == load.peak_ratio);
    // No contact of the robot: no impulse.
    assert_eq!(load.contact_impulse, 0.0);
    // After the start the push holds the excess between 0 and twice its rest value.
    assert!(load.excess_integral > 0.5 * 20.0 * expected && load.excess_integral < 20.0 * load.peak_excess);
}

/// The robot drives into the shoot and stands: the meter's force times its lever is the joint's moment.
#[test]
fn the_robots_push_balances_the_joint() {
    let mut world = shoot();
    let body = world.tree().bodies[1];
    let (mut pressed, mut place) = (0, None);
    for _ in 0..2400 {
        let x_world_base = world.handle().x_world_base(world.data());
        let away = inverse_transform(&x_world_base, &Vec3::zeros());
        let distance = away.xy().norm();
        pressed += u32::from(world.wood_load().frame_impulse > 0.0);
        // Ahead until it has leaned on the shoot for a tenth of a second; then it keeps its place, for which the drive, a
        // damper, needs a speed to go on pressing.
        let turn = orchard_geometry::math::atan2(away.y, away.x);
        let base_velocity = if pressed < 6 {
            [0.1, 0.0, turn]
        } else {
            let place = *place.get_or_insert(distance);
            [5.0 * (distance - place), 0.0, 0.0]
        };
        let command = Command { base_velocity, ..hold(&world) };
        world.step(&command);
    }
    let load = *world.wood_load();
    assert!(load.contact_impulse > 0.0 && load.peak_contact_force > 0.0);
    let wood = world.tree().colliders[1];
    let p_joint = world.data().x_world_body(body).translation.vector;
    let (mut moment, mut force, mut pressing) = (Vec3::zeros(), 0.0, 0);
    for contact in world.report().contacts.iter().filter(|c| c.a == wood || c.b == wood) {
        let on_wood = if contact.a == wood { contact.force_world } else { -contact.force_world };
        moment += (contact.p_world - p_joint).cross(&on_wood);
        force += on_wood.norm();
        pressing += usize::from(on_wood.norm() > 0.0);
    }
    assert!(pressing > 0);
    // The frame's impulse is that force over the frame, as long as it no longer changes.
    let frame = world.spec().sim.frame();
    assert!((load.frame_impulse / (force * frame) - 1.0).abs() < 1e-2, "{} {}", load.frame_impulse, force);
    let mass = world.model().body(body).inertia.mass;
    let r_com = world.data().com_p_world(body) - p_joint;
    moment += r_com.cross(&Vec3::new(0.0, 0.0, -mass * world.spec().sim.gravity.si()));
    // The joint bears the part across the wood; it cannot twist.
    let axis = world.data().x_world_body(body).rotation * Vec3::z();
    let across = (moment - axis * moment.dot(&axis)).norm();
    let rupture_moment = std::f64::consts::FRAC_PI_4 * RADIUS.powi(3) * world.spec().wood.rupture_stress.si();
    assert!((load.excess * rupture_moment / across - 1.0).abs() < 2e-2, "{} {across}", load.excess);
}
