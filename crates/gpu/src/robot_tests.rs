//! Robots on the device at hand, against the f64 worlds and closed forms.

use std::sync::Arc;

use orchard_batch::{Fault, Quarantine, Status};
use orchard_geometry::{Intrinsics, Vec3};
use orchard_multibody::{Data, forward_kinematics};
use orchard_robot::{Command, JointValues, Limit, Observation, RobotModel, observe};
use orchard_spec::Spec;
use orchard_world::World;

use crate::layout::robot;
use crate::robots::Alone;
use crate::testing::device;
use crate::{BatchError, Choice, Gpu, GpuError, RobotBatch};

/// Frames of 0.2 s and of 1 s.
const SHORT: u32 = 12;
const SECOND: u32 = 60;
const FRAME: f64 = 1.0 / 60.0;
/// Tolerances: coordinates [rad, m], tool [m].
const COORDINATE: f64 = 1e-4;
const TOOL: f64 = 1e-4;

const GRAVITY: Vec3 = Vec3::new(0.0, 0.0, -9.81);
/// Share of an arm's weight that is not compensated.
const SAG: f64 = 0.3;

fn batch_of(gpu: &Gpu, robot: &RobotModel, worlds: u32) -> RobotBatch {
    RobotBatch::new(gpu, robot, &Spec::paper().sim, worlds).unwrap()
}

/// A variant of a built-in robot with other figures.
fn variant(text: &str) -> RobotModel {
    RobotModel::variant("robot.toml", text).unwrap()
}

/// A constant of a config.
fn constant(value: f64, unit: &str) -> String {
    format!("{{ value = {value:?}, range = [-100.0, 100.0], unit = \"{unit}\", source = \"x\" }}")
}

/// A built-in robot whose servos compensate too little of the arm's weight.
fn sagging(name: &str) -> RobotModel {
    variant(&format!("base = \"{name}\"\n[arm]\ngravity_error = {}\n", constant(-SAG, "1")))
}

/// A robot on the device, and its model.
struct Solo {
    batch: RobotBatch,
    alone: Alone,
}

impl Solo {
    fn new(gpu: &Gpu, robot: &RobotModel) -> Self {
        Self { batch: batch_of(gpu, robot, 1), alone: Alone::new(robot).unwrap() }
    }

    fn observed(&mut self) -> Observation {
        let Alone { model, handle, start } = &self.alone;
        let mut data = start.clone();
        self.batch.store(0, model, handle, &mut data).unwrap();
        observe(model, &data, handle, 0.0, Intrinsics::from_vertical_fov(8, 6, 1.0))
    }
}

/// Bits of the coordinates and velocities of a batch's world.
fn bits(batch: &mut RobotBatch, index: usize) -> Vec<u64> {
    let Alone { model, handle, start } = Alone::new(&RobotModel::paper()).unwrap();
    let mut data = start;
    batch.store(index, &model, &handle, &mut data).unwrap();
    data.q.iter().chain(&data.v).map(|x| x.to_bits()).collect()
}

/// A motion of all joints away from the start: base backwards and round, arm to another posture, fingers half closed by more or less force. Every `kind` has another.
fn motion(robot: &RobotModel, kind: usize) -> Command {
    let start = robot.start_command();
    let size = 0.1 + 0.1 * kind as f64;
    Command {
        arm_q: JointValues::from_fn(start.arm_q.len(), |i| {
            start.arm_q[i] + size * [1.0, -0.7, 0.8, -0.9, 1.0, 0.6, -1.0, 0.5][(i + kind) % 8]
        }),
        base_velocity: [-0.6 * size - 0.1, 0.5 * size, 0.3 - size],
        finger_q: 0.5 * start.finger_q,
        finger_force: [1.0, 5.0, 50.0][kind % 3],
        ..start
    }
}

/// A motion of one joint, which loads all the others.
fn swing(robot: &RobotModel, kind: usize) -> Command {
    let mut command = robot.start_command();
    command.arm_q[kind] += 0.4;
    command
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
    assert_eq!(batch.status(index).unwrap(), Status::Running);
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
        follows_f64(&gpu, &RobotModel::named(name).unwrap(), motion, &[SHORT, SECOND - SHORT], name);
    }
}

/// Joints agree with f64 under a load that takes servos to their limits (until the arm falls onto the robot), and under friction that holds joints against their weight or another joint.
#[test]
fn limits_and_friction_act_as_in_f64() {
    let Some(gpu) = device() else { return };
    let loaded = variant(&format!("base = \"ridgeback-fr3\"\n[arm]\npayload = {}\n", constant(25.0, "kg")));
    let arm = loaded.kinematics();
    let torque = arm.gravity_torque(&arm.home(), &GRAVITY);
    let is_over = |(limit, torque): (&Limit, &f64)| torque.abs() > limit.effort;
    assert!(arm.limits().iter().zip(&torque).any(is_over), "{torque}");
    follows_f64(&gpu, &loaded, motion, &[SHORT], "loaded");
    let both = [SHORT, SECOND - SHORT];
    follows_f64(&gpu, &sagging("fr3-fixed"), motion, &both, "sagging");
    follows_f64(&gpu, &RobotModel::named("fr3-fixed").unwrap(), swing, &both, "swinging");
}

fn follows_f64(
    gpu: &Gpu,
    robot: &RobotModel,
    command: fn(&RobotModel, usize) -> Command,
    stretches: &[u32],
    name: &str,
) {
    const WORLDS: usize = 3;
    let mut batch = batch_of(gpu, robot, WORLDS as u32);
    let start = World::new(Arc::new(Spec::paper()), Arc::new(robot.clone()), 3, 0).unwrap();
    let mut worlds = vec![start; WORLDS];
    for (index, world) in worlds.iter().enumerate() {
        // The start is that of the world but for the rounding of its numbers.
        assert!(errors(&mut batch, index, world).0 < 2e-7, "{name}");
        batch.command(index, &command(robot, index)).unwrap();
    }
    for &frames in stretches {
        batch.advance(frames);
        for (index, world) in worlds.iter_mut().enumerate() {
            (0..frames).for_each(|_| world.step(&command(robot, index)));
            let (coordinate, tool) = errors(&mut batch, index, world);
            assert!(
                coordinate < COORDINATE && tool < TOOL,
                "{name} {index} {frames}: {coordinate:e} {tool:e}"
            );
        }
    }
}

/// The arm rests where the springs of its servos bear what they do not compensate of its weight: `k (target - q) = 0.3 tau_g(q)`.
#[test]
fn an_arm_sags_by_torque_over_stiffness() {
    let Some(gpu) = device() else { return };
    let robot = sagging("ridgeback-fr3");
    let mut alone = Solo::new(&gpu, &robot);
    alone.batch.advance(4 * SECOND);
    let reached = alone.observed().arm_q.vector();
    let torque = robot.kinematics().gravity_torque(&reached, &GRAVITY);
    let sag = torque * (-SAG / robot.config().arm.stiffness.si());
    let off = reached - robot.kinematics().home() - sag;
    assert!(sag.amax() > 1e-3 && off.amax() < 2e-6, "{sag} {off}");
}

/// A robot that holds its start posture stays there.
#[test]
fn a_held_posture_does_not_drift() {
    let Some(gpu) = device() else { return };
    for name in ["ridgeback-fr3", "rail-xarm6-suction"] {
        let mut alone = Solo::new(&gpu, &RobotModel::named(name).unwrap());
        let start = alone.observed();
        alone.batch.advance(4 * SECOND);
        let end = alone.observed();
        assert!(apart(&end.arm_q, &start.arm_q) < 1e-6, "{name}: {:?}", end.arm_q);
        assert!(end.arm_v.iter().all(|v| v.abs() < 1e-5), "{name}: {:?}", end.arm_v);
        assert!(apart(&end.base_pose, &[0.0; 3]) < 1e-6, "{name}: {:?}", end.base_pose);
    }
}

/// A joint that turns evenly about the vertical lags behind its set point by what damper and friction take: `k lag = d v + F`.
#[test]
fn a_turning_joint_lags_by_damper_and_friction() {
    const RATE: f64 = 0.4;
    let Some(gpu) = device() else { return };
    let robot = RobotModel::named("fr3-fixed").unwrap();
    let mut alone = Solo::new(&gpu, &robot);
    let mut command = robot.start_command();
    command.arm_v[0] = RATE;
    for _ in 0..SECOND + SHORT {
        command.arm_q[0] += RATE * FRAME;
        alone.batch.command(0, &command).unwrap();
        alone.batch.advance(1);
    }
    let (arm, end) = (&robot.config().arm, alone.observed());
    let expected = (arm.damping.si() * RATE + arm.friction[0].si()) / arm.stiffness.si();
    assert!((end.arm_v[0] - RATE).abs() < 1e-5, "{}", end.arm_v[0]);
    let lag = command.arm_q[0] - end.arm_q[0];
    assert!((lag - expected).abs() < 2e-5, "{lag} {expected}");
}

/// A base reaches its commanded velocity and keeps it: on circles no smaller than its own, along its heading, and to the end of its rail.
#[test]
fn bases_keep_to_their_steering() {
    const SPEED: f64 = 0.4;
    let Some(gpu) = device() else { return };
    let radius = constant(2.0, "m");
    let car = format!(
        "base = \"husky-ur5e-2f85\"\n[drive]\nsteering = {{ kind = \"ackermann\", turning_radius = {radius} }}\n"
    );
    let named = |name| RobotModel::named(name).unwrap();
    for (robot, yaw_rate) in [(variant(&car), SPEED / 2.0), (named("husky-ur5e-2f85"), 1.0)] {
        let mut alone = Solo::new(&gpu, &robot);
        let command = Command { base_velocity: [SPEED, 0.3, 1.0], ..robot.start_command() };
        alone.batch.command(0, &command).unwrap();
        alone.batch.advance(3 * SECOND);
        let end = alone.observed();
        let [x, y, rate] = end.base_velocity;
        // The drives give way a little to the centrifugal forces of arm and chassis.
        assert!((rate - yaw_rate).abs() < 2e-2, "{rate} {yaw_rate}");
        let (sin, cos) = orchard_geometry::math::sin_cos(end.base_pose[2]);
        let (along, aside) = (cos * x + sin * y, cos * y - sin * x);
        assert!((along - SPEED).abs() < 1e-2 && aside.abs() < 2e-2, "{along} {aside}");
    }
    let rail = named("rail-xarm6-suction");
    let upper = rail.articulation().links.iter().find_map(|link| link.limit).unwrap().upper;
    let mut alone = Solo::new(&gpu, &rail);
    alone.batch.command(0, &Command { base_velocity: [0.0, 1.0, 0.0], ..rail.start_command() }).unwrap();
    alone.batch.advance(10 * SECOND);
    let [_, y, _] = alone.observed().base_pose;
    assert!((y - upper).abs() < 1e-3, "{y} {upper}");
}

/// A world has the same bits alone, in a batch, and beside a world that was stopped; a command that is not finite stops its own world, which then stands still, until its reset.
#[test]
fn neighbours_change_no_bit() {
    const WORLDS: usize = 5;
    const BROKEN: usize = 1;
    let Some(gpu) = device() else { return };
    let robot = RobotModel::paper();
    let mut together = batch_of(&gpu, &robot, WORLDS as u32);
    let mut before = None;
    for index in 0..WORLDS {
        together.command(index, &motion(&robot, index)).unwrap();
    }
    together.advance(5);
    before.replace(bits(&mut together, BROKEN));
    together.command(BROKEN, &Command { finger_q: f64::NAN, ..motion(&robot, 0) }).unwrap();
    together.advance(SHORT);
    let stopped = Status::Quarantined(Quarantine { frame: 6, fault: Fault::Command });
    for index in 0..WORLDS {
        let status = together.status(index).unwrap();
        if index == BROKEN {
            assert_eq!((status, Some(bits(&mut together, index))), (stopped, before.clone()));
            continue;
        }
        assert_eq!(status, Status::Running);
        let mut alone = batch_of(&gpu, &robot, 1);
        alone.command(0, &motion(&robot, index)).unwrap();
        [8, SHORT - 3].into_iter().for_each(|frames| alone.advance(frames));
        assert_eq!(bits(&mut together, index), bits(&mut alone, 0), "world {index}");
    }
    let others = bits(&mut together, 0);
    together.reset(&[BROKEN]);
    assert_eq!(together.status(BROKEN).unwrap(), Status::Running);
    let mut fresh = batch_of(&gpu, &robot, 1);
    assert_eq!(bits(&mut together, BROKEN), bits(&mut fresh, 0));
    assert_eq!(bits(&mut together, 0), others);
    // After its reset it goes the way of a new world.
    for batch in [&mut together, &mut fresh] {
        let index = BROKEN.min(batch.len() - 1);
        batch.command(index, &motion(&robot, 3)).unwrap();
        batch.advance(SHORT);
    }
    assert_eq!(bits(&mut together, BROKEN), bits(&mut fresh, 0));
}

/// A state that is not finite stops its world in the frame in which it is found.
#[test]
fn a_state_that_is_not_finite_stops_its_world() {
    const BROKEN: usize = 33;
    let Some(gpu) = device() else { return };
    let robot = RobotModel::named("rail-xarm6-suction").unwrap();
    let mut batch = batch_of(&gpu, &robot, 40);
    batch.advance(2);
    batch.overwrite(BROKEN, robot::V + 2, f32::INFINITY);
    batch.advance(3);
    let Status::Quarantined(Quarantine { frame: 3, fault: Fault::Robot { .. } }) =
        batch.status(BROKEN).unwrap()
    else {
        panic!("{:?}", batch.status(BROKEN));
    };
    for index in [0, 32, 34, 39] {
        assert_eq!(batch.status(index).unwrap(), Status::Running);
    }
}

/// A robot with more joints than the kernels know is refused by name.
#[test]
fn a_robot_with_too_many_joints_is_refused() {
    let Some(gpu) = device() else { return };
    let husky = RobotModel::named("husky-ur5e-2f85").unwrap();
    let more = |k: u32| {
        format!(
            r#"<joint name="more_{k}" type="revolute"><parent link="left_crank"/><child link="link_{k}"/><axis xyz="1 0 0"/>
            <limit lower="0" upper="1" effort="1" velocity="1"/><mimic joint="left_crank_joint"/></joint>
            <link name="link_{k}"><inertial><mass value="0.01"/><inertia ixx="1e-5" ixy="0" ixz="0" iyy="1e-5" iyz="0" izz="1e-5"/></inertial></link>"#
        )
    };
    let text = husky.urdf().replace("</robot>", &format!("{}</robot>", (0..3).map(more).collect::<String>()));
    let robot = RobotModel::from_urdf(&text, husky.config()).unwrap();
    let e = RobotBatch::new(&gpu, &robot, &Spec::paper().sim, 1).unwrap_err().to_string();
    let name = &robot.articulation().name;
    let expected = format!(
        "a graphics device cannot step the robot {name}: it has 17 degrees of freedom, the kernels know 16"
    );
    assert_eq!(e, expected);
}

/// A command for another arm is refused, and so is a batch that is too large, with the number of worlds that would fit.
#[test]
fn bad_input_is_refused() {
    const LARGEST: u64 = 1 << 17;
    let Some(gpu) = device() else { return };
    let robot = RobotModel::paper();
    let mut batch = batch_of(&gpu, &robot, 2);
    let six = Command { arm_q: JointValues::zeros(6), ..robot.start_command() };
    let e = batch.command(1, &six).unwrap_err();
    assert_eq!(e, BatchError::Joints { world: 1, given: 6, has: 7 }.into());
    let expected = "the command of world 1 has 6 numbers for the joints of the arm, which has 7";
    assert_eq!(e.to_string(), expected);

    let small = Gpu::open_with(Choice::Any, LARGEST).unwrap();
    let e = RobotBatch::new(&small, &robot, &Spec::paper().sim, 1000).unwrap_err();
    let GpuError::TooLarge { worlds: 1000, needed, has: LARGEST, fits, .. } = e else { panic!("{e}") };
    assert!(needed > LARGEST && (32..1000).contains(&fits), "{e}");
    let mut batch = RobotBatch::new(&small, &robot, &Spec::paper().sim, fits as u32).unwrap();
    batch.advance(1);
    assert_eq!(batch.status(fits - 1).unwrap(), Status::Running);
    let mut none = batch_of(&gpu, &robot, 0);
    none.advance(1);
    assert!(none.is_empty() && none.wait().is_ok());
}
