use crate::World;
use orchard_geometry::{Pose, Rotation, Vec3, math, transform};
use orchard_robot::{Command, RobotModel};
use orchard_spec::Spec;
use orchard_treegen::{Segment, Skeleton};
use std::sync::Arc;

/// A straight upright shoot of two segments, low enough to touch the robot's flat front only. The joint
/// between them can break.
const LOWER: f64 = 0.1;
const UPPER: f64 = 0.4;
const RADIUS: f64 = 0.02;

fn shoot() -> World {
    grown_from(&Pose::identity(), RADIUS)
}

/// The shoot with its root at a pose, along its z.
fn grown_from(x_world_root: &Pose, radius: f64) -> World {
    let segment = |parent, along, length| Segment {
        parent,
        p_base_world: transform(x_world_root, &Vec3::new(0.0, 0.0, along)),
        r_world_segment: x_world_root.rotation,
        length,
        radius,
        order: 0,
    };
    let skeleton = Skeleton {
        segments: vec![segment(None, 0.0, LOWER), segment(Some(0), LOWER, UPPER)],
        fruit_sites: Vec::new(),
        leaves: Vec::new(),
        spurs: Vec::new(),
    };
    World::with_tree(Arc::new(Spec::paper()), Arc::new(RobotModel::paper()), skeleton, 1, 0, 0).unwrap()
}

fn hold(world: &World) -> Command {
    world.robot().start_command()
}

/// A frame with a force on the tip \[N\].
fn push_at_tip(world: &mut World, force: &Vec3) {
    let body = world.tree().bodies[1];
    // A force at the tip is one at the centre of mass and its moment about that.
    let arm = world.data().x_world_body(body).rotation * Vec3::new(0.0, 0.0, 0.5 * UPPER);
    world.data_mut().body_force_world[body.index()] = *force;
    world.data_mut().body_torque_world[body.index()] = arm.cross(force);
    let command = hold(world);
    world.step(&command);
}

/// Height of the chassis' deck in the world \[m\].
fn deck_height(world: &World) -> f64 {
    let chassis = world.model().collider(world.handle().colliders.base[0]);
    let x_world_base = world.handle().x_world_base(world.data());
    let x_base_shape = world.handle().x_body_base.inverse() * chassis.x_owner_shape;
    chassis.shape.aabb(&(x_world_base * x_base_shape)).max.z
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
    for _ in 0..1200 {
        push_at_tip(&mut world, &Vec3::new(0.0, force, 0.0));
    }
    let arm = world.data().x_world_body(body).rotation * Vec3::new(0.0, 0.0, UPPER);
    let moment = force * arm.z + weight_moment(&world);
    let rupture_moment =
        std::f64::consts::FRAC_PI_4 * RADIUS * RADIUS * RADIUS * world.spec().wood.rupture_stress.si();
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

/// A thin shoot, level over the deck of the robot, whose tip is pressed down on it with a force P. It bends until it has
/// closed the gap g between them, for which it takes Q = g / C, with C the sum of L^2 / Kp over the joints and L their
/// distances from the tip. Beyond, the deck bears the rest, F, and gives way by c F. With g + c F in place of g:
/// `F = (P - g / C) / (1 + c / C)`, and the upper joint bears `(P - F) UPPER` on top of the start.
///
/// All joints have the same damping time, Kd = tau Kp, which is long beside the shoot's own inertia over Kd. On its way down
/// the shoot so follows `Q = P (1 - exp(-t / tau))` and meets the deck at `t_c = -tau ln(1 - g / (C P))`; from then on the
/// deck takes F, whose impulse is `F (t - t_c)`.
#[test]
fn the_deck_bears_what_the_shoot_does_not() {
    const THIN: f64 = 0.01;
    const CLEARANCE: f64 = 5e-3;
    const PUSH: f64 = 10.0;
    const FRAMES: u32 = 180;
    // In the robot's frame: the tip beside the bucket, 0.1 m inside the deck's edge.
    const P_BASE_TIP: [f64; 2] = [-0.3, 0.3];
    let x_world_odom = shoot().x_world_odom();
    let height = deck_height(&shoot()) - x_world_odom.translation.z + THIN + CLEARANCE;
    let p_odom_root = Vec3::new(P_BASE_TIP[0], P_BASE_TIP[1] + LOWER + UPPER, height);
    // Its z points across the robot to the right.
    let right = Rotation::from_axis_angle(&Vec3::x_axis(), std::f64::consts::FRAC_PI_2);
    let mut world = grown_from(&(x_world_odom * Pose::from_parts(p_odom_root.into(), right)), THIN);

    // The shoot's own weight has closed a part of the clearance.
    let x_world_tip = *world.data().x_world_body(world.tree().bodies[1]) * Pose::translation(0.0, 0.0, UPPER);
    let gap = x_world_tip.translation.z - THIN - deck_height(&world);
    let compliance: f64 =
        [LOWER + UPPER, UPPER].iter().zip(&world.tree().stiffness).map(|(lever, k)| lever * lever / k).sum();
    let (wood, robot) = (&world.spec().wood, world.robot().config());
    let stiffness = [
        robot.height.as_ref().unwrap().stiffness.si(),
        wood.contact_stiffness.si(),
        robot.surface.stiffness.si(),
    ];
    let give: f64 = stiffness.iter().map(|k| 1.0 / k).sum();
    let force = (PUSH - gap / compliance) / (1.0 + give / compliance);
    let t_contact = -wood.damping_time.si() * math::ln(1.0 - gap / (compliance * PUSH));

    for _ in 0..FRAMES {
        push_at_tip(&mut world, &Vec3::new(0.0, 0.0, -PUSH));
    }
    let (load, sim) = (*world.wood_load(), &world.spec().sim);
    let along = world.data().x_world_body(world.tree().bodies[1]).rotation * Vec3::z();
    // What is left out is of second order in the tilt: levers are shorter by its cosine, and the tip moves on a circle.
    let tolerance = along.z * along.z;
    assert!(tolerance > 0.0 && tolerance < 2e-4, "{tolerance}");
    let is_near = |measured: f64, expected: f64| (measured / expected - 1.0).abs() < tolerance;
    let measured = load.frame_impulse / sim.frame();
    assert!(is_near(measured, force), "force {measured} N, expected {force} N");
    let (measured, moment) = (load.excess * world.tree().rupture_moment[1], (PUSH - force) * UPPER);
    assert!(is_near(measured, moment), "moment {measured} N m, expected {moment} N m");
    // A scheme of first order: the moment of contact is known to a substep.
    let (time, known) = (f64::from(FRAMES) * sim.frame() - t_contact, sim.substep());
    let measured = load.contact_impulse / force;
    assert!((measured - time).abs() < known + tolerance * time, "for {measured} s, expected {time} s");
    // The shoot arrives with a speed: its blow is over the force at rest.
    assert!(load.peak_contact_force > force && load.peak_segment == Some(1));
}
