//! The arm's kinematics compared with closed forms: Denavit-Hartenberg, finite differences, potential energy, reachable poses.

use nalgebra::{Matrix4, Vector6};
use orchard_geometry::{Pose, Vec3, math, transform};
use orchard_robot::{ArmKinematics, IkFailure, IkTarget, JointValues, JointVector, RobotModel};

/// Number of joints of the paper's arm.
const DOF: usize = 7;

/// Points of an additive recurrence over the joint ranges (golden-ratio family, dimension 7), shrunk by `margin`
/// of each range at both ends.
fn posture(arm: &ArmKinematics, n: u32, margin: f64) -> JointVector {
    let phi = 1.0969815577985598_f64; // root of x^8 = x + 1
    let mut alpha = 1.0;
    JointValues::from_fn(DOF, |i| {
        alpha /= phi;
        let fraction = (0.3 + f64::from(n) * alpha).fract();
        let l = arm.limits()[i];
        let inset = margin * (l.upper - l.lower);
        l.lower + inset + fraction * (l.upper - l.lower - 2.0 * inset)
    })
    .vector()
}

/// One row of Craig's convention: Rx(alpha) Tx(a) Rz(theta) Tz(d).
fn craig(a: f64, alpha: f64, d: f64, theta: f64) -> Matrix4<f64> {
    let ((sa, ca), (st, ct)) = (math::sin_cos(alpha), math::sin_cos(theta));
    Matrix4::new(
        ct,
        -st,
        0.0,
        a,
        st * ca,
        ct * ca,
        -sa,
        -d * sa,
        st * sa,
        ct * sa,
        ca,
        d * ca,
        0.0,
        0.0,
        0.0,
        1.0,
    )
}

#[test]
fn forward_kinematics_are_the_published_denavit_hartenberg_table() {
    let robot = RobotModel::paper();
    let arm = robot.kinematics();
    let quarter = std::f64::consts::FRAC_PI_2;
    let a = [0.0, 0.0, 0.0, 0.0825, -0.0825, 0.0, 0.088];
    let alpha = [0.0, -quarter, quarter, quarter, -quarter, quarter, quarter];
    let d = [0.333, 0.0, 0.316, 0.0, 0.384, 0.0, 0.0];
    let mount = Matrix4::new_translation(&Vec3::new(0.15, 0.0, 0.31));
    // Flange 0.107 m, hand turned -45 deg, TCP 0.1034 m from the hand.
    let tool = craig(0.0, 0.0, 0.107 + 0.1034, -std::f64::consts::FRAC_PI_4);
    for n in 0..200 {
        let q = posture(arm, n, 0.0);
        let mut x = mount;
        for i in 0..DOF {
            x *= craig(a[i], alpha[i], d[i], q[i]);
        }
        let difference = (x * tool - arm.tcp(&q).to_homogeneous()).abs().max();
        assert!(difference < 1e-12, "posture {n}: {difference}");
    }
}

#[test]
fn jacobian_is_the_derivative_of_the_pose() {
    let robot = RobotModel::paper();
    let arm = robot.kinematics();
    // Central differences err by h^2/6 times the third derivative (about 1 m) and round-off / h.
    let h = 1e-5;
    for n in 0..50 {
        let q = posture(arm, n, 0.0);
        let jacobian = arm.jacobian(&q);
        for i in 0..DOF {
            let mut step = JointVector::zeros();
            step[i] = h;
            let (before, after) = (arm.tcp(&(q - step)), arm.tcp(&(q + step)));
            let linear = (after.translation.vector - before.translation.vector) / (2.0 * h);
            let angular = (after.rotation * before.rotation.inverse()).scaled_axis() / (2.0 * h);
            let column = Vector6::from_iterator(angular.iter().chain(linear.iter()).copied());
            let difference = (column - jacobian.column(i)).amax();
            assert!(difference < 1e-9, "posture {n}, joint {i}: {difference}");
        }
    }
}

#[test]
fn axis_targets_leave_the_roll_free() {
    let robot = RobotModel::paper();
    let arm = robot.kinematics();
    let (p_base, z_base) = (Vec3::new(0.75, 0.1, 0.9), Vec3::new(0.8, 0.0, 0.6));
    let q = arm.solve(&IkTarget::Axis { p_base, z_base }, &arm.home()).unwrap();
    let x = arm.tcp(&q);
    assert!((x.translation.vector - p_base).norm() < 1e-3);
    assert!((x.rotation * Vec3::z()).dot(&z_base) > math::cos(0.5_f64.to_radians()));
    assert_eq!(
        arm.solve(&IkTarget::Axis { p_base, z_base }, &arm.home()).unwrap(),
        q,
        "same call, same answer"
    );
}

#[test]
fn out_of_reach_singular_and_not_finite_targets_end_in_an_error() {
    let robot = RobotModel::paper();
    let arm = robot.kinematics();
    let far = IkTarget::Pose(Pose::translation(3.0, 0.0, 1.0));
    assert!(
        matches!(arm.solve(&far, &arm.home()), Err(IkFailure::Unreachable { position, .. }) if position > 1.0)
    );
    let nan = IkTarget::Axis { p_base: Vec3::new(f64::NAN, 0.0, 0.0), z_base: Vec3::z() };
    assert_eq!(arm.solve(&nan, &arm.home()), Err(IkFailure::NotFinite));
    // Straight up, shoulder and wrist axes in one line: the Jacobian has lost rank.
    let straight = arm.clamped(&JointValues::from([0.0, 0.0, 0.0, 0.0, 0.0, 0.6, 0.0]).vector());
    let goal = arm.tcp(&straight);
    for shift in [Vec3::zeros(), Vec3::new(0.0, 0.0, 0.05), Vec3::new(0.02, 0.0, 0.0)] {
        let goal = IkTarget::Pose(Pose::from_parts((goal.translation.vector + shift).into(), goal.rotation));
        if let Ok(q) = arm.solve(&goal, &straight) {
            assert!(q.iter().all(|x| x.is_finite()));
        }
    }
    // The opposite of the present approach direction: the turn has no unique axis.
    let x = arm.tcp(&arm.home());
    let back = IkTarget::Axis { p_base: Vec3::new(0.4, 0.2, 0.8), z_base: -(x.rotation * Vec3::z()) };
    assert!(arm.solve(&back, &arm.home()).is_ok());
}

#[test]
fn shapes_follow_the_arm_and_the_fingers() {
    let robot = RobotModel::paper();
    let arm = robot.kinematics();
    let q = posture(arm, 3, 0.1);
    let tcp = arm.tcp(&q);
    let touching = |opening: f64| {
        let shapes = arm.link_shapes(&q, &[opening; 2]);
        shapes
            .iter()
            .filter(|(s, x)| {
                s.signed_distance(&orchard_geometry::inverse_transform(x, &tcp.translation.vector)) < 1e-9
            })
            .count()
    };
    assert_eq!(touching(0.0), 2, "closed pads meet at the TCP");
    assert_eq!(touching(0.01), 0);
    // The pads lie on the TCP's y axis.
    let p = transform(&tcp, &Vec3::new(0.0, 0.0102, 0.0));
    let shapes = arm.link_shapes(&q, &[0.01; 2]);
    assert!(shapes.iter().any(|(s, x)| s.signed_distance(&orchard_geometry::inverse_transform(x, &p)) < 0.0));
}

/// M(q) is symmetric, and its diagonal is the inertia that each joint moves with all other joints locked.
#[test]
fn the_accelerating_torque_is_the_mass_matrix_times_the_acceleration() {
    let robot = RobotModel::paper();
    let arm = robot.kinematics();
    for n in 0..50 {
        let q = posture(arm, n, 0.0);
        let alone = arm.reflected_inertia(&q);
        let unit = |k: usize| JointVector::from_fn(|i, _| f64::from(u8::from(i == k)));
        let columns: [JointVector; DOF] = std::array::from_fn(|k| arm.inertial_torque(&q, &unit(k)));
        for i in 0..DOF {
            // Round-off of sums of a few kg m^2.
            assert!(
                (columns[i][i] - alone[i]).abs() < 1e-12,
                "{n}, joint {i}: {} {}",
                columns[i][i],
                alone[i]
            );
            for (k, other) in columns.iter().enumerate() {
                assert!((columns[i][k] - other[i]).abs() < 1e-12, "{n}, joints {i} and {k}");
            }
        }
        let a = posture(arm, n + 100, 0.0);
        let sum: JointVector = (0..DOF).map(|k| columns[k] * a[k]).sum();
        assert!((arm.inertial_torque(&q, &a) - sum).amax() < 1e-12);
    }
}
