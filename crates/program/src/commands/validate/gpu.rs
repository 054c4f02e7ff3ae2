//! Suite `gpu`: trees on the graphics device against the same trees in f64.

use std::sync::Arc;

use anyhow::{Context, ensure};
use orchard_batch::{BatchEvent, TreeWorld};
use orchard_geometry::{Vec3, transform};
use orchard_gpu::{Choice, Gpu, GpuBatch, GpuError, Options};
use orchard_multibody::{BodyId, Data, forward_kinematics};
use orchard_spec::{Preset, Purpose, Spec, Stream};
use rayon::prelude::*;

use crate::failure::Failure;
use crate::failure::Verdict;
use crate::rows::{Effort, Measured, Row};

/// Number of worlds with breaks, and without; a software adapter gets fewer.
const BREAKING: u32 = 768;
const GENTLE: u32 = 64;
const SOFTWARE: u32 = 8;
/// Frames of either: a pull and a release of half a second each, or a second of breaking.
const HALF: u32 = 30;
const SECOND: u32 = 60;
/// Requirements: share of events in the same frame, least number of events, relative error of the joint state, error of tips \[m\].
const SAME_FRAME: f64 = 0.999;
const EVENTS: f64 = 5000.0;
const STATE_ERROR: f64 = 5e-5;
const TIP_ERROR: f64 = 1e-5;
/// Numbers of limbs and fruit of a world that are pulled, and ranges of force: limbs \[N\], fruit in multiples of the detachment force.
const LIMBS: usize = 3;
const FRUIT: usize = 8;
const LIMB_FORCE: (f64, f64) = (100.0, 500.0);
const FRUIT_FORCE: (f64, f64) = (0.8, 3.0);
/// Rates of the joints at the start \[rad/s\].
const KICK: f64 = 1.0;
const GENTLE_KICK: f64 = 0.5;
/// Wood as measured has little damping: slower joints, so that no twig turns at 18 rad/s, from where on f64 takes velocity products otherwise; half of
/// the pull stays on, since the joints bend too little by themselves for an error over the largest angle; and rounding adds up over the ten substeps and more in
/// which a mode decays, by sqrt(10).
const MEASURED_KICK: f64 = 0.2;
const MEASURED_STAYS_ON: f64 = 0.5;
const MEASURED_STATE_ERROR: f64 = 1.6e-4;
const GENTLE_FORCE: [f64; 3] = [0.4, -0.2, -0.3];
const GENTLE_TIPS: usize = 8;
/// Height of a broken limb's tip at which the comparison of a world ends \[m\]: the fall of some frames at 4 m/s.
const NEAR_GROUND: f64 = 0.2;
const SEED: u64 = 1;

/// Runs the suite as a step of `cargo xtask test`. Without an adapter it is skipped; with CI=true it fails.
pub fn check() -> Result<Verdict, Failure> {
    let gpu = match Gpu::open(Choice::Any) {
        Ok(gpu) => gpu,
        Err(GpuError::NoAdapter(why)) if std::env::var_os("CI").is_none_or(|ci| ci != "true") => {
            return Ok(Verdict::Skipped(format!("no graphics adapter: {why}")));
        }
        Err(e) => return Err(Failure::Failed(e.to_string())),
    };
    let measured = measure_on(&gpu)?;
    for row in &measured.rows {
        let figure = row.value.map_or("none".to_owned(), |value| format!("{value:.3e}"));
        say!("{:<30} {figure} {}", row.name, row.unit);
    }
    match measured.rows.iter().find(|row| row.pass == Some(false)) {
        Some(row) => Err(Failure::Failed(format!("target missed: {}", row.name))),
        None => Ok(Verdict::Agreed),
    }
}

/// Compares states after a second of pull and release, and events.
pub fn measure(_: Effort) -> anyhow::Result<Measured> {
    measure_on(&Gpu::open(Choice::Any).context("the suite gpu needs a graphics adapter")?)
}

fn measure_on(gpu: &Gpu) -> anyhow::Result<Measured> {
    let is_software = gpu.info().is_software;
    let count = |worlds: u32| if is_software { SOFTWARE } else { worlds };
    let (state, tip) = pull_and_release(gpu, grown(Preset::Paper, count(GENTLE), GENTLE_KICK)?, 0.0)?;
    let measured = grown(Preset::MeasuredWood, count(GENTLE), MEASURED_KICK)?;
    let (measured_state, measured_tip) = pull_and_release(gpu, measured, MEASURED_STAYS_ON)?;
    let Events { all, missed, late, listed } = breaking(gpu, count(BREAKING))?;
    let share = (all - missed.min(all)) as f64 / all.max(1) as f64;
    let row = |name: &str, value: f64, unit: &str| Row::measured(name, value, unit);
    let enough = row("gpu.events", all as f64, "events");
    let note = (!listed.is_empty()).then(|| listed.join("; "));
    let rows = vec![
        row("gpu.state_error", state, "1").at_most(STATE_ERROR),
        row("gpu.tip_error", tip, "m").at_most(TIP_ERROR),
        row("gpu.measured_wood.state_error", measured_state, "1").at_most(MEASURED_STATE_ERROR),
        row("gpu.measured_wood.tip_error", measured_tip, "m").at_most(TIP_ERROR),
        if is_software { enough } else { enough.at_least(EVENTS) },
        Row { note, ..row("gpu.events.same_frame", share, "1").at_least(SAME_FRAME) },
        row("gpu.events.over_a_frame_off", late as f64, "events").at_most(0.0),
    ];
    let mut measured = Measured::from(rows);
    measured.context.insert("adapter", Some(gpu.info().name.clone()));
    measured.context.insert("driver", Some(gpu.info().driver.clone()));
    Ok(measured)
}

fn grown(preset: Preset, count: u32, rate: f64) -> anyhow::Result<Vec<TreeWorld>> {
    let spec = Arc::new(Spec::preset(preset));
    (0..count)
        .into_par_iter()
        .map(|index| {
            let mut world = TreeWorld::grow(spec.clone(), SEED, index)?;
            let mut stream = Stream::new(SEED, index, Purpose::Test);
            world.data_mut().v.iter_mut().for_each(|v| *v = stream.uniform(-rate, rate));
            Ok(world)
        })
        .collect()
}

/// Largest errors of any world after half a second of a pull, and half a second with a part of it: of its joint angles by the largest one, and of its tips \[m\].
fn pull_and_release(gpu: &Gpu, mut worlds: Vec<TreeWorld>, stays_on: f64) -> anyhow::Result<(f64, f64)> {
    let mut batch =
        GpuBatch::with_options(gpu, &worlds, Options { pushes_each: GENTLE_TIPS, ..Options::default() })?;
    for force in [Vec3::from(GENTLE_FORCE), Vec3::from(GENTLE_FORCE) * stays_on] {
        for (index, world) in worlds.iter_mut().enumerate() {
            let parent = world.plant().tree.parent.clone();
            for segment in (0..parent.len()).filter(|i| !parent.contains(&Some(*i))).take(GENTLE_TIPS) {
                ensure!(batch.push(index, segment, force, Vec3::zeros()), "the batch has no free force slot");
                let body = world.plant().tree.bodies[segment];
                world.data_mut().body_force_world[body.index()] = force;
            }
        }
        batch.advance(HALF);
        worlds.par_iter_mut().for_each(|world| (0..HALF).for_each(|_| drop(world.step())));
    }
    ensure!(batch.events()?.is_empty(), "a joint or stem broke in the comparison without ruptures");
    let (mut state, mut tip) = (0.0_f64, 0.0_f64);
    for (index, world) in worlds.iter().enumerate() {
        let mut data = world.data().clone();
        batch.store(index, &mut data)?;
        let largest = |x: &mut dyn Iterator<Item = f64>| x.fold(0.0_f64, |most, x| most.max(x.abs()));
        let error = largest(&mut data.q.iter().zip(&world.data().q).map(|(a, b)| a - b));
        state = state.max(error / largest(&mut world.data().q.iter().copied()));
        let here = tips(world, data);
        let there = tips(world, world.data().clone());
        tip = tip.max(largest(&mut here.iter().zip(there).map(|(a, b)| (a - b).norm())));
    }
    Ok((state, tip))
}

fn tips(world: &TreeWorld, mut data: Data) -> Vec<Vec3> {
    let plant = world.plant();
    forward_kinematics(&plant.model, &mut data);
    let tip = |&id| transform(data.x_world_body(id), &(plant.model.body(id).inertia.p_com * 2.0));
    plant.tree.bodies.iter().map(tip).collect()
}

/// True if a broken limb is near the ground, where CPU and GPU have different contact laws.
fn is_landing(world: &TreeWorld) -> bool {
    let (plant, data) = (world.plant(), world.data());
    let is_low = |(segment, id): (usize, &BodyId)| {
        let tip = transform(data.x_world_body(*id), &(plant.model.body(*id).inertia.p_com * 2.0));
        world.rupture().is_debris(segment) && tip.z < NEAR_GROUND
    };
    plant.tree.bodies.iter().enumerate().any(is_low)
}

/// Counts of the events of all worlds, up to and including the first mismatch of each.
struct Events {
    all: usize,
    /// Not in the same frame.
    missed: usize,
    /// Not within one frame.
    late: usize,
    /// Description of each mismatch.
    listed: Vec<String>,
}

fn breaking(gpu: &Gpu, count: u32) -> anyhow::Result<Events> {
    let mut worlds = grown(Preset::Paper, count, KICK)?;
    let mut batch = GpuBatch::new(gpu, &worlds)?;
    for (index, world) in worlds.iter_mut().enumerate() {
        let plant = world.plant().clone();
        let mut stream = Stream::new(SEED + 1, index as u32, Purpose::Test);
        for _ in 0..LIMBS {
            let segment = stream.integer(1, plant.tree.len() as u32 - 1) as usize;
            let force = Vec3::new(0.0, 0.0, -stream.uniform(LIMB_FORCE.0, LIMB_FORCE.1));
            ensure!(batch.push(index, segment, force, Vec3::zeros()), "the batch has no free force slot");
            world.data_mut().body_force_world[plant.tree.bodies[segment].index()] = force;
        }
        for fruit in 0..FRUIT.min(plant.fruit.len()) {
            let size = stream.uniform(FRUIT_FORCE.0, FRUIT_FORCE.1) * plant.fruit.fruit[fruit].detach_force;
            let force = Vec3::new(0.0, 0.0, -size);
            batch.pull(index, fruit, force);
            world.data_mut().point_force_world[plant.fruit.points[fruit].index()] = force;
        }
    }
    batch.advance(SECOND);
    let found = batch.events()?;
    let expected: Vec<(Vec<BatchEvent>, u32)> = worlds
        .par_iter_mut()
        .enumerate()
        .map(|(index, world)| {
            let mut events = Vec::new();
            for frame in 1..=SECOND {
                events.extend(world.step().into_iter().map(|event| BatchEvent {
                    frame,
                    world: index,
                    event,
                }));
                if is_landing(world) {
                    return (events, frame);
                }
            }
            (events, SECOND)
        })
        .collect();
    let mut events = Events { all: 0, missed: 0, late: 0, listed: Vec::new() };
    for (index, (mut expected, end)) in expected.into_iter().enumerate() {
        expected.sort_unstable();
        let of_world = |event: &&BatchEvent| event.world == index && event.frame <= end;
        let found: Vec<&BatchEvent> = found.iter().filter(of_world).collect();
        events.compare(&expected, &found, end);
    }
    Ok(events)
}

impl Events {
    /// Counts a world's events up to its first mismatch; after it the two simulations differ.
    fn compare(&mut self, expected: &[BatchEvent], found: &[&BatchEvent], end: u32) {
        let same = expected.iter().zip(found).take_while(|(a, b)| a == *b).count();
        self.all += same;
        if same == expected.len() && same == found.len() {
            return;
        }
        self.all += 1;
        self.missed += 1;
        let (wanted, got) = (expected.get(same), found.get(same));
        // The missing or early event may be a few places later in the other list.
        let off = match (wanted, got) {
            (Some(wanted), _) => frames_off(wanted, found.iter().copied()),
            (None, Some(got)) => frames_off(got, expected.iter()),
            (None, None) => Some(0),
        };
        // An event at the end of the comparison may also be one frame late.
        let is_last = wanted.map_or(0, |e| e.frame).max(got.map_or(0, |e| e.frame)) >= end;
        self.late += usize::from(!is_last && off.is_none_or(|frames| frames > 1));
        self.listed.push(format!(
            "{:?} in f64, {:?} on the device",
            wanted.map(describe),
            got.map(|e| describe(e))
        ));
    }
}

/// Number of frames between an event and the same event in `others`; `None` if it is missing.
fn frames_off<'a>(event: &BatchEvent, mut others: impl Iterator<Item = &'a BatchEvent>) -> Option<u32> {
    others.find(|other| other.event == event.event).map(|other| other.frame.abs_diff(event.frame))
}

fn describe(event: &BatchEvent) -> String {
    format!("world {} frame {} {:?}", event.world, event.frame, event.event)
}
