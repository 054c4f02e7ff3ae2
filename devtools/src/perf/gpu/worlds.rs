//! Rows of whole worlds on the graphics device: a tree and a robot that pushes it. Suite `worlds` measures them alone, with a second robot whose contacts bear load all the time.

use anyhow::Context;
use orchard_batch::TreeWorld;
use orchard_geometry::{Pose, Rotation, Vec3};
use orchard_gpu::{Choice, Gpu, WorldBatch};
use orchard_program::rows::{Effort, Measured, Row};
use orchard_robot::{Command, JointValues, RobotConfig, RobotModel};

use super::super::physics::forest::nearest;
use super::super::physics::forest::spec_with_fruit;
use super::super::physics::{FRUIT, LINKS, SEARCHED, WORLDS};
use super::super::timing::Rounds;
use super::{ROUNDS, SOFTWARE_WORLDS, TARGETS, settled};

/// Frames of a round, in which time is taken.
const FRAMES: u32 = 60;
/// Frames in which kernels are timed.
const TIMED: usize = 20;
/// Worlds whose contacts are counted: one of each tree.
const COUNTED: usize = WORLDS;

/// A robot and its commands, the same in all worlds.
struct Scene {
    /// Begin of the rows' names.
    name: &'static str,
    robot: RobotModel,
    /// Distance of the robot from the trunk at its start \[m\].
    distance: f64,
    /// Commands before a round, with the frames of each; the last one holds in the round.
    steps: Vec<(Command, u32)>,
    /// Worlds on a software adapter, and most frames of a step or a round there.
    on_software: (usize, u32),
    /// Targets by the number of worlds \[substeps/s\], and least number of contacts under load in every world for which they hold.
    targets: Option<([f64; 3], f64)>,
}

impl Scene {
    /// The paper's robot drives 1.4 m from the trunk into the canopy and pushes on slowly. Branches give way, so that few contacts bear load.
    fn push() -> Self {
        let robot = RobotModel::paper();
        let ahead = |speed: f64| Command { base_velocity: [speed, 0.0, 0.0], ..robot.start_command() };
        let steps = vec![(ahead(0.6), 60), (ahead(0.1), 1)];
        let on_software = (SOFTWARE_WORLDS, 6);
        Self { name: "gpu.world", distance: 1.4, steps, on_software, robot, targets: None }
    }

    /// A press of eight levers (`assets/press`) drives up beside the trunk and presses against it from the side, each lever with a force of its own.
    fn press() -> anyhow::Result<Self> {
        let config = RobotConfig::from_toml("assets/press/robot.toml", PRESS_TOML)?;
        let robot = RobotModel::from_urdf(PRESS_URDF, &config)?;
        let start = robot.start_command();
        let drive = Command { base_velocity: [0.8, 0.0, 0.0], ..start };
        let joints = robot.start_command().arm_q.len();
        // A hinge bears the torques of all levers above it. The topmost lever and the lowest one get more, since branches hold the others off it, and the trunk gives way to it.
        let levers = |joint: usize| joints - joint + 1 + if joint == 0 { 2 } else { 0 };
        let turn = |joint: usize| LEVER_TURN * levers(joint) as f64;
        let arm_q = JointValues::from_fn(joints, turn);
        let press = Command { arm_q, ..start };
        let targets = Some(([1.5e6, 5e6, 7e6], 8.0));
        let steps = vec![(drive, 60), (press, 240)];
        Ok(Self { name: "gpu.world_press", distance: 1.4, steps, on_software: (12, 240), robot, targets })
    }
}

/// Description and mapping of the press.
const PRESS_URDF: &str = include_str!("../../../assets/press/robot.urdf");
const PRESS_TOML: &str = include_str!("../../../assets/press/robot.toml");
/// Angle that each lever adds to the set points of the hinges below it \[rad\]. A lever then presses with some 30 N (measured).
const LEVER_TURN: f64 = 0.2;

/// Measures the rows of whole worlds, and no others.
pub fn measure(effort: Effort) -> anyhow::Result<Measured> {
    let gpu = Gpu::open(Choice::Any).context("the suite worlds needs a graphics adapter")?;
    let is_real = !gpu.info().is_software;
    let kinds = if is_real && effort == Effort::Full { WORLDS } else { SOFTWARE_WORLDS };
    let trees = settled(&nearest(spec_with_fruit(FRUIT)?, LINKS, kinds, SEARCHED)?)?;
    let mut all = Vec::new();
    for scene in [Scene::push(), Scene::press()?] {
        let sizes =
            if is_real { TARGETS.map(|(worlds, _)| worlds).to_vec() } else { vec![scene.on_software.0] };
        for worlds in sizes {
            all.extend(rows_of(&gpu, &trees, worlds, &scene)?);
        }
    }
    let mut measured = Measured::from(all);
    measured.context.insert("adapter", Some(gpu.info().name.clone()));
    measured.context.insert("driver", Some(gpu.info().driver.clone()));
    Ok(measured)
}

/// Rows of the paper's robot that pushes trees.
pub fn rows(gpu: &Gpu, trees: &[TreeWorld], worlds: usize) -> anyhow::Result<Vec<Row>> {
    rows_of(gpu, trees, worlds, &Scene::push())
}

/// Substeps of one world per second of `worlds` worlds, with their contacts, and memory. Each round starts from a reset.
fn rows_of(gpu: &Gpu, trees: &[TreeWorld], worlds: usize, scene: &Scene) -> anyhow::Result<Vec<Row>> {
    let trees: Vec<TreeWorld> = (0..worlds).map(|world| trees[world % trees.len()].clone()).collect();
    let starts: Vec<Pose> = (0..worlds).map(|world| start(world, worlds, scene.distance)).collect();
    let mut batch = WorldBatch::new(gpu, &trees, &scene.robot, &starts)?;
    let is_software = gpu.info().is_software;
    let most = if is_software { scene.on_software.1 } else { u32::MAX };
    let frames = FRAMES.min(most);
    let substeps = f64::from(trees[0].plant().spec.sim.substeps.get());
    let everyone: Vec<usize> = (0..worlds).collect();
    let mut rates = Vec::with_capacity(ROUNDS);
    // The first round warms up.
    for round in 0..=ROUNDS {
        batch.reset(&everyone);
        for (command, frames) in &scene.steps {
            for &world in &everyone {
                batch.command(world, command)?;
            }
            // Sends the commands, too.
            batch.advance(*frames.min(&most));
        }
        batch.wait()?;
        let begin = std::time::Instant::now();
        batch.advance(frames);
        batch.wait()?;
        if round > 0 {
            rates.push(f64::from(frames) * substeps * worlds as f64 / begin.elapsed().as_secs_f64());
        }
    }
    let name = format!("{}_{worlds}", scene.name);
    let contacts = Contacts::count(&mut batch, worlds.min(COUNTED))?;
    let kernels = kernels(&mut batch, &name)?;
    let rates = Rounds::new(rates);
    let mut rate = Row::measured(&name, rates.median(), "substeps/s");
    let mut least = Row::measured(&format!("{name}.loaded_least"), contacts.loaded_least, "contacts");
    let target = TARGETS.iter().position(|(size, _)| *size == worlds);
    if let (Some((targets, loaded)), Some(size), false) = (&scene.targets, target, is_software) {
        rate = rate.at_least(targets[size]);
        least = least.at_least(*loaded);
    }
    let note = "trees of their own topology, contacts, ruptures and detachments on; elapsed".to_owned();
    let mut rows = vec![
        Row { spread: Some(rates.spread()), note: Some(note), ..rate },
        Row::measured(&format!("{name}.contacts"), contacts.all, "contacts"),
        Row::measured(&format!("{name}.loaded"), contacts.loaded, "contacts"),
        least,
        Row::measured(&format!("{name}.overfull"), contacts.overfull, "1"),
        Row::measured(&format!("{name}.iterations"), contacts.iterations, "iterations"),
        Row::measured(&format!("{name}.iterations_most"), contacts.iterations_most, "iterations"),
        Row::measured(&format!("{name}.memory"), batch.bytes() as f64, "bytes"),
    ];
    rows.extend(kernels);
    Ok(rows)
}

/// Contacts at the end of a round.
#[derive(Default)]
struct Contacts {
    /// Means of a world: contacts, those under load, and share of worlds that left out some.
    all: f64,
    loaded: f64,
    overfull: f64,
    /// Fewest contacts under load of a world.
    loaded_least: f64,
    /// Newton iterations of the latest substep: mean of the worlds, and most.
    iterations: f64,
    iterations_most: f64,
}

impl Contacts {
    /// Counts the contacts of the first worlds.
    fn count(batch: &mut WorldBatch, worlds: usize) -> anyhow::Result<Self> {
        let mut counts = Self { loaded_least: f64::INFINITY, ..Self::default() };
        for world in 0..worlds {
            let meeting = batch.meeting(world)?;
            let loaded = meeting.contacts.iter().filter(|c| c.force_world.norm() > 0.0).count() as f64;
            counts.all += meeting.contacts.len() as f64 / worlds as f64;
            counts.loaded += loaded / worlds as f64;
            counts.overfull += f64::from(u8::from(meeting.lost > 0)) / worlds as f64;
            counts.loaded_least = counts.loaded_least.min(loaded);
            let iterations = f64::from(meeting.iterations);
            counts.iterations += iterations / worlds as f64;
            counts.iterations_most = counts.iterations_most.max(iterations);
        }
        Ok(counts)
    }
}

/// Time of each kernel in a substep of all worlds, by the device's clock, if the adapter has one: every kernel is a pass of its own then.
fn kernels(batch: &mut WorldBatch, name: &str) -> anyhow::Result<Vec<Row>> {
    batch.keep_times(true);
    let mut substeps = 0.0;
    for _ in 0..TIMED {
        batch.advance(1);
        batch.wait()?;
        substeps += f64::from(batch.substeps());
    }
    let times = batch.times();
    batch.keep_times(false);
    let row = |(kernel, seconds): (&'static str, f64)| {
        Row::measured(&format!("{name}.device.{kernel}"), 1e6 * seconds / substeps, "us")
    };
    Ok(times.into_iter().map(row).collect())
}

/// Start of a robot that looks at the trunk, from bearings all around.
fn start(world: usize, worlds: usize, distance: f64) -> Pose {
    let bearing = std::f64::consts::TAU * world as f64 / worlds as f64;
    let (sin, cos) = orchard_geometry::math::sin_cos(bearing);
    let p = Vec3::new(distance * cos, distance * sin, 0.0);
    let turn = Rotation::from_axis_angle(&Vec3::z_axis(), bearing + std::f64::consts::PI);
    Pose::from_parts(p.into(), turn)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The press can be read, and each hinge bears the torque of one lever more than the next.
    #[test]
    fn the_press_is_a_robot_of_eight_levers() {
        let press = Scene::press().unwrap();
        let (command, _) = press.steps.last().unwrap();
        let turns = command.arm_q[1..].windows(2).map(|pair| pair[0] - pair[1]);
        assert_eq!(command.arm_q.len(), 8);
        assert!(turns.into_iter().all(|more| (more - LEVER_TURN).abs() < 1e-12));
    }
}
