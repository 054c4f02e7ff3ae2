//! Robots on the graphics device against the robots of f64 worlds.

use std::sync::Arc;

use anyhow::{Context, ensure};
use orchard_batch::Status;
use orchard_gpu::{Gpu, RobotBatch};
use orchard_multibody::{Data, forward_kinematics};
use orchard_robot::{Command, JointValues, RobotModel};
use orchard_spec::{Purpose, Spec, Stream};
use orchard_world::World;
use rayon::prelude::*;

use super::SEED;
use crate::rows::Row;

/// Requirements: error of a joint [rad, or m where it slides], of the tool \[m\].
const JOINT_ERROR: f64 = 1e-4;
const TOOL_ERROR: f64 = 1e-4;
/// Frames up to each comparison: 0.2 s and 1 s.
const COMPARED: [(u32, &str); 2] = [(12, "0.2s"), (60, "1s")];
/// Ways of the arm's joints from the start \[rad\]; velocities of the base back from the tree [m/s], aside [m/s] and about the vertical [rad/s]; openings of
/// the fingers over that at the start. So far the robot touches neither itself nor the tree.
const TURN: f64 = 0.35;
const BACK: (f64, f64) = (-0.5, 0.0);
const ASIDE: (f64, f64) = (-0.3, 0.3);
const YAW: (f64, f64) = (-0.5, 0.5);
const OPENING: (f64, f64) = (0.2, 1.0);

/// Rows of every robot that comes with the program: largest errors of `count` worlds, each under a command of its own.
pub fn rows(gpu: &Gpu, count: u32) -> anyhow::Result<Vec<Row>> {
    let mut rows = Vec::new();
    for name in RobotModel::names() {
        let robot = RobotModel::named(name).map_err(anyhow::Error::msg)?;
        let errors = compare(gpu, robot, count).with_context(|| format!("robot {name}"))?;
        for ((_, time), Errors { joint, tool }) in COMPARED.into_iter().zip(errors) {
            let name = format!("gpu.robots.{name}.after_{time}");
            let joints = Row::measured(&format!("{name}.joint_error"), joint, "rad");
            rows.push(joints.at_most(JOINT_ERROR));
            rows.push(Row::measured(&format!("{name}.tool_error"), tool, "m").at_most(TOOL_ERROR));
        }
    }
    Ok(rows)
}

/// Largest errors of all worlds.
#[derive(Debug, Clone, Copy, Default)]
struct Errors {
    joint: f64,
    tool: f64,
}

/// Errors at each comparison.
fn compare(gpu: &Gpu, robot: RobotModel, count: u32) -> anyhow::Result<Vec<Errors>> {
    let spec = Arc::new(Spec::paper());
    let mut batch = RobotBatch::new(gpu, &robot, &spec.sim, count)?;
    let start = World::new(spec, Arc::new(robot), SEED, 0)?;
    let mut worlds: Vec<(World, Command)> =
        (0..count).map(|index| (start.clone(), command(start.robot(), index))).collect();
    for (index, (_, command)) in worlds.iter().enumerate() {
        batch.command(index, command)?;
    }
    let mut now = 0;
    let mut all = Vec::new();
    for (until, _) in COMPARED {
        let frames = until - std::mem::replace(&mut now, until);
        batch.advance(frames);
        worlds.par_iter_mut().try_for_each(|(world, command)| {
            for _ in 0..frames {
                world.step(command);
                ensure!(!is_touched(world), "it touches something in the comparison without contact");
            }
            Ok(())
        })?;
        let mut largest = Errors::default();
        for (index, (world, _)) in worlds.iter().enumerate() {
            let (model, handle) = (world.model(), world.handle());
            // Its numbers are finite then.
            ensure!(batch.status(index)? == Status::Running, "world {index} was stopped");
            let mut data = world.data().clone();
            batch.store(index, model, handle, &mut data)?;
            forward_kinematics(model, &mut data);
            let joints = |data: &Data| -> Vec<f64> {
                handle.bodies.iter().flat_map(|&body| &data.q[model.qs(body)]).copied().collect()
            };
            let tool = |data: &Data| handle.x_world_tcp(data).translation.vector;
            let errors = joints(&data).into_iter().zip(joints(world.data())).map(|(a, b)| (a - b).abs());
            largest.joint = errors.fold(largest.joint, f64::max);
            largest.tool = largest.tool.max((tool(&data) - tool(world.data())).norm());
        }
        all.push(largest);
    }
    Ok(all)
}

/// A motion away from the start.
fn command(robot: &RobotModel, index: u32) -> Command {
    let mut stream = Stream::new(SEED, index, Purpose::Test);
    let mut within = |(low, high)| stream.uniform(low, high);
    let start = robot.start_command();
    Command {
        arm_q: JointValues::from_fn(start.arm_q.len(), |i| start.arm_q[i] + within((-TURN, TURN))),
        base_velocity: [BACK, ASIDE, YAW].map(&mut within),
        finger_q: start.finger_q * within(OPENING),
        ..start
    }
}

/// True if a contact pushes the robot.
fn is_touched(world: &World) -> bool {
    let colliders = &world.handle().colliders;
    let [left, right] = &colliders.fingers;
    let parts = [&colliders.base, &colliders.arm, left, right, &colliders.bucket, &colliders.cup];
    let is_robot = |id| parts.iter().any(|part| part.contains(id));
    let contacts = &world.report().contacts;
    contacts.iter().any(|c| (is_robot(&c.a) || is_robot(&c.b)) && c.force_world.norm() > 0.0)
}
