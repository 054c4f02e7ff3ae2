use super::*;
use crate::{Status, World};
use orchard_robot::RobotModel;
use std::sync::Arc;

/// The sensors `ideal` with changes to them, given as the table `sensing` of a config.
fn spec(changes: &str) -> Spec {
    let text = format!("[sensing]\nbase = 'ideal'\n{changes}");
    Spec::paper().overlaid("x.toml", text.parse().unwrap()).unwrap()
}

/// Sensors of a robot without an arm in many worlds.
fn drives(changes: &str, worlds: u32) -> Vec<Sensing> {
    let sensing = spec(changes).sensing.unwrap();
    (0..worlds).map(|world| Sensing::of(sensing.clone(), 0, true, 60.0, 5, world)).collect()
}

fn figure(name: &str, value: f64, unit: &str) -> String {
    format!("{name} = {{ value = {value}, range = [0, 500], unit = '{unit}', source = 'x' }}\n")
}

/// Odometry at the end of a way that begins at the origin, by the poses at the ends of its frames.
fn after(sensing: &Sensing, way: impl Iterator<Item = [f64; 3]>) -> [f64; 3] {
    let mut odometry = Odometry::at([0.0; 3]);
    for (frame, exact) in (1..).zip(way) {
        sensing.travel(&mut odometry, exact, frame);
    }
    odometry.measured
}

fn mean_and_sd(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, (values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / (n - 1.0)).sqrt())
}

/// 4 m straight ahead in 480 frames, and half a turn on the spot in 120 frames.
fn straight() -> impl Iterator<Item = [f64; 3]> {
    (1..=480).map(|frame| [4.0 * f64::from(frame) / 480.0, 0.0, 0.0])
}

fn half_turn() -> impl Iterator<Item = [f64; 3]> {
    (1..=120).map(|frame| [0.0, 0.0, std::f64::consts::PI * f64::from(frame) / 120.0])
}

#[test]
fn odometry_has_the_stated_errors() {
    const WORLDS: u32 = 2000;
    // Four standard errors of a standard deviation, s / sqrt(2 n), and of a mean.
    let near = |values: Vec<f64>, mean: f64, sd: f64| {
        let (m, s) = mean_and_sd(&values);
        let n = f64::from(WORLDS);
        assert!((s / sd - 1.0).abs() < 4.0 / (2.0 * n).sqrt(), "sd {s}, not {sd}");
        assert!((m - mean).abs() < 4.0 * sd / n.sqrt(), "mean {m}, not {mean}");
    };
    let odometry = |figures: &str| format!("[sensing.odometry]\n{figures}");
    let both = figure("distance_slip", 0.03, "1") + &figure("distance_noise", 20.0, "mm");
    let of = drives(&odometry(&both), WORLDS);
    // Slip in proportion to the way, noise with its root.
    let sd = math::hypot(0.03 * 4.0, 0.02 * 2.0);
    near(of.iter().map(|s| after(s, straight())[0]).collect(), 4.0, sd);
    assert!(of.iter().all(|s| after(s, straight())[1..] == [0.0; 2]));
    // The sum of 120 turns rounds.
    assert!(of.iter().all(|s| (after(s, half_turn())[2] - std::f64::consts::PI).abs() < 1e-13));
    let of = drives(&odometry(&figure("turn_slip", 0.1, "1")), WORLDS);
    near(
        of.iter().map(|s| after(s, half_turn())[2]).collect(),
        std::f64::consts::PI,
        0.1 * std::f64::consts::PI,
    );
    let of = drives(&odometry(&figure("heading_noise", 1.0, "deg")), WORLDS);
    near(of.iter().map(|s| after(s, straight())[2]).collect(), 0.0, 2.0_f64.to_radians());
    // The sum of 120 turns rounds.
    assert!(of.iter().all(|s| (after(s, half_turn())[2] - std::f64::consts::PI).abs() < 1e-13));
}

#[test]
fn a_base_on_a_rail_keeps_its_heading() {
    let figures = figure("heading_noise", 5.0, "deg") + &figure("distance_slip", 0.1, "1");
    let sensing = spec(&format!("[sensing.odometry]\n{figures}")).sensing.unwrap();
    let rail = Sensing::of(sensing, 0, false, 60.0, 5, 0);
    let [x, y, yaw] = after(&rail, straight());
    assert!((x / 4.0 - 1.0 - rail.slip[0]).abs() < 1e-12 && rail.slip[0] != 0.0);
    assert_eq!([y, yaw], [0.0; 2]);
}

fn world(spec: Spec) -> World {
    World::new(Arc::new(spec), Arc::new(RobotModel::paper()), 1, 0).unwrap()
}

/// Drives ahead and turns for some frames.
fn drive(world: &mut World, frames: u32) {
    let command = Command { base_velocity: [0.4, 0.1, 0.3], ..world.robot().start_command() };
    (0..frames).for_each(|_| world.step(&command));
    assert_eq!(*world.status(), Status::Running);
}

fn bits(world: &World) -> Vec<u64> {
    world.data().q.iter().chain(&world.data().v).map(|x| x.to_bits()).collect()
}

/// All readings but those of the camera.
fn readings(world: &World) -> String {
    format!("{:?}", world.sense())
}

#[test]
fn ideal_sensors_cost_no_bit() {
    let (mut exact, mut ideal) = (world(Spec::paper()), world(spec("")));
    for world in [&mut exact, &mut ideal] {
        drive(world, 30);
    }
    assert_eq!(bits(&exact), bits(&ideal));
    assert_eq!(readings(&exact), readings(&ideal));
    assert_eq!(exact.x_world_odom(), ideal.x_world_odom());
}

#[test]
fn errors_of_sensors_change_readings_and_nothing_else() {
    let joints =
        figure("offset", 0.5, "deg") + &figure("noise", 0.1, "deg") + &figure("torque_noise", 1.0, "N m");
    let odometry = figure("distance_slip", 0.1, "1") + &figure("heading_noise", 5.0, "deg");
    let noisy = format!("[sensing.odometry]\n{odometry}[sensing.joints]\n{joints}");
    let (mut exact, mut noisy) = (world(Spec::paper()), world(spec(&noisy)));
    for world in [&mut exact, &mut noisy] {
        drive(world, 60);
    }
    assert_eq!(bits(&exact), bits(&noisy));
    let (true_read, read) = (exact.sense(), noisy.sense());
    assert_eq!(format!("{read:?}"), readings(&noisy), "a frame is read the same way every time");
    assert!(true_read.arm_q.iter().zip(&read.arm_q).all(|(a, b)| a != b && (a - b).abs() < 0.06));
    assert_eq!(true_read.arm_v, read.arm_v);
    assert_ne!(true_read.base_pose, read.base_pose);
    // In the odom frame that drifts, the base is where the wheels say that it is.
    let x_world_base = noisy.handle().x_world_base(noisy.data());
    let difference = (noisy.x_world_odom() * read.x_odom_base()).inverse() * x_world_base;
    assert!(
        difference.translation.vector.norm() < 1e-12 && difference.rotation.angle() < 1e-12,
        "{difference}"
    );
    assert_ne!(noisy.x_world_odom(), exact.x_world_odom());
    // Odometry is part of a snapshot.
    let (snapshot, before) = (noisy.snapshot(), readings(&noisy));
    drive(&mut noisy, 10);
    assert_ne!(readings(&noisy), before);
    noisy.restore(&snapshot).unwrap();
    assert_eq!(readings(&noisy), before);
}

#[test]
fn a_command_is_obeyed_after_its_delay() {
    let late = figure("command_delay", 0.1, "s");
    let (mut exact, mut late) = (world(Spec::paper()), world(spec(&late)));
    let still = exact.robot().start_command();
    // 6 frames of 1/60 s.
    (0..6).for_each(|_| exact.step(&still));
    drive(&mut exact, 14);
    drive(&mut late, 10);
    let snapshot = late.snapshot();
    drive(&mut late, 10);
    assert_eq!(bits(&exact), bits(&late));
    late.restore(&snapshot).unwrap();
    drive(&mut late, 10);
    assert_eq!(bits(&exact), bits(&late));
}

#[test]
fn an_image_is_delivered_after_its_delay() {
    let late = figure("camera_delay", 0.1, "s");
    let (mut exact, mut late) = (world(Spec::paper()), world(spec(&late)));
    let first = exact.observe().depth.unwrap();
    for _ in 0..6 {
        assert!(late.observe().depth.is_none());
        drive(&mut late, 1);
    }
    let seen = late.observe();
    assert_eq!((seen.depth, seen.depth_time), (Some(first), 0.0));
}
