//! Robots that push trees on the graphics device, against f64 worlds.

use std::sync::Arc;

use anyhow::Context;
use orchard_batch::{TreeEvent, TreeWorld};
use orchard_gpu::{Gpu, WorldBatch};
use orchard_multibody::{Data, forward_kinematics};
use orchard_robot::{Command, RobotModel};
use orchard_spec::Spec;
use orchard_world::{Planting, World, WorldEvent};
use rayon::prelude::*;

use super::SEED;
use crate::rows::Row;

/// Distance of the robot from the trunk \[m\], the angle by which it looks past it \[degrees\], speed at which it drives ahead through the canopy [m/s], and frames of the drive.
const DISTANCE: f64 = 1.6;
const HEADING: (f64, f64) = (-25.0, 25.0);
const SPEED: f64 = 1.0;
const FRAMES: u32 = 100;
/// Rupture stress of the wood in rams [MPa]: robots break some of it soon.
const WEAK: f64 = 15.0;
/// Requirements: relative errors of impulse and peak force on wood up to the first rupture, share of first ruptures at the same joint within [`LATE`] frames.
const IMPULSE: f64 = 0.03;
const PEAK: f64 = 0.05;
const SAME_JOINT: f64 = 0.95;
const LATE: u32 = 2;
/// A robot that presses wood without a change of contact: frames of 0.2 s, speed [m/s] and frames before, and requirements: joints [rad, m], tips \[m\].
const STEADY: u32 = 12;
const CREEP: f64 = 0.1;
const APPROACH: u32 = 150;
const JOINT_ERROR: f64 = 1e-4;
const TIP_ERROR: f64 = 1e-4;

/// A world in f64, with what the rows compare.
struct Pushed {
    world: World,
    tree: TreeWorld,
    expected: Push,
    found: Push,
}

/// Loads up to the first rupture, its joint and its frame.
#[derive(Debug, Clone, Copy, Default)]
struct Push {
    impulse: f64,
    peak: f64,
    first: Option<(usize, u32)>,
}

/// Rows of `count` worlds, each with a tree of its own: rams of the paper's robot, and a slow push.
pub fn rows(gpu: &Gpu, count: u32) -> anyhow::Result<Vec<Row>> {
    let mut spec = Spec::paper();
    let start = &mut spec.episode.start;
    start.distance = start.distance.with_ends(DISTANCE, DISTANCE).map_err(anyhow::Error::msg)?;
    start.heading = start.heading.with_ends(HEADING.0, HEADING.1).map_err(anyhow::Error::msg)?;
    let robot = Arc::new(RobotModel::paper());
    let mut weak = spec.clone();
    let stress = &mut weak.wood.rupture_stress;
    *stress = stress.with_value(WEAK).map_err(anyhow::Error::msg)?;
    let mut all = rams(gpu, &robot, grown(&Arc::new(weak), &robot, count)?)?;
    all.extend(steady(gpu, &robot, grown(&Arc::new(spec), &robot, count)?)?);
    Ok(all)
}

/// Worlds at their start.
fn grown(spec: &Arc<Spec>, robot: &Arc<RobotModel>, count: u32) -> anyhow::Result<Vec<Pushed>> {
    let of_index = |index| {
        let world = World::new(spec.clone(), robot.clone(), SEED, index)?;
        let Planting { spec, skeleton, fruit, .. } = Planting::draw(spec, SEED, index, 0)?;
        let tree = TreeWorld::drawn(spec, &skeleton, fruit, SEED, index)?;
        Ok(Pushed { world, tree, expected: Push::default(), found: Push::default() })
    };
    (0..count).into_par_iter().map(of_index).collect()
}

/// A batch of the worlds as they are, under one command.
fn batch_of(
    gpu: &Gpu,
    robot: &RobotModel,
    worlds: &[Pushed],
    command: &Command,
) -> anyhow::Result<WorldBatch> {
    let trees: Vec<TreeWorld> = worlds.iter().map(|own| own.tree.clone()).collect();
    let starts: Vec<_> = worlds.iter().map(|own| own.world.x_world_odom()).collect();
    let mut batch = WorldBatch::new(gpu, &trees, robot, &starts)?;
    (0..worlds.len()).try_for_each(|index| batch.command(index, command))?;
    Ok(batch)
}

/// The robot drives into the trees.
fn rams(gpu: &Gpu, robot: &RobotModel, mut worlds: Vec<Pushed>) -> anyhow::Result<Vec<Row>> {
    let command = Command { base_velocity: [SPEED, 0.0, 0.0], ..robot.start_command() };
    let mut batch = batch_of(gpu, robot, &worlds, &command)?;
    let mut lost = 0.0;
    for frame in 1..=FRAMES {
        batch.advance(1);
        worlds.par_iter_mut().for_each(|own| own.step(&command, frame));
        for event in batch.events()? {
            if let TreeEvent::Snapped { segment } = event.event {
                worlds[event.world].found.first.get_or_insert((segment, event.frame));
            }
        }
        for (index, own) in worlds.iter_mut().enumerate() {
            if own.expected.first.is_none() && own.found.first.is_none() {
                let (load, meeting) = (own.world.wood_load(), batch.meeting(index)?);
                (own.expected.impulse, own.expected.peak) = (load.contact_impulse, load.peak_contact_force);
                own.found.impulse = f64::from(meeting.contact_impulse);
                own.found.peak = f64::from(meeting.peak_contact_force);
            }
        }
    }
    let (mut impulse, mut peak, mut broke, mut same) = (0.0_f64, 0.0_f64, 0.0, 0.0);
    for (index, Pushed { expected, found, .. }) in worlds.iter().enumerate() {
        lost += f64::from(batch.meeting(index)?.lost);
        if expected.impulse > 0.0 {
            impulse = impulse.max((found.impulse / expected.impulse - 1.0).abs());
            peak = peak.max((found.peak / expected.peak - 1.0).abs());
        }
        if let Some((joint, frame)) = expected.first {
            broke += 1.0;
            let is_same = found.first.is_some_and(|own| own.0 == joint && own.1.abs_diff(frame) <= LATE);
            same += f64::from(u8::from(is_same));
        }
    }
    Ok(vec![
        Row::measured("gpu.worlds.rams.impulse_error", impulse, "1").at_most(IMPULSE),
        Row::measured("gpu.worlds.rams.peak_force_error", peak, "1").at_most(PEAK),
        Row::measured("gpu.worlds.rams.ruptures", broke, "worlds").at_least(1.0),
        Row::measured("gpu.worlds.rams.same_joint", same / f64::max(broke, 1.0), "1").at_least(SAME_JOINT),
        Row::measured("gpu.worlds.rams.lost", lost, "contacts"),
    ])
}

impl Pushed {
    fn step(&mut self, command: &Command, frame: u32) {
        self.world.step(command);
        for event in self.world.drain_events() {
            if let WorldEvent::BranchSnapped { segment, .. } = event {
                self.expected.first.get_or_insert((segment, frame));
            }
        }
    }

    /// Colliders in loaded contact in the latest substep.
    fn loaded(&self) -> Vec<(usize, usize)> {
        let contacts = self.world.report().contacts.iter().filter(|c| c.force_world.norm() > 0.0);
        contacts.map(|c| (c.a.index(), c.b.index())).collect()
    }
}

/// The robot creeps on into the trees; the f64 worlds take over the state of the device, and both go on for 0.2 s. Worlds in which a contact begins or ends meanwhile, or wood breaks, are left out.
fn steady(gpu: &Gpu, robot: &RobotModel, mut worlds: Vec<Pushed>) -> anyhow::Result<Vec<Row>> {
    let drive = Command { base_velocity: [SPEED, 0.0, 0.0], ..robot.start_command() };
    let command = Command { base_velocity: [CREEP, 0.0, 0.0], ..robot.start_command() };
    let mut batch = batch_of(gpu, robot, &worlds, &drive)?;
    // Each world drives up to its first contact, then creeps.
    let mut touches = vec![false; worlds.len()];
    for frame in 1..=APPROACH {
        batch.advance(1);
        worlds.par_iter_mut().zip(&touches).for_each(|(own, touches)| {
            own.step(if *touches { &command } else { &drive }, frame);
        });
        for (index, (own, touches)) in worlds.iter().zip(&mut touches).enumerate() {
            if !*touches && !own.loaded().is_empty() {
                *touches = true;
                batch.command(index, &command)?;
            }
        }
    }
    for (index, own) in worlds.iter_mut().enumerate() {
        let data = stored(&mut batch, index, &own.world)?;
        *own.world.data_mut() = data;
    }
    let mut kept: Vec<bool> = worlds.iter().map(|own| own.expected.first.is_none()).collect();
    let mut before: Vec<Option<Vec<(usize, usize)>>> = vec![None; worlds.len()];
    for _ in 0..STEADY {
        batch.advance(1);
        worlds.par_iter_mut().for_each(|own| own.step(&command, 0));
        for ((own, kept), before) in worlds.iter().zip(&mut kept).zip(&mut before) {
            let now = own.loaded();
            let is_same = before.as_ref().is_none_or(|before| *before == now);
            *kept &= own.expected.first.is_none() && !now.is_empty() && is_same;
            *before = Some(now);
        }
    }
    let (mut joints, mut tips, mut compared) = (0.0_f64, 0.0_f64, 0.0);
    for (index, own) in worlds.iter().enumerate().filter(|(index, _)| kept[*index]) {
        let data = stored(&mut batch, index, &own.world)?;
        let (world, model) = (&own.world, own.world.model());
        let bodies = world.handle().bodies.iter().flat_map(|&body| model.qs(body));
        joints = bodies.fold(joints, |most, q| most.max((data.q[q] - world.data().q[q]).abs()));
        for &body in &world.tree().bodies {
            let p = |data: &Data| data.x_world_body(body).translation.vector;
            tips = tips.max((p(&data) - p(world.data())).norm());
        }
        compared += 1.0;
    }
    Ok(vec![
        Row::measured("gpu.worlds.steady.joint_error", joints, "rad").at_most(JOINT_ERROR),
        Row::measured("gpu.worlds.steady.wood_error", tips, "m").at_most(TIP_ERROR),
        Row::measured("gpu.worlds.steady.worlds", compared, "worlds").at_least(1.0),
    ])
}

/// The f64 state of a batch's world.
fn stored(batch: &mut WorldBatch, index: usize, world: &World) -> anyhow::Result<Data> {
    let mut data = world.data().clone();
    batch.store_tree(index, &mut data).with_context(|| format!("world {index}"))?;
    batch.store_robot(index, world.model(), world.handle(), &mut data)?;
    forward_kinematics(world.model(), &mut data);
    Ok(data)
}
