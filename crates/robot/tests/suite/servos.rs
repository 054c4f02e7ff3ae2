//! The robot in a world of its own: kinematics and gravity against `multibody`, servo laws in motion.

use crate::bench::{Bench, GRAVITY, NO_GRAVITY, SUBSTEP, TOUCHING, fixed, substeps};
use crate::grippers::Grip;
use orchard_geometry::{Pose, Rotation, Shape, Vec3, math};
use orchard_multibody::{forward_kinematics, gravity_torque};
use orchard_robot::{Command, JointValues, PartGroups, RobotModel};

/// Number of joints of the paper's arm.
const DOF: usize = 7;

/// The robot alone, or with a fixed block at `obstacle`.
fn bench(obstacle: Option<(Vec3, Vec3)>) -> Bench {
    bench_with(obstacle, None)
}

fn bench_with(obstacle: Option<(Vec3, Vec3)>, self_contact: Option<u32>) -> Bench {
    let groups = PartGroups { self_contact, ..TOUCHING };
    let add = |builder: &mut orchard_multibody::ModelBuilder| {
        if let Some((p, half)) = obstacle {
            builder.add_collider(fixed(Shape::Box { half }, p));
        }
    };
    Bench::with(&RobotModel::paper(), &groups, add).0
}

/// Runs under a command; `watch` sees the state after each substep.
fn run(bench: &mut Bench, command: &Command, seconds: f64, mut watch: impl FnMut(&Bench)) {
    for _ in 0..substeps(seconds) {
        bench.substep(command, &GRAVITY);
        watch(bench);
    }
}

#[test]
fn arm_kinematics_and_gravity_torque_agree_with_the_world_model() {
    let Bench { robot, model, mut data, handle, .. } = bench(None);
    let arm = robot.kinematics();
    for n in 0..20 {
        let q = JointValues::from_fn(DOF, |i| {
            let l = arm.limits()[i];
            l.lower + (f64::from(n) * 0.618 + 0.1 * i as f64).fract() * (l.upper - l.lower)
        })
        .vector();
        for i in 0..DOF {
            data.q[model.qs(handle.arm[i]).start] = q[i];
        }
        // At another place on the ground, turned.
        data.q[model.qs(*handle.base_joint.moving().unwrap())].copy_from_slice(&[0.3, -0.4, 0.7]);
        forward_kinematics(&model, &mut data);
        let x_world_base = handle.x_world_base(&data);
        let turn = Rotation::from_axis_angle(&Vec3::z_axis(), 0.7);
        let placed = Pose::from_parts(Vec3::new(0.3, -0.4, 0.0).into(), turn);
        assert!((x_world_base.to_homogeneous() - placed.to_homogeneous()).amax() < 1e-12);
        for (own, world) in
            [(arm.tcp(&q), handle.x_world_tcp(&data)), (arm.camera(&q), handle.x_world_camera(&data))]
        {
            let difference = (x_world_base * own).to_homogeneous() - world.to_homogeneous();
            assert!(difference.amax() < 1e-12);
        }
        let all = gravity_torque(&model, &data, &GRAVITY);
        let own = arm.gravity_torque(&q, &GRAVITY);
        for i in 0..DOF {
            assert!((own[i] - all[model.dofs(handle.arm[i]).start]).abs() < 1e-9, "posture {n}, joint {i}");
        }
    }
}

/// Gravity is compensated exactly, the height servo carries the robot's weight: nothing moves.
#[test]
fn at_rest_nothing_drifts() {
    let mut bench = bench(None);
    let start = bench.data.q.clone();
    let command = bench.robot.start_command();
    run(&mut bench, &command, 2.0, |_| {});
    let drift = start.iter().zip(&bench.data.q).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(drift < 1e-6, "{drift}");
}

#[test]
fn the_arm_goes_where_it_is_told_within_its_torque_and_speed_limits() {
    let mut bench = bench(None);
    let limits = bench.robot.kinematics().limits().to_vec();
    let mut command = bench.robot.start_command();
    command.arm_q = [1.0, -0.2, 0.4, -1.2, -0.6, 2.0, 1.5].into();
    let mut fastest = [0.0_f64; DOF];
    run(&mut bench, &command, 2.5, |b| {
        let o = b.observe();
        for i in 0..DOF {
            fastest[i] = fastest[i].max(o.arm_v[i].abs());
            // The implicit step may pass the limit by the inertia's change over one substep.
            assert!(o.arm_torque[i].abs() <= limits[i].effort * 1.02, "joint {i}: {}", o.arm_torque[i]);
        }
    });
    let o = bench.observe();
    for i in 0..DOF {
        assert!((o.arm_q[i] - command.arm_q[i]).abs() < 1e-3, "joint {i}: {}", o.arm_q[i]);
        assert!(fastest[i] < limits[i].velocity * 1.05, "joint {i}: {}", fastest[i]);
    }
}

#[test]
fn targets_outside_the_limits_stop_at_them_and_nonsense_is_ignored() {
    let mut bench = bench(None);
    let mut command = bench.robot.start_command();
    command.arm_q[3] = 5.0;
    command.arm_q[5] = f64::NAN;
    command.base_velocity = [f64::NAN, 0.0, 0.0];
    command.finger_q = f64::INFINITY;
    run(&mut bench, &command, 3.0, |_| {});
    let o = bench.observe();
    assert!((o.arm_q[3] - bench.robot.kinematics().limits()[3].upper).abs() < 1e-3);
    assert!((o.arm_q[5] - 2.77).abs() < 1e-3);
    assert!(bench.data.q.iter().chain(&bench.data.v).all(|x| x.is_finite()));
    assert!(o.base_pose.iter().all(|x| x.abs() < 1e-3));
}

/// The commanded velocity is in the base frame and ramps with the published acceleration.
#[test]
fn the_base_drives_in_its_own_frame_with_limited_acceleration() {
    let mut bench = bench(None);
    let mut command = bench.robot.start_command();
    let turned = 0.8;
    let planar = bench.model.qs(*bench.handle.base_joint.moving().unwrap()).start;
    bench.data.q[planar + 2] = turned;
    command.base_velocity = [3.0, 0.0, 0.0];
    let mut speed = 0.0_f64;
    run(&mut bench, &command, 1.5, |b| {
        let v = b.observe().base_velocity;
        let now = math::hypot(v[0], v[1]);
        assert!(now - speed < 2.5 * SUBSTEP * 1.05, "{speed} to {now}");
        speed = now;
    });
    let v = bench.observe().base_velocity;
    // Clamped to 1.1 m/s, along the base's x; the arm's reaction leaves no lasting error.
    assert!((v[0] - 1.1 * math::cos(turned)).abs() < 0.01 && (v[1] - 1.1 * math::sin(turned)).abs() < 0.01);
}

/// Against a wall the base pushes with its traction bound and no more.
#[test]
fn a_blocked_base_pushes_with_its_traction_bound() {
    let mut bench = bench(Some((Vec3::new(1.0, 0.0, 0.1), Vec3::new(0.1, 2.0, 0.1))));
    let mut command = bench.robot.start_command();
    command.base_velocity = [1.0, 0.0, 0.0];
    let mut strongest = 0.0_f64;
    let dof = bench.model.dofs(*bench.handle.base_joint.moving().unwrap()).start;
    run(&mut bench, &command, 3.0, |b| {
        let d = &b.data;
        strongest = strongest.max((d.torque[dof] - d.damping[dof] * d.v[dof]).abs());
    });
    assert!((899.0..900.0 * (1.0 + 1e-12)).contains(&strongest), "{strongest}");
    let x = bench.observe().base_pose[0];
    // 0.9 m to the wall's face less the chassis' half-length; 900 N on the contacts' 5e4 N/m sink at most 18 mm.
    assert!((0.42 - 0.001..0.42 + 0.02).contains(&x), "{x}");
}

/// The fingers close on a free block with the force they are given, stay symmetric and let go again.
#[test]
fn fingers_hold_with_the_commanded_force() {
    let robot = RobotModel::paper();
    // 4 mm off centre: the coupled fingers push it to the middle before they hold it.
    let mut grip = Grip::new(&robot, 0.03, 0.004);
    let mut command = robot.start_command();
    for (opening, force, seconds) in [(0.0, 70.0, 1.5), (0.0, 5.0, 1.0), (0.04, 70.0, 1.0)] {
        (command.finger_q, command.finger_force) = (opening, force);
        let o = grip.run(&command, &NO_GRAVITY, seconds);
        assert!((o.finger_q[0] - o.finger_q[1]).abs() < 2e-3, "{:?}", o.finger_q);
        if opening == 0.0 {
            // The drives exert the limit; radius less the depth to which 70 N press into 5e4 N/m.
            assert!((o.finger_force[0] + force).abs() < 0.02 * force, "{:?}", o.finger_force);
            assert!((o.finger_q[0] - 0.03).abs() < 3e-3, "{:?}", o.finger_q);
        } else {
            assert!((o.finger_q[0] - opening).abs() < 1e-3, "{:?}", o.finger_q);
        }
    }
}

/// Set points keep the published speeds and accelerations for any commands, however often they change.
#[test]
fn set_points_obey_the_published_speeds_and_accelerations() {
    let mut bench = bench(None);
    let limits = bench.robot.kinematics().limits().to_vec();
    let mut command = bench.robot.start_command();
    let (mut q_set, mut v_set) = bench.servos.arm_set();
    for n in 0..60 {
        for (i, limit) in limits.iter().enumerate() {
            let share = (0.618 * f64::from(n) + 0.37 * i as f64).fract();
            // Now and then beyond the range.
            command.arm_q[i] = limit.lower - 0.2 + share * (limit.upper - limit.lower + 0.4);
            // To rest, to pass, and to pass too fast, either way.
            command.arm_v[i] = 3.0 * f64::from((n + i as u32) % 3) * (share - 0.5);
        }
        let seconds = [0.05, 0.3, 0.7][n as usize % 3];
        run(&mut bench, &command, seconds, |b| {
            let (q, v) = b.servos.arm_set();
            let o = b.observe();
            for i in 0..DOF {
                // Round-off of numbers of a few units.
                assert!(
                    (v[i] - v_set[i]).abs() <= 10.0 * SUBSTEP + 1e-12,
                    "joint {i}: {} to {}",
                    v_set[i],
                    v[i]
                );
                assert!(v[i].abs() <= limits[i].velocity + 1e-12, "joint {i}: {}", v[i]);
                assert!((q[i] - q_set[i] - v[i] * SUBSTEP).abs() < 1e-12, "joint {i} jumps");
                assert!(limits[i].lower <= q[i] && q[i] <= limits[i].upper, "joint {i}: {}", q[i]);
                let effort = limits[i].effort * (1.0 + 1e-9);
                assert!(o.arm_torque[i].abs() <= effort, "joint {i}: {} N m", o.arm_torque[i]);
            }
            (q_set, v_set) = (q, v);
        });
    }
}

/// A smooth command is followed without lag: in a step from speed v to v + a h, the set point, which moves at v + a h all the while, is at
/// most a h^2 / 2 off, and makes up for it in the next step.
#[test]
fn a_smooth_command_is_followed_without_lag() {
    let mut bench = bench(None);
    let mut command = bench.robot.start_command();
    let start = command.arm_q;
    let (amplitude, rate) = (0.4, 3.0);
    let acceleration = amplitude * rate * rate;
    for n in 1..400 {
        let (sin, cos) = math::sin_cos(rate * f64::from(n) * SUBSTEP);
        for (i, q) in start.iter().enumerate() {
            command.arm_q[i] = q + amplitude * (1.0 - cos);
            command.arm_v[i] = amplitude * rate * sin;
        }
        let wanted = command.arm_q;
        run(&mut bench, &command, SUBSTEP, |b| {
            let (q, _) = b.servos.arm_set();
            for (q, wanted) in q.iter().zip(&wanted) {
                assert!((q - wanted).abs() <= acceleration * SUBSTEP * SUBSTEP, "{n}: {q} {wanted}");
            }
        });
    }
}

/// A commanded step ends at its goal without overshoot, in the time of the fastest motion: d = v^2 / a + v (T - 2 v / a).
#[test]
fn a_commanded_step_takes_the_shortest_time_that_the_limits_allow() {
    let mut bench = bench(None);
    let mut command = bench.robot.start_command();
    command.arm_q[0] = 1.5;
    let mut arrived = None;
    let mut time = 0.0;
    run(&mut bench, &command, 1.5, |b| {
        time += SUBSTEP;
        let q = b.servos.arm_set().0[0];
        assert!(q <= 1.5 + 1e-12, "{q}");
        if arrived.is_none() && 1.5 - q < 1e-9 {
            arrived = Some(time);
        }
    });
    let (v, a): (f64, f64) = (2.62, 10.0);
    let fastest = 1.5 / v + v / a;
    // Whole substeps at the start, at the end and where the speed limit is met.
    let arrived = arrived.expect("it arrives");
    assert!((arrived - fastest).abs() <= 3.0 * SUBSTEP, "{arrived} against {fastest}");
}

/// Against a fixed obstacle the base stands still and its wheels exert the bound.
#[test]
fn the_base_stalls_at_its_effort_limit() {
    let mut bench = bench(Some((Vec3::new(1.0, 0.0, 0.1), Vec3::new(0.1, 2.0, 0.1))));
    let mut command = bench.robot.start_command();
    command.base_velocity = [1.0, 0.0, 0.5];
    run(&mut bench, &command, 3.0, |_| {});
    let dof = bench.model.dofs(*bench.handle.base_joint.moving().unwrap()).start;
    let before = bench.observe().base_pose;
    run(&mut bench, &command, 1.0, |b| {
        let effort = |k: usize| b.data.torque[dof + k] - b.data.damping[dof + k] * b.data.v[dof + k];
        assert!(math::hypot(effort(0), effort(1)) <= 900.0 * (1.0 + 1e-12));
        assert!(effort(2).abs() <= 350.0 * (1.0 + 1e-12));
    });
    let after = bench.observe().base_pose;
    // No more than the contact's damping lets the base creep in a second.
    let moved = (0..3).map(|k| (after[k] - before[k]).abs()).fold(0.0, f64::max);
    assert!(moved < 2e-3, "{moved}");
}

/// Gravity compensation holds the arm where it is: stretched out, folded, and with its torques near their limits.
#[test]
fn the_arm_holds_any_posture_without_drift() {
    for arm_q in [
        [0.0, 1.4, 0.0, -0.3, 0.0, 1.9, 0.785],
        [1.2, 0.3, -0.5, -1.8, 0.8, 2.2, -0.4],
        [-2.0, -0.9, 0.9, -2.6, -1.5, 1.2, 2.0],
    ] {
        let mut bench = bench(None);
        let mut command = bench.robot.start_command();
        command.arm_q = arm_q.into();
        run(&mut bench, &command, 4.0, |_| {});
        let held = bench.observe().arm_q;
        let worst = (0..DOF).map(|i| (held[i] - arm_q[i]).abs()).fold(0.0, f64::max);
        // The chassis settles on its servo; the arm's own weight is compensated exactly.
        assert!(worst < 1e-3, "{worst} rad");
        run(&mut bench, &command, 4.0, |_| {});
        let later = bench.observe().arm_q;
        let drift = (0..DOF).map(|i| (held[i] - later[i]).abs()).fold(0.0, f64::max);
        assert!(drift < 1e-6, "{drift} rad");
    }
}

/// The lowest of the robot's group bits in these tests.
const LINKS: u32 = 16;

/// Commanded through the bucket's wall, the deck and its own mount, the arm stops at their surfaces.
#[test]
fn the_arm_does_not_pass_through_the_robot() {
    let mut paths = Vec::new();
    // Swung round over the bucket and down into its wall and floor, beside it onto the deck, back onto its own shoulder.
    paths.push(([[2.6, -0.6, 0.0, -2.2, 0.0, 1.7, 0.785], [2.6, 0.4, 0.0, -2.6, 0.0, 1.7, 0.785]], "bucket"));
    paths.push(([[1.6, -0.2, 0.0, -2.4, 0.0, 1.7, 0.785], [1.6, 0.7, 0.0, -2.7, 0.0, 1.7, 0.785]], "deck"));
    paths.push(([[0.0, -0.7, 0.0, -2.4, 0.0, 1.7, 0.785], [0.0, -0.7, 0.0, -3.04, 0.0, 0.55, 0.785]], "arm"));
    for (path, what) in paths {
        let [above, inside] = path.map(JointValues::from);
        let mut bench = bench_with(None, Some(LINKS));
        let limits = bench.robot.kinematics().limits().to_vec();
        let mut command = bench.robot.start_command();
        command.arm_q = above;
        run(&mut bench, &command, 3.0, |_| {});
        assert!(bench.robot.kinematics().self_distance(&above.vector()).distance > 0.0, "{what}");
        let at_target = bench.robot.kinematics().self_distance(&inside.vector());
        assert!(at_target.distance < -0.01, "{what}: {at_target:?}");
        command.arm_q = inside;
        let mut last = bench.robot.kinematics().self_distance(&above.vector()).distance;
        let (mut deepest, mut farthest, mut strongest) = (f64::INFINITY, 0.0_f64, 0.0_f64);
        run(&mut bench, &command, 4.0, |b| {
            let o = b.observe();
            let distance = b.robot.kinematics().self_distance_with(&o.arm_q.vector(), &o.finger_q).distance;
            farthest = farthest.max(last - distance);
            (deepest, last) = (deepest.min(distance), distance);
            for (torque, limit) in o.arm_torque.iter().zip(&limits) {
                let share = torque.abs() / limit.effort;
                assert!(share <= 1.0 + 1e-9, "{what}: {torque} N m of {}", limit.effort);
                strongest = strongest.max(share);
            }
        });
        println!(
            "{what}: {:.2} mm deep, at rest {:.2} mm, torque {strongest:.3}",
            -1e3 * deepest,
            -1e3 * last
        );
        assert!(last > -2e-3, "{what}: {last}");
        // Contacts are detected from 5 mm on: a link that closes in by more in a substep sinks in for that substep.
        assert!(deepest > -2e-3 - (farthest - 0.005).max(0.0), "{what}: {deepest}, {farthest} in a substep");
        assert!(strongest > 0.99, "{what}: {strongest}");
        assert!(bench.data.q.iter().all(|x| x.is_finite()));
    }
}
