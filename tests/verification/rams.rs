//! The robot driven into trees, and parked under one that falls apart.

use super::ledger::{Ledger, ROUND_OFF};
use orchard_geometry::Vec3;
use orchard_multibody::{ContactReport, Owner};
use orchard_robot::{PAPER_URDF, RobotConfig, RobotModel};
use orchard_spec::Spec;
use orchard_world::{Status, World};
use rayon::prelude::*;
use std::sync::Arc;

/// Wood thicker than this is not passed through \[m\].
const THICK: f64 = 0.010;
/// Largest depth of a twig's centreline inside the chassis \[m\].
const TWIG_OVERLAP: f64 = 0.001;
/// Largest travel of the base after it touched the trunk \[m\].
const STOP: f64 = 0.005;

/// The paper's world with a substep as its frame, so that the contacts of every substep are seen.
fn spec() -> Spec {
    let mut spec = facing(Spec::paper());
    let substeps = spec.sim.substeps.get();
    let rate = spec.sim.frame_rate.value() * f64::from(substeps);
    let rupture_frames = spec.wood.rupture_frames.get() * substeps;
    spec.sim.frame_rate = spec.sim.frame_rate.with_value(rate).unwrap();
    spec.sim.substeps = spec.sim.substeps.with_value(1).unwrap();
    spec.wood.rupture_frames = spec.wood.rupture_frames.with_value(rupture_frames).unwrap();
    spec
}

/// The paper's robot with another top speed \[m/s\], and an acceleration that reaches it at once.
fn robot(speed: f64) -> RobotModel {
    let mut config = RobotConfig::paper();
    let base = config.drive.as_mut().unwrap();
    base.speed_max = base.speed_max.with_value(speed).unwrap();
    base.acceleration_max = base.acceleration_max.with_value(50.0).unwrap();
    RobotModel::from_urdf(PAPER_URDF, &config).unwrap()
}

/// The segment of live wood that a contact presses, and whether the other side is the chassis.
fn live_wood(world: &World, contact: &ContactReport) -> Option<(usize, bool)> {
    let segment = |id| match world.model().collider(id).owner {
        Owner::Body(body) => world.tree().bodies.iter().position(|&b| b == body),
        _ => None,
    };
    let (segment, other) = match (segment(contact.a), segment(contact.b)) {
        (Some(segment), None) => (segment, contact.b),
        (None, Some(segment)) => (segment, contact.a),
        _ => return None,
    };
    let is_chassis = world.handle().colliders.base.contains(&other);
    (!world.rupture().is_debris(segment)).then_some((segment, is_chassis))
}

/// Position of the base and the direction in which it looks.
fn base(world: &World) -> (Vec3, Vec3) {
    let x_world_base = world.handle().x_world_base(world.data());
    (x_world_base.translation.vector, x_world_base.rotation * Vec3::x())
}

/// The robot starts where a drive straight ahead meets the trunk.
fn facing(mut spec: Spec) -> Spec {
    let start = &mut spec.episode.start;
    start.distance = start.distance.with_ends(2.4, 2.4).expect("in range");
    start.heading = start.heading.with_ends(0.0, 0.0).expect("in range");
    spec
}

/// Effects of a ram of 4 s on the wood.
struct Ram {
    /// Contacts in which the robot pressed on live wood.
    touched: usize,
    /// Travel of the base in its direction after it touched the trunk \[m\]; `None` if it never touched it.
    stop: Option<f64>,
    /// Deepest overlap of the robot and live wood \[m\].
    sunk: f64,
}

fn ram(speed: f64, seed: u64) -> Ram {
    let robot = robot(speed);
    let mut world = World::new(Arc::new(spec()), Arc::new(robot.clone()), seed, 0).unwrap();
    let mut ledger = Ledger::open(&world, &robot);
    let mut command = robot.start_command();
    command.base_velocity = [speed, 0.0, 0.0];
    let mut ram = Ram { touched: 0, stop: None, sunk: 0.0 };
    let mut at_touch = None;
    for substep in 0..720 {
        let case = format!("{speed} m/s, seed {seed}, substep {substep}");
        let before = base(&world);
        world.step(&command);
        assert_eq!(*world.status(), Status::Running, "{case}");
        assert!(world.report().converged, "{case}: the contact solve failed");
        let margin = ledger.enter(&world, 0.0);
        assert!(margin >= -ROUND_OFF, "{case}: {margin} J gained");
        for contact in &world.report().contacts {
            let Some((segment, is_chassis)) = live_wood(&world, contact) else { continue };
            let radius = world.skeleton().segments[segment].radius;
            let outside = contact.gap + radius;
            assert!(2.0 * radius <= THICK || outside > 0.0, "{case}: {outside} m, wood of {radius} m");
            assert!(!is_chassis || outside >= -TWIG_OVERLAP, "{case}: {outside} m, twig of {radius} m");
            ram.touched += usize::from(contact.gap < 0.0);
            ram.sunk = ram.sunk.max(-contact.gap);
            if is_chassis && contact.gap <= 0.0 && world.skeleton().segments[segment].order == 0 {
                at_touch.get_or_insert(before);
            }
        }
        if let Some((start, heading)) = at_touch {
            let way = (base(&world).0 - start).dot(&heading);
            ram.stop = Some(ram.stop.map_or(way, |stop| stop.max(way)));
        }
    }
    ram
}

/// 20 random canopies at the base's top speed and at 3 m/s. In every substep the state is finite, the contact solve converges, no
/// energy is gained, the axis of unbroken wood thicker than 10 mm is outside every part of the robot, and that of
/// any unbroken twig outside the chassis to 1 mm: it bends or it breaks. At the top speed the base stops
/// within 5 mm of touching the trunk (at 3 m/s it holds seven times the energy, and no limit is set).
/// `-- --nocapture` prints the worst of the 20.
#[test]
fn rams_through_twenty_canopies() {
    for (speed, stop_max) in [(1.1, STOP), (3.0, f64::INFINITY)] {
        let rams = (0..20_u64).into_par_iter().map(|seed| {
            let ram = ram(speed, seed);
            assert!(ram.touched > 0, "{speed} m/s, seed {seed}: the robot meets nothing");
            let stop = ram.stop.unwrap_or_else(|| panic!("{speed} m/s, seed {seed}: past the trunk"));
            assert!(stop <= stop_max, "{speed} m/s, seed {seed}: {stop} m");
            [ram.sunk, stop]
        });
        let [sunk, stop] = rams.reduce(|| [0.0; 2], |a, b| [a[0].max(b[0]), a[1].max(b[1])]);
        println!(
            "rams at {speed} m/s: sinks {:.2} mm into live wood, stops within {:.1} mm of the trunk",
            1e3 * sunk,
            1e3 * stop
        );
    }
}

/// Every limb of a tree breaks at its base, each in a world of its own with the robot parked beneath. The debris comes down on the
/// ground and through the robot, which it does not meet: nothing non-finite, no energy gained, no contact of
/// robot and debris, and afterwards the robot drives off.
#[test]
fn a_robot_parked_under_breaking_limbs() {
    let robot = robot(1.1);
    let mut start = World::new(Arc::new(facing(Spec::paper())), Arc::new(robot.clone()), 42, 0).unwrap();
    let mut command = robot.start_command();
    // Under the canopy's edge; wood broken on the approach is part of the scene.
    command.base_velocity = [1.1, 0.0, 0.0];
    while base(&start).0.xy().norm() > 1.0 {
        start.step(&command);
    }
    let limbs: Vec<usize> = (1..start.tree().len()).filter(|&i| !start.rupture().is_debris(i)).collect();
    limbs.into_par_iter().for_each(|limb| {
        let mut world = start.clone();
        let mut ledger = Ledger::open(&world, &robot);
        world.break_branch(limb);
        for frame in 0..240 {
            command_for(&mut world, &robot, frame);
            assert_eq!(*world.status(), Status::Running, "limb {limb}, frame {frame}");
            let margin = ledger.enter(&world, 0.0);
            assert!(margin >= -ROUND_OFF, "limb {limb}, frame {frame}: {margin} J gained");
            for contact in &world.report().contacts {
                for id in [contact.a, contact.b] {
                    let Owner::Body(body) = world.model().collider(id).owner else { continue };
                    let debris = world.tree().bodies.iter().position(|&b| b == body);
                    if debris.is_some_and(|segment| world.rupture().is_debris(segment)) {
                        let partner = if id == contact.a { contact.b } else { contact.a };
                        assert_eq!(world.model().collider(partner).owner, Owner::World, "limb {limb}");
                    }
                }
            }
        }
        assert!(base(&world).0.xy().norm() > 1.2, "limb {limb}: the robot is stuck");
    });
}

/// Parked for 3 s, then backwards.
fn command_for(world: &mut World, robot: &RobotModel, frame: u32) {
    let mut command = robot.start_command();
    command.base_velocity[0] = if frame < 180 { 0.0 } else { -0.5 };
    world.step(&command);
}
