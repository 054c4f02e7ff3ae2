//! Robots on the device at hand, against the f64 worlds and closed forms.

use std::sync::Arc;

use orchard_batch::{Fault, Quarantine, Status};
use orchard_geometry::Vec3;
use orchard_multibody::{Data, forward_kinematics};
use orchard_robot::{Command, JointValues, RobotModel};
use orchard_spec::Spec;
use orchard_world::World;

use crate::testing::device;
use crate::{BatchError, Choice, Gpu, GpuError, RobotBatch};

/// Frames of 0.2 s and of 1 s.
const SHORT: u32 = 12;
const SECOND: u32 = 60;
const FRAME: f64 = 1.0 / 60.0;
/// Tolerances: coordinates [rad, m], tool [m].
const COORDINATE: f64 = 1e-4;
const TOOL: f64 = 1e-4;

fn world_of(robot: &RobotModel) -> World {
    World::new(Arc::new(Spec::paper()), Arc::new(robot.clone()), 3, 0).unwrap()
}

fn batch_of(gpu: &Gpu, robot: &RobotModel, worlds: u32) -> RobotBatch {
    RobotBatch::new(gpu, robot, &Spec::paper().sim, worlds).unwrap()
}

/// A variant of a built-in robot with other figures.
fn variant(text: &str) -> RobotModel {
    RobotModel::variant("robot.toml", text).unwrap()
}

/// A motion of all joints away from the start: base backwards and round, arm to another posture, fingers half closed. Every `kind` has another.
fn motion(robot: &RobotModel, kind: usize) -> Command {
    let start = robot.start_command();
    let size = 0.1 + 0.1 * kind as f64;
    Command {
        arm_q: JointValues::from_fn(start.arm_q.len(), |i| {
            start.arm_q[i] + size * [1.0, -0.7, 0.8, -0.9, 1.0, 0.6, -1.0, 0.5][(i + kind) % 8]
        }),
        base_velocity: [-0.6 * size - 0.1, 0.5 * size, 0.3 - size],
        finger_q: 0.5 * start.finger_q,
        ..start
    }
}

/// The f64 state of a batch's world, in the model of a world with this robot.
fn stored(batch: &mut RobotBatch, index: usize, world: &World) -> Data {
    let mut data = world.data().clone();
    batch.store(index, world.model(), world.handle(), &mut data).unwrap();
    forward_kinematics(world.model(), &mut data);
    data
}

/// Coordinates of the robot of a world.
fn coordinates(world: &World, data: &Data) -> Vec<f64> {
    let bodies = world.handle().bodies.iter();
    bodies.flat_map(|&body| &data.q[world.model().qs(body)]).copied().collect()
}

/// Largest difference of two lists.
fn apart(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).fold(0.0, |most, (a, b)| most.max((a - b).abs()))
}

/// Errors of a batch's world against a world: of the coordinates, and of the tool.
fn errors(batch: &mut RobotBatch, index: usize, world: &World) -> (f64, f64) {
    let data = stored(batch, index, world);
    let tool = |data: &Data| world.handle().x_world_tcp(data).translation.vector;
    let off = apart(&coordinates(world, &data), &coordinates(world, world.data()));
    (off, (tool(&data) - tool(world.data())).norm())
}

/// Every robot follows commands as in an f64 world, after 0.2 s and after 1 s.
#[test]
fn robots_move_as_in_f64() {
    let Some(gpu) = device() else { return };
    for name in RobotModel::names() {
        follows_f64(&gpu, &RobotModel::named(name).unwrap(), name);
    }
}

/// The same where servos reach their limits under a load, and where friction holds joints that are moved by it.
#[test]
fn limits_and_friction_act_as_in_f64() {
    let Some(gpu) = device() else { return };
    let payload = r#"payload = { value = 25.0, range = [0.0, 100.0], unit = "kg", source = "x" }"#;
    let loaded = variant(&format!("base = \"ridgeback-fr3\"\n[arm]\n{payload}\n"));
    let torque = loaded.kinematics().gravity_torque(&loaded.kinematics().home(), &Vec3::new(0.0, 0.0, -9.81));
    let is_over = |(limit, torque): (&orchard_robot::Limit, &f64)| torque.abs() > limit.effort;
    assert!(loaded.kinematics().limits().iter().zip(torque.iter()).any(is_over), "{torque}");
    follows_f64(&gpu, &loaded, "loaded");
    let error = r#"gravity_error = { value = -0.3, range = [-1.0, 1.0], unit = "1", source = "x" }"#;
    follows_f64(&gpu, &variant(&format!("base = \"fr3-fixed\"\n[arm]\n{error}\n")), "sagging");
}

fn follows_f64(gpu: &Gpu, robot: &RobotModel, name: &str) {
    const WORLDS: usize = 3;
    let mut batch = batch_of(gpu, robot, WORLDS as u32);
    let start = world_of(robot);
    let mut worlds = vec![start; WORLDS];
    for (index, world) in worlds.iter().enumerate() {
        assert!(errors(&mut batch, index, world).0 < 1e-6, "{name}");
        batch.command(index, &motion(robot, index)).unwrap();
    }
    for frames in [SHORT, SECOND - SHORT] {
        batch.advance(frames);
        for (index, world) in worlds.iter_mut().enumerate() {
            let command = motion(robot, index);
            (0..frames).for_each(|_| world.step(&command));
            let (coordinate, tool) = errors(&mut batch, index, world);
            println!("{name} {index} {frames}: {coordinate:e} {tool:e}");
            assert!(coordinate < COORDINATE && tool < TOOL, "{name} {index} {frames}: {coordinate:e} {tool:e}");
        }
    }
}
