use crate::World;
use orchard_geometry::{Rotation, Vec3};
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
