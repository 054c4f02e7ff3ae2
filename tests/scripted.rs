//! A pick by script that knows where the fruit is: it tests the physics of the grip, not a picker.

use orchard_geometry::{Vec3, inverse_transform};
use orchard_robot::{Command, IkTarget, JointValues, JointVector, RobotModel};
use orchard_spec::Spec;
use orchard_world::truth::FruitState;
use orchard_world::{World, WorldEvent};
use std::sync::Arc;

/// Result of a scripted pick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pick {
    /// Both fingers closed on the fruit.
    pub gripped: bool,
    /// A stem gave way, its own or any other.
    pub detached: bool,
    /// The hand still holds it after the pull.
    pub held: bool,
}

/// Distance of the fruit from the base's origin at which the arm reaches well forward \[m\].
const STAND_OFF: f64 = 0.83;
/// Straight way to the fruit and back \[m\].
const APPROACH: f64 = 0.16;
const WITHDRAWAL: f64 = 0.30;

/// A robot that follows a script in a world.
struct Script<'a> {
    world: World,
    command: Command,
    arm: JointVector,
    watch: &'a mut dyn FnMut(&mut World, &Command),
}

impl Script<'_> {
    fn step(&mut self) {
        self.world.step(&self.command);
        (self.watch)(&mut self.world, &self.command);
    }

    fn hold(&mut self, frames: u32) {
        for _ in 0..frames {
            self.step();
        }
    }

    /// Drives straight to a place of the odom frame.
    fn drive(&mut self, goal: [f64; 3], frames: u32) {
        for _ in 0..frames {
            let at = self.world.observe().base_pose;
            self.command.base_velocity = std::array::from_fn(|k| (2.0 * (goal[k] - at[k])).clamp(-0.5, 0.5));
            self.step();
        }
        self.command.base_velocity = [0.0; 3];
    }

    fn turn_joints(&mut self, to: &JointVector, frames: u32) {
        let from = self.arm;
        for k in 1..=frames {
            self.arm = from + (to - from) * (f64::from(k) / f64::from(frames));
            self.command.arm_q = JointValues::of(&self.arm, self.command.arm_q.len());
            self.step();
        }
    }

    /// Moves the point between the fingers along a straight line, hand forward; false where the arm cannot.
    fn line(&mut self, robot: &RobotModel, from_base: &Vec3, to_base: &Vec3, frames: u32) -> bool {
        for k in 1..=frames {
            let p_base = from_base + (to_base - from_base) * (f64::from(k) / f64::from(frames));
            let target = IkTarget::Axis { p_base, z_base: Vec3::x() };
            let Ok(arm) = robot.kinematics().solve(&target, &self.arm) else { return false };
            self.arm = arm;
            self.command.arm_q = robot.kinematics().values(&arm);
            self.step();
        }
        true
    }
}

/// Drives to the reachable fruit nearest to the start, closes the fingers on it and withdraws. `None` where no
/// straight way leads there.
pub fn scripted_pick(spec: &Spec, robot: &RobotModel, seed: u64) -> Option<Pick> {
    watched_pick(spec, robot, seed, &mut |_, _| ())
}

/// [`scripted_pick`], with `watch` called after every frame with the world and the command that drove it.
pub fn watched_pick(
    spec: &Spec,
    robot: &RobotModel,
    seed: u64,
    watch: &mut dyn FnMut(&mut World, &Command),
) -> Option<Pick> {
    let world = World::new(Arc::new(spec.clone()), Arc::new(robot.clone()), seed, 0).ok()?;
    let x_world_odom = world.x_world_odom();
    let truth = world.fruit_truth();
    let p_odom = |i: usize| inverse_transform(&x_world_odom, &truth[i].p_world);
    let reachable = world.reachable();
    let fruit = (0..truth.len())
        .filter(|&i| reachable[i])
        .min_by(|&a, &b| p_odom(a).norm().total_cmp(&p_odom(b).norm()))?;
    let kinematics = robot.kinematics();
    let mut script = Script { world, command: robot.start_command(), arm: kinematics.home(), watch };
    script.drive([p_odom(fruit).x - STAND_OFF, p_odom(fruit).y, 0.0], 300);

    let x_world_base = script.world.handle().x_world_base(script.world.data());
    let p_base = inverse_transform(&x_world_base, &script.world.fruit_truth()[fruit].p_world);
    let before = p_base - Vec3::x() * APPROACH;
    let target = IkTarget::Axis { p_base: before, z_base: Vec3::x() };
    let posture = kinematics.solve(&target, &script.arm).ok()?;
    script.turn_joints(&posture, 90);
    script.hold(30);
    if !script.line(robot, &before, &p_base, 60) {
        return None;
    }
    script.hold(20);
    script.command.finger_q = 0.0;
    script.hold(60);
    let gripped = script.world.is_held(fruit);
    let after = p_base - Vec3::x() * WITHDRAWAL;
    if !script.line(robot, &p_base, &after, 180) {
        return None;
    }
    let state = script.world.fruit_truth()[fruit].state;
    Some(Pick {
        gripped,
        detached: script.world.drain_events().iter().any(|e| matches!(e, WorldEvent::FruitDetached { .. })),
        held: state == FruitState::Held,
    })
}
