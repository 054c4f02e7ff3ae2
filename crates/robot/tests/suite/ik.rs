//! Inverse kinematics of every robot that comes with the crate: reachable poses, continuous paths, singular postures.

use orchard_geometry::{Pose, Rotation, Vec3};
use orchard_robot::{
    ArmKinematics, IkFailure, IkTarget, JointVector, QpGoal, QpState, QpStatus, QpTask, RobotModel,
};

/// Period of the controllers \[s\].
const DT: f64 = 1.0 / 60.0;

/// Postures spread over the joint ranges: points of an additive recurrence by the square roots of primes, `skip` of them passed over.
fn postures(arm: &ArmKinematics, skip: u32) -> impl Iterator<Item = JointVector> {
    let alpha = [2.0_f64, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0].map(f64::sqrt);
    (skip..).map(move |n| {
        let mut joint = 0;
        arm.posture_at(|| {
            joint += 1;
            (0.5 + f64::from(n) * alpha[joint - 1]).fract()
        })
    })
}

fn for_every_robot(check: impl Fn(&str, &ArmKinematics)) {
    for name in RobotModel::names() {
        check(name, RobotModel::named(name).unwrap().kinematics());
    }
}

#[test]
fn both_solvers_reach_nearly_all_reachable_poses_of_every_robot() {
    for_every_robot(|name, arm| {
        let clear = postures(arm, 0).filter(|q| arm.self_distance(q).distance > 0.0);
        let trials: Vec<_> = clear.take(300).map(|q| arm.try_pose_of(&q)).collect();
        let missed = |is_solved: fn(&orchard_robot::IkTrial) -> bool| {
            trials.iter().filter(|trial| !is_solved(trial)).count()
        };
        let missed = [missed(|t| t.least_squares), missed(|t| t.program)];
        assert!(missed.iter().all(|&missed| missed <= 3), "{name}: missed {missed:?} of {}", trials.len());
    });
}

/// Ratio of the smallest to the largest singular value of the Jacobian, a metre of translation as a radian.
fn conditioning(arm: &ArmKinematics, q: &JointVector) -> f64 {
    let jacobian = arm.jacobian(q);
    let values = (jacobian * jacobian.transpose()).symmetric_eigenvalues();
    (values.min().max(0.0) / values.max()).sqrt()
}

/// Singular postures near random ones: each joint in turn, three times round, goes to where the Jacobian is worst, on a grid over its range
/// that is refined twice. Stretched arms and aligned wrist axes are among them. Also the postures with all joints at 0 and at either end.
fn singular_postures(arm: &ArmKinematics) -> Vec<JointVector> {
    let mut found = vec![arm.clamped(&JointVector::zeros()), arm.posture_at(|| 0.0), arm.posture_at(|| 1.0)];
    for mut q in postures(arm, 1000).take(4) {
        for joint in (0..arm.dof()).cycle().take(3 * arm.dof()) {
            q[joint] = worst_position(arm, q, joint);
            found.push(q);
        }
    }
    found
}

/// Position of a joint at which the Jacobian is worst with the others as they are.
fn worst_position(arm: &ArmKinematics, mut q: JointVector, joint: usize) -> f64 {
    const GRID: u32 = 64;
    let limit = arm.limits()[joint];
    let (mut low, mut high) = (limit.lower, limit.upper);
    for _ in 0..3 {
        let step = (high - low) / f64::from(GRID);
        let mut cost = |x: f64| {
            q[joint] = x;
            conditioning(arm, &q)
        };
        let costs = (0..=GRID).map(|k| low + step * f64::from(k)).map(|x| (x, cost(x)));
        let best = costs.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap().0;
        (low, high) = ((best - step).max(limit.lower), (best + step).min(limit.upper));
        q[joint] = best;
    }
    q[joint]
}

/// Each solver answers with a posture within the limits or an error, never with a number that is none.
#[test]
fn singular_postures_end_in_a_posture_or_an_error() {
    for_every_robot(|name, arm| {
        let singular = singular_postures(arm);
        let worst = singular.iter().map(|q| conditioning(arm, q)).fold(f64::INFINITY, f64::min);
        assert!(worst < 1e-4, "{name}: no singular posture among them, at best {worst}");
        for (n, q) in singular.iter().enumerate() {
            let x = arm.tcp(q);
            let shifts =
                [Vec3::zeros(), Vec3::x() * 0.05, Vec3::y() * 0.05, Vec3::z() * 0.05, -Vec3::z() * 0.05];
            let turn = Rotation::from_axis_angle(&Vec3::y_axis(), 0.3);
            for (shift, turn) in shifts.into_iter().zip([Rotation::identity(), turn].into_iter().cycle()) {
                let p = x.translation.vector + shift;
                let target = IkTarget::Pose(Pose::from_parts(p.into(), turn * x.rotation));
                for found in [arm.solve_near(&target, q), arm.solve_qp_near(&target, q)] {
                    match found {
                        Ok(q) => assert_eq!(arm.clamped(&q), q, "{name}, posture {n}"),
                        Err(IkFailure::Unreachable { position, angle }) => {
                            assert!(position.is_finite() && angle.is_finite(), "{name}, posture {n}");
                        }
                        Err(IkFailure::NotFinite) => panic!("{name}, posture {n}: not finite"),
                    }
                }
                let task = QpTask::Approach { target, gain: 5.0, speed: 0.6, turn_speed: 2.0 };
                let goal = QpGoal { task, posture: arm.home(), held: None };
                let step = arm.velocity_step(&QpState::resting(*q), &goal, &[], DT);
                assert!(step.v.iter().chain(&step.q_next).all(|x| x.is_finite()), "{name}, posture {n}");
                assert_ne!(step.status, QpStatus::NotFinite, "{name}, posture {n}");
                assert_eq!(arm.clamped(&step.q_next), step.q_next, "{name}, posture {n}");
            }
        }
    });
}

/// A pose that some posture has is never refused as out of reach, however far the arm is stretched; one farther away than that is, at once.
#[test]
fn only_poses_out_of_reach_are_refused_at_once() {
    for_every_robot(|name, arm| {
        for q in postures(arm, 3000).take(2000).chain(singular_postures(arm)) {
            let x = arm.tcp(&q);
            assert_eq!(arm.solve_near(&IkTarget::Pose(x), &q), Ok(arm.clamped(&q)), "{name}");
            let away = (x.translation.vector - arm.shoulder()).normalize() * 3.0;
            let beyond = Pose::from_parts((x.translation.vector + away).into(), x.rotation);
            let found = arm.solve_near(&IkTarget::Pose(beyond), &q);
            assert!(
                matches!(found, Err(IkFailure::Unreachable { position, angle: 0.0 }) if position > 0.5),
                "{name}: {found:?}"
            );
        }
    });
}

/// Targets on the way of the tool from one posture to another, each solved from the last answer: both solvers follow, and no joint moves
/// much faster than the joints that made the path.
#[test]
fn the_solution_follows_a_continuous_path_without_a_jump() {
    const STEPS: u32 = 60;
    for_every_robot(|name, arm| {
        // Half as much again as the least distance that the programs keep.
        let clear = |q: &JointVector| arm.self_distance(q).distance > 0.015;
        let ends: Vec<JointVector> = postures(arm, 2000).take(1000).filter(clear).take(12).collect();
        assert_eq!(ends.len(), 12, "{name}: too few postures clear of the robot itself");
        let mut followed = 0;
        for (n, pair) in ends.chunks(2).enumerate() {
            // A third of the way between two postures, so that the tool sweeps a metre or so.
            let (a, b) = (pair[0], pair[0] + (pair[1] - pair[0]) / 3.0);
            let mut last = [Some(a); 2];
            for k in 1..=STEPS {
                let on_path = a + (b - a) * (f64::from(k) / f64::from(STEPS));
                let target = IkTarget::Pose(arm.tcp(&on_path));
                for (solver, last) in ["least squares", "programs"].iter().zip(&mut last) {
                    let Some(from) = *last else { continue };
                    let next = match *solver {
                        "programs" => arm.solve_qp_near(&target, &from),
                        _ => arm.solve_near(&target, &from),
                    };
                    // A path ends where a solver cannot meet the target from here, such as at a limit of its branch.
                    *last = next.ok();
                    let Some(q) = *last else { continue };
                    followed += 1;
                    let step = (q - from).amax();
                    assert!(step < 0.3, "{name}, path {n}, {solver}: a joint jumps by {step} rad at {k}");
                }
            }
        }
        assert!(2 * followed > 12 * STEPS, "{name}: only {followed} of {} targets followed", 12 * STEPS);
    });
}
