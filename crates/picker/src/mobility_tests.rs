//! The law of a base on wheels, on a point that obeys its limits.

use super::*;
use crate::config::PickerConfig;
use crate::expert::ExpertConfig;
use orchard_geometry::{Pose, Rotation};
use orchard_robot::JointVector;
use std::f64::consts::{PI, TAU};

const DT: f64 = 1.0 / 60.0;
const WHEELS: Wheels = Wheels { acceleration: 3.0, turn_acceleration: 6.0 };
const TREE: Vec3 = Vec3::new(2.4, 0.0, 0.0);

fn at(base_pose: [f64; 3], speed: f64, turn: f64) -> RobotState {
    let [x, y, yaw] = base_pose;
    let rotation = Rotation::from_axis_angle(&Vec3::z_axis(), yaw);
    RobotState {
        time: 0.0,
        dt: DT,
        q: JointVector::zeros(),
        v: JointVector::zeros(),
        a: JointVector::zeros(),
        torque: JointVector::zeros(),
        width: 0.0,
        finger_q: [0.0; 2],
        finger_force: [0.0; 2],
        vacuum: 0.0,
        x_odom_base: Pose::from_parts(Vec3::new(x, y, 0.0).into(), rotation),
        base_pose,
        base_speed: speed.abs(),
        turn_speed: turn.abs(),
        base_velocity: [speed, 0.0, turn],
        base_acceleration: [0.0; 3],
    }
}

/// A drive to a goal: time that it took, length of its way, sum of its turns and least distance from the trunk; `None` if it does not arrive in a
/// minute.
fn drive_to(start: [f64; 3], goal: &BaseGoal, c: &DriveConfig, tolerance: Tolerance) -> Option<[f64; 4]> {
    let law = Mobility::Wheels(WHEELS);
    let (mut pose, mut v, mut w) = (start, 0.0_f64, 0.0_f64);
    let (mut way, mut turns, mut nearest) = (0.0, 0.0, f64::INFINITY);
    for frame in 0..60 * 60 {
        let (command, reached) = law.towards(&at(pose, v, w), goal, Some(&TREE), c, tolerance);
        assert_eq!(command[1], 0.0, "sideways");
        assert!(command[0].abs() <= c.speed.si() + 1e-12 && command[2].abs() <= c.turn_speed.si() + 1e-12);
        if reached && v.abs() < 1e-3 && w.abs() < 1e-3 {
            return Some([f64::from(frame) * DT, way, turns, nearest]);
        }
        v += (command[0] - v).clamp(-WHEELS.acceleration * DT, WHEELS.acceleration * DT);
        w += (command[2] - w).clamp(-WHEELS.turn_acceleration * DT, WHEELS.turn_acceleration * DT);
        pose[2] += w * DT;
        let (sin, cos) = math::sin_cos(pose[2]);
        pose[0] += v * DT * cos;
        pose[1] += v * DT * sin;
        way += v.abs() * DT;
        turns += w.abs() * DT;
        nearest = math::hypot(pose[0] - TREE.x, pose[1] - TREE.y).min(nearest);
    }
    None
}

/// Near the goal's bearing the base arrives from any place and heading, on a way that is hardly longer than the straight one, with
/// less than a turn on the spot at either end: it does not orbit the goal.
#[test]
fn it_arrives_from_any_pose_without_orbiting() {
    let expert = ExpertConfig::preset().shared;
    for (name, config) in [("baseline", PickerConfig::baseline()), ("expert", expert)] {
        let tolerance = Tolerance::new(&config.align.position_tolerance, &config.align.angle_tolerance);
        let goal = BaseGoal::facing(&TREE, PI, 1.2);
        for n in 0..500 {
            // An additive recurrence over places up to 0.4 m about the goal and over headings.
            let u = |ratio: f64| (0.5 + f64::from(n) * ratio).fract();
            let start = [
                goal.x + 0.4 * (2.0 * u(0.819_172_513) - 1.0),
                goal.y + 0.4 * (2.0 * u(0.671_043_606) - 1.0),
                TAU * u(0.549_700_477) - PI,
            ];
            let straight = math::hypot(goal.x - start[0], goal.y - start[1]);
            let found = drive_to(start, &goal, &config.drive, tolerance);
            let [time, way, turns, _] =
                found.unwrap_or_else(|| panic!("{name}: from {start:?} it never arrives"));
            assert!(time < 12.0, "{name}: {time} s from {start:?}");
            assert!(way <= straight + 0.05, "{name}: {way} m for {straight} m from {start:?}");
            // A quarter turn to the way, at most, and half a turn to the goal's heading.
            assert!(turns < 1.5 * PI + 1.2, "{name}: {turns} rad from {start:?}");
        }
    }
}

/// From anywhere about the tree to anywhere the base arrives, without a cycle, and keeps off the trunk.
#[test]
fn it_drives_around_the_tree() {
    let expert = ExpertConfig::preset().shared;
    for (name, config) in [("baseline", PickerConfig::baseline()), ("expert", expert)] {
        let tolerance = Tolerance::new(&config.align.position_tolerance, &config.align.angle_tolerance);
        for n in 0..400 {
            let u = |ratio: f64| (0.5 + f64::from(n) * ratio).fract();
            let (bearing, away) = (TAU * u(0.855_612_1), 0.9 + 0.7 * u(0.732_080_1));
            let goal = BaseGoal::facing(&TREE, TAU * u(0.626_372_4), 0.9 + 0.7 * u(0.535_932_2));
            let from = BaseGoal::facing(&TREE, bearing, away);
            let start = [from.x, from.y, TAU * u(0.458_549_3) - PI];
            let found = drive_to(start, &goal, &config.drive, tolerance);
            let [time, _, _, nearest] = found.unwrap_or_else(|| panic!("{name}: {start:?} {goal:?}"));
            assert!(time < 15.0, "{name}: {time} s, {start:?} {goal:?}");
            let least = away.min(math::hypot(goal.x - TREE.x, goal.y - TREE.y));
            assert!(nearest > 0.8 * least, "{name}: {nearest} m, {start:?} {goal:?}");
        }
        // Neighbouring places, where ways that go straight and ways that go around meet.
        for k in -36..=36 {
            let goal = BaseGoal::facing(&TREE, PI + f64::from(k) * PI / 36.0, 1.2);
            let start = BaseGoal::facing(&TREE, PI, 1.2);
            let found = drive_to([start.x, start.y, start.yaw], &goal, &config.drive, tolerance);
            let [time, ..] = found.unwrap_or_else(|| panic!("{name}: bearing {k}: it never arrives"));
            assert!(time < 15.0, "{name}: bearing {k}: {time} s");
        }
    }
}

/// Places straight ahead or behind, on the line of the heading, from which the target is at one of the wanted distances: the base need not turn to reach them.
#[test]
fn places_straight_ahead_take_no_turn() {
    let law = Mobility::Wheels(WHEELS);
    let config = ExpertConfig::preset().shared;
    let tolerance = Tolerance::new(&config.align.position_tolerance, &config.align.angle_tolerance);
    let robot = at([0.3, -0.2, 0.4], 0.0, 0.0);
    let p = Vec3::new(1.1, 0.5, 1.0);
    let distances = [0.7, 0.62, 0.8];
    let places = law.straight_ahead(&robot, &p, &distances);
    assert_eq!(places.len(), 3);
    for (place, wanted) in places.iter().zip(distances) {
        assert!((math::hypot(p.x - place.x, p.y - place.y) - wanted).abs() < 1e-12);
        let along = place.distance(&robot);
        assert!((law.effort(&robot, place, &TREE, &config.drive, tolerance) - along).abs() < 1e-9);
    }
    // A place to the side costs turns; the same place costs a holonomic base less.
    let aside = BaseGoal { x: 0.3, y: 0.1, yaw: 0.4 };
    let effort = |law: &Mobility| law.effort(&robot, &aside, &TREE, &config.drive, tolerance);
    assert!(effort(&law) > effort(&Mobility::Ground) + 1.0);
    // Within the distances the base may stay.
    let near = at([0.55, 0.1, 0.4], 0.0, 0.0);
    let stay = law.straight_ahead(&near, &p, &distances)[0];
    assert_eq!([stay.x, stay.y, stay.yaw], near.base_pose);
    assert!(Mobility::Ground.straight_ahead(&near, &p, &distances).is_empty());
}
