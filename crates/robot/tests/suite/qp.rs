//! The quadratic programs of the arm: gradients of distances, limits, singularities, obstacles.

use nalgebra::Vector6;
use orchard_geometry::{Pose, Vec3, math};
use orchard_robot::{
    ArmKinematics, IkTarget, JointValues, JointVector, Obstacle, QpGoal, QpState, QpStatus, QpTask,
    RobotModel,
};

/// Number of joints of the paper's arm.
const DOF: usize = 7;

const DT: f64 = 1.0 / 60.0;
/// Penalty of a practically hard constraint: errors of the TCP are of the order of 1 (m/s)^2.
const DEAR: f64 = 10.0;
/// Published acceleration of the joints [rad/s2].
const ACCELERATION: f64 = 10.0;

/// Points of an additive recurrence over the joint ranges.
fn posture(arm: &ArmKinematics, n: u32) -> JointVector {
    let phi = 1.0969815577985598_f64; // root of x^8 = x + 1
    let mut alpha = 1.0;
    JointValues::from_fn(DOF, |i| {
        alpha /= phi;
        let l = arm.limits()[i];
        l.lower + (0.7 + f64::from(n) * alpha).fract() * (l.upper - l.lower)
    })
    .vector()
}

fn approach(arm: &ArmKinematics, target: IkTarget) -> QpGoal {
    let task = QpTask::Approach { target, gain: 5.0, speed: 0.6, turn_speed: 2.0 };
    QpGoal { task, posture: arm.home(), held: None }
}

/// Takes a step and checks the invariants of every step.
fn checked(arm: &ArmKinematics, state: &mut QpState, goal: &QpGoal, obstacles: &[Obstacle]) -> QpStatus {
    let step = arm.velocity_step(state, goal, obstacles, DT);
    for i in 0..DOF {
        let limit = arm.limits()[i];
        // Round-off of sums of numbers of a few units.
        let tiny = 1e-12;
        assert!(
            (step.v[i] - state.v[i]).abs() <= ACCELERATION * DT + tiny,
            "joint {i}: {} to {}",
            state.v[i],
            step.v[i]
        );
        assert!(step.v[i].abs() <= limit.velocity + tiny, "joint {i}: {}", step.v[i]);
        assert!(
            limit.lower <= step.q_next[i] && step.q_next[i] <= limit.upper,
            "joint {i}: {}",
            step.q_next[i]
        );
        assert!((step.q_next[i] - state.q[i] - step.v[i] * DT).abs() < 1e-9, "joint {i} jumps");
    }
    *state = QpState { q: step.q_next, v: step.v };
    step.status
}

#[test]
fn distances_change_with_their_gradients() {
    let robot = RobotModel::paper();
    let arm = robot.kinematics();
    // Central differences err by h^2/6 of the third derivative and, where the closest features change within the step,
    // by h/2 of the jump of the second: at distances over 1 cm curvatures are under lever^2 / distance, 100 m/rad^2.
    let h = 1e-6;
    let mut compared = 0;
    for n in 0..400 {
        let q = posture(arm, n);
        let here = arm.self_distance(&q);
        if here.distance < 0.01 {
            continue;
        }
        for i in 0..DOF {
            let mut step = JointVector::zeros();
            step[i] = h;
            let (before, after) = (arm.self_distance(&(q - step)), arm.self_distance(&(q + step)));
            if before.links != here.links || after.links != here.links {
                continue;
            }
            let slope = (after.distance - before.distance) / (2.0 * h);
            assert!(
                (slope - here.gradient[i]).abs() < 1e-4,
                "posture {n}, joint {i}: {slope} {}",
                here.gradient[i]
            );
            compared += 1;
        }
    }
    assert!(compared > 1000, "{compared}");
}

#[test]
fn a_free_step_follows_the_twist() {
    let robot = RobotModel::paper();
    let arm = robot.kinematics();
    let mut state = QpState::resting(arm.home());
    let wanted = Vector6::new(0.0, 0.0, 0.2, 0.05, 0.1, -0.05);
    let goal = QpGoal { task: QpTask::Twist(wanted), posture: arm.home(), held: None };
    for _ in 0..30 {
        let status = checked(arm, &mut state, &goal, &[]);
        assert_eq!(status, QpStatus::Free);
    }
    // Damping takes the share damping / sigma^2 of each singular direction: 1e-4 / 0.06^2 at home.
    let error = arm.jacobian(&state.q) * state.v - wanted;
    assert!(error.norm() < 0.03 * wanted.norm(), "{error}");
}

#[test]
fn it_reaches_a_pose_and_rests_there() {
    let robot = RobotModel::paper();
    let arm = robot.kinematics();
    let mut state = QpState::resting(arm.home());
    let x = arm.tcp(&arm.home()) * Pose::translation(0.05, -0.1, 0.12);
    let goal = approach(arm, IkTarget::Pose(x));
    for _ in 0..180 {
        checked(arm, &mut state, &goal, &[]);
    }
    let off = (arm.tcp(&state.q).translation.vector - x.translation.vector).norm();
    // The arm may still go towards its preferred posture, but the TCP stands still.
    let twist = arm.jacobian(&state.q) * state.v;
    assert!(off < 1e-4 && twist.norm() < 1e-3 && state.v.amax() < 0.02, "{off} m, {twist}");
}

/// The target circles out of reach, through the stretched arm, and back: twice round in 12 s.
#[test]
fn a_target_out_of_reach_and_back_makes_no_jump() {
    let robot = RobotModel::paper();
    let arm = robot.kinematics();
    let mut state = QpState::resting(arm.home());
    let start = arm.tcp(&arm.home());
    let mut farthest: f64 = 0.0;
    for k in 0..720 {
        let (sin, cos) = math::sin_cos(f64::from(k) / 360.0 * std::f64::consts::TAU);
        let p = start.translation.vector + Vec3::new(0.5 - 0.5 * cos, 0.3 * sin, 0.0);
        let goal = approach(arm, IkTarget::Pose(Pose::from_parts(p.into(), start.rotation)));
        checked(arm, &mut state, &goal, &[]);
        farthest = farthest.max((arm.tcp(&state.q).translation.vector - p).norm());
    }
    assert!(farthest > 0.2, "the circle leaves the reach: {farthest}");
    let p_end = arm.tcp(&state.q).translation.vector;
    // A target at 0.3 m x 2 pi / 6 s, followed at a gain of 5/s, is 63 mm ahead.
    assert!((p_end - start.translation.vector).norm() < 0.07, "{p_end}");
}

#[test]
fn singular_and_extreme_states_stay_within_the_limits() {
    let robot = RobotModel::paper();
    let arm = robot.kinematics();
    let stretched = arm.clamped(&JointValues::from([0.0, 0.4, 0.0, 0.0, 0.0, 1.0, 0.0]).vector());
    let aligned = arm.clamped(&JointValues::from([0.0, -0.4, 0.0, -1.8, 0.0, 0.0, 0.0]).vector());
    let lowest = JointValues::from_fn(DOF, |i| arm.limits()[i].lower).vector();
    let highest = JointValues::from_fn(DOF, |i| arm.limits()[i].upper).vector();
    for start in [stretched, aligned, lowest, highest] {
        for n in 0..24 {
            let mut state = QpState::resting(start);
            let mut twist = Vector6::zeros();
            twist[n % 6] = if n < 12 { 1.0 } else { -1.0 } * if n % 12 < 6 { 0.3 } else { 30.0 };
            let goal = QpGoal { task: QpTask::Twist(twist), posture: arm.home(), held: None };
            for _ in 0..40 {
                checked(arm, &mut state, &goal, &[]);
            }
        }
    }
}

#[test]
fn the_arm_does_not_run_into_itself_or_the_robot() {
    let robot = RobotModel::paper();
    let arm = robot.kinematics();
    // Into the bucket's wall, into the chassis, into the arm's own mount.
    for p in [Vec3::new(-0.26, 0.15, 0.4), Vec3::new(0.4, 0.2, 0.1), Vec3::new(0.15, 0.0, 0.5)] {
        let mut state = QpState::resting(arm.home());
        let down =
            arm.tcp(&JointValues::from([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785]).vector()).rotation;
        let goal = approach(arm, IkTarget::Pose(Pose::from_parts(p.into(), down)));
        let mut nearest = f64::INFINITY;
        for _ in 0..360 {
            assert_ne!(checked(arm, &mut state, &goal, &[]), QpStatus::Braking);
            nearest = nearest.min(arm.self_distance(&state.q).distance);
        }
        println!("{p:?}: {nearest:.4} m, at rest {:?}", arm.self_distance(&state.q));
        // Kept at 10 mm; a step of the linearised distance errs by its curvature times the square of the step.
        assert!(nearest > 0.005, "{nearest}");
    }
}

/// An object in the hand, lowered onto the deck beside the bucket, stops above the deck with the clearance between links.
#[test]
fn what_the_hand_holds_is_kept_off_the_robot() {
    let robot = RobotModel::paper();
    let arm = robot.kinematics();
    let down = arm.tcp(&JointValues::from([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785]).vector()).rotation;
    let lowest = |held: Option<f64>| {
        let mut state = QpState::resting(arm.home());
        for z in [0.6, 0.1] {
            let p = Vec3::new(0.1, 0.33, z);
            let target = IkTarget::Pose(Pose::from_parts(p.into(), down));
            let goal = QpGoal { held, ..approach(arm, target) };
            for _ in 0..240 {
                checked(arm, &mut state, &goal, &[]);
            }
        }
        arm.tcp(&state.q).translation.z
    };
    // Deck at 0.28 m, clearance 0.01 m; a corner on a flat side may take a millimetre of it.
    let (empty, full) = (lowest(None), lowest(Some(0.04)));
    assert!((full - 0.33).abs() < 2e-3, "{full}");
    assert!(empty < full - 0.01, "{empty}");
}

#[test]
fn obstacles_are_kept_clear_of_and_never_make_it_fail() {
    let robot = RobotModel::paper();
    let arm = robot.kinematics();
    let x = arm.tcp(&arm.home());
    let ahead = x * Pose::translation(0.0, 0.0, 0.3);
    let goal = approach(arm, IkTarget::Pose(ahead));
    // In the path of the hand.
    let blocked = (x * Pose::translation(0.0, 0.0, 0.15)).translation.vector;
    let wall: Vec<Obstacle> = (0..9)
        .map(|k| {
            let (i, j) = (f64::from(k % 3) - 1.0, f64::from(k / 3) - 1.0);
            let p_base = (x * Pose::translation(0.08 * i, 0.08 * j, 0.15)).translation.vector;
            Obstacle { p_base, clearance: 0.05, penalty: DEAR }
        })
        .collect();
    let nearest = |q: &JointVector| {
        let shapes = arm.link_shapes(q, &[arm.finger_stroke(); 2]);
        let away = |(shape, pose): &(orchard_geometry::Shape, Pose)| {
            shape.signed_distance(&orchard_geometry::inverse_transform(pose, &blocked))
        };
        shapes.iter().map(away).fold(f64::INFINITY, f64::min)
    };
    let mut state = QpState::resting(arm.home());
    for _ in 0..240 {
        assert_ne!(checked(arm, &mut state, &goal, &wall), QpStatus::Braking);
        assert!(nearest(&state.q) > 0.04, "{}", nearest(&state.q));
    }
    // Among leaves on all sides no clearance can be kept, and the step still succeeds.
    let buried: Vec<Obstacle> = (0..40)
        .map(|k| {
            let at = arm.tcp(&posture(arm, k)).translation.vector;
            Obstacle {
                p_base: x.translation.vector + 0.1 * (at - x.translation.vector),
                clearance: 0.3,
                penalty: DEAR,
            }
        })
        .collect();
    let mut state = QpState::resting(arm.home());
    for _ in 0..60 {
        assert_ne!(checked(arm, &mut state, &goal, &buried), QpStatus::Braking);
    }
}

#[test]
fn nonsense_brakes_or_is_passed_over() {
    let robot = RobotModel::paper();
    let arm = robot.kinematics();
    let moving = QpState { q: arm.home(), v: JointVector::repeat(1.0) };
    let nowhere = IkTarget::Axis { p_base: Vec3::new(f64::NAN, 0.0, 0.0), z_base: Vec3::z() };
    let mut state = moving;
    assert_eq!(checked(arm, &mut state, &approach(arm, nowhere), &[]), QpStatus::Braking);
    assert!(state.v.iter().all(|v| (v - (1.0 - ACCELERATION * DT)).abs() < 1e-12), "{}", state.v);
    let goal = approach(arm, IkTarget::Pose(arm.tcp(&arm.home())));
    let odd = [f64::NAN, f64::INFINITY].map(|x| Obstacle {
        p_base: Vec3::new(x, 0.0, 0.0),
        clearance: 0.1,
        penalty: DEAR,
    });
    let mut with = moving;
    let mut without = moving;
    assert_eq!(checked(arm, &mut with, &goal, &odd), checked(arm, &mut without, &goal, &[]));
    assert_eq!(with, without);
    let lost = QpState { q: JointVector::repeat(f64::NAN), v: JointVector::zeros() };
    let step = arm.velocity_step(&lost, &goal, &[], DT);
    assert_eq!((step.status, step.v), (QpStatus::NotFinite, JointVector::zeros()));
}

#[test]
fn equal_arguments_give_equal_bits() {
    let robot = RobotModel::paper();
    let arm = robot.kinematics();
    let x = arm.tcp(&arm.home()) * Pose::translation(0.0, 0.0, 0.2);
    let leaf = Obstacle { p_base: x.translation.vector, clearance: 0.08, penalty: DEAR };
    let run = || {
        let mut state = QpState::resting(arm.home());
        for _ in 0..90 {
            checked(arm, &mut state, &approach(arm, IkTarget::Pose(x)), &[leaf]);
        }
        state
    };
    assert_eq!(run(), run());
}
