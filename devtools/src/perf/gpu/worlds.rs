//! Rows of whole worlds on the graphics device: a tree and a robot that pushes it. Suite `worlds` measures them alone.

use anyhow::Context;
use orchard_batch::TreeWorld;
use orchard_geometry::{Pose, Rotation, Vec3};
use orchard_gpu::{Choice, Gpu, WorldBatch};
use orchard_program::rows::{Effort, Measured, Row};
use orchard_robot::{Command, RobotModel};

use super::super::physics::forest::nearest;
use super::super::physics::forest::spec_with_fruit;
use super::super::physics::{FRUIT, LINKS, SEARCHED, WORLDS};
use super::super::timing::Rounds;
use super::{ROUNDS, SOFTWARE_WORLDS, TARGETS, settled};

/// Frames in which the robot drives into the tree before a round, and frames of a round.
const APPROACH: u32 = 60;
const FRAMES: u32 = 60;
/// Frames in which kernels are timed.
const TIMED: usize = 20;
/// Frames of both on a software adapter.
const SOFTWARE_FRAMES: u32 = 6;
/// Distance of the robot from the trunk at its start \[m\], and its speeds before and in a round [m/s]: it stands in the canopy then, and pushes on.
const DISTANCE: f64 = 1.4;
const SPEED: f64 = 0.6;
const PUSH: f64 = 0.1;
/// Worlds whose contacts are counted.
const COUNTED: usize = 64;

/// Measures the rows of whole worlds, and no others.
pub fn measure(effort: Effort) -> anyhow::Result<Measured> {
    let gpu = Gpu::open(Choice::Any).context("the suite worlds needs a graphics adapter")?;
    let is_real = !gpu.info().is_software;
    let kinds = if is_real && effort == Effort::Full { WORLDS } else { SOFTWARE_WORLDS };
    let trees = settled(&nearest(spec_with_fruit(FRUIT)?, LINKS, kinds, SEARCHED)?)?;
    let mut all = Vec::new();
    let sizes = if is_real { TARGETS.map(|(worlds, _)| worlds).to_vec() } else { vec![SOFTWARE_WORLDS] };
    for worlds in sizes {
        all.extend(rows(&gpu, &trees, worlds)?);
    }
    let mut measured = Measured::from(all);
    measured.context.insert("adapter", Some(gpu.info().name.clone()));
    measured.context.insert("driver", Some(gpu.info().driver.clone()));
    Ok(measured)
}

/// Substeps of one world per second of `worlds` worlds whose robots push the trees, with their contacts, and memory. Each round starts from a reset.
pub fn rows(gpu: &Gpu, trees: &[TreeWorld], worlds: usize) -> anyhow::Result<Vec<Row>> {
    let robot = RobotModel::paper();
    let trees: Vec<TreeWorld> = (0..worlds).map(|world| trees[world % trees.len()].clone()).collect();
    let starts: Vec<Pose> = (0..worlds).map(|world| start(world, worlds)).collect();
    let mut batch = WorldBatch::new(gpu, &trees, &robot, &starts)?;
    let [approach, frames] = if gpu.info().is_software { [SOFTWARE_FRAMES; 2] } else { [APPROACH, FRAMES] };
    let substeps = f64::from(trees[0].plant().spec.sim.substeps.get());
    let everyone: Vec<usize> = (0..worlds).collect();
    let mut rates = Vec::with_capacity(ROUNDS);
    let mut sums = [0.0; 3];
    // The first round warms up.
    for round in 0..=ROUNDS {
        batch.reset(&everyone);
        drive(&mut batch, &robot, SPEED)?;
        batch.advance(approach);
        drive(&mut batch, &robot, PUSH)?;
        // Sends the commands.
        batch.advance(1);
        batch.wait()?;
        let begin = std::time::Instant::now();
        batch.advance(frames);
        batch.wait()?;
        if round > 0 {
            rates.push(f64::from(frames) * substeps * worlds as f64 / begin.elapsed().as_secs_f64());
        }
    }
    let name = format!("gpu.world_{worlds}");
    let kernels = kernels(&mut batch, &name)?;
    let counted = worlds.min(COUNTED);
    for world in 0..counted {
        let meeting = batch.meeting(world)?;
        let loaded = meeting.contacts.iter().filter(|contact| contact.force_world.norm() > 0.0).count();
        for (sum, own) in sums.iter_mut().zip([
            meeting.contacts.len() as f64,
            loaded as f64,
            f64::from(u8::from(meeting.lost > 0)),
        ]) {
            *sum += own / counted as f64;
        }
    }
    let rates = Rounds::new(rates);
    let rate = Row::measured(&name, rates.median(), "substeps/s");
    let note = format!(
        "robots {} that push trees of their own topology, contacts, ruptures and detachments on; elapsed",
        RobotModel::PAPER
    );
    let [contacts, loaded, overfull] = sums;
    let mut rows = vec![
        Row { spread: Some(rates.spread()), note: Some(note), ..rate },
        Row::measured(&format!("{name}.contacts"), contacts, "contacts"),
        Row::measured(&format!("{name}.loaded"), loaded, "contacts"),
        Row::measured(&format!("{name}.overfull"), overfull, "1"),
        Row::measured(&format!("{name}.memory"), batch.bytes() as f64, "bytes"),
    ];
    rows.extend(kernels);
    Ok(rows)
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

/// Sets the speed ahead of all robots.
fn drive(batch: &mut WorldBatch, robot: &RobotModel, speed: f64) -> anyhow::Result<()> {
    let command = Command { base_velocity: [speed, 0.0, 0.0], ..robot.start_command() };
    for world in 0..batch.len() {
        batch.command(world, &command)?;
    }
    Ok(())
}

/// Start of a robot that looks at the trunk, from bearings all around.
fn start(world: usize, worlds: usize) -> Pose {
    let bearing = std::f64::consts::TAU * world as f64 / worlds as f64;
    let (sin, cos) = orchard_geometry::math::sin_cos(bearing);
    let p = Vec3::new(DISTANCE * cos, DISTANCE * sin, 0.0);
    let turn = Rotation::from_axis_angle(&Vec3::z_axis(), bearing + std::f64::consts::PI);
    Pose::from_parts(p.into(), turn)
}
