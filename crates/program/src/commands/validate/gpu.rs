//! Suite `gpu`: trees, robots, and worlds of both, on the graphics device against the same in f64.

mod robots;
mod worlds;

use std::sync::Arc;

use anyhow::{Context, ensure};
use orchard_batch::{Batch, BatchEvent, TreeWorld, TreeWorldError};
use orchard_geometry::{Vec3, transform};
use orchard_gpu::{Choice, Gpu, GpuBatch, GpuError, Options};
use orchard_multibody::{BodyId, Data, forward_kinematics};
use orchard_spec::{Preset, Purpose, Spec, Stream};
use rayon::prelude::*;

use crate::failure::Failure;
use crate::failure::Verdict;
use crate::rows::{Effort, Measured, Row};

/// Number of worlds with breaks, with fruit pulled off stems that bend, and without either; a software adapter gets fewer.
const BREAKING: u32 = 768;
const RELEASING: u32 = 256;
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
/// Wood as measured has little damping: half of the pull stays on, since the joints bend too little by themselves for an error over the largest angle; and rounding adds
/// up over the ten substeps and more in which a mode decays, by sqrt(10).
const MEASURED_KICK: f64 = 0.2;
const MEASURED_STAYS_ON: f64 = 0.5;
const MEASURED_STATE_ERROR: f64 = 1.6e-4;
/// Root mean square error of the device over that of lanes, which step the same worlds in f32. Independent errors add by their squares: a device that rounds as much as lanes, and as
/// much again, has sqrt(2).
const OVER_LANES: f64 = std::f64::consts::SQRT_2;
/// Thin twigs whip. A world is compared if no link turns faster than this at the end of a frame [rad/s]: within a frame it may be three times as fast, and from 18 rad/s on f64
/// takes velocity products otherwise (decision 10).
const FASTEST: f64 = 6.0;
/// Kick and share of the pull on trees with fruit on stems that bend.
const STEMS_KICK: f64 = 0.1;
const STEMS_PULL: f64 = 0.5;
/// Worlds, kick and share of the pull in wind (`docs/computation/gpu.md`, Agreement).
const WINDY: u32 = 8;
const WINDY_KICK: f64 = 0.05;
const WINDY_PULL: f64 = 0.25;
/// Pull on a fruit on a stem that bends, in multiples of the strength of its zone: down, and sideways along each axis.
const DOWN: (f64, f64) = (0.3, 1.6);
const SIDEWAYS: (f64, f64) = (-0.6, 0.6);
/// Mean wind at the height of the canopy [m/s].
const WIND: f64 = 2.0;
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
        say!("{:<36} {figure} {}", row.name, row.unit);
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
    let gentle = count(GENTLE);
    let gentle_on = |worlds: Vec<TreeWorld>, pull: f64, stays_on: f64| {
        pull_and_release(gpu, worlds, Vec3::from(GENTLE_FORCE) * pull, stays_on)
    };
    let stems = Spec::preset(Preset::Calibrated);
    let paper = gentle_on(grown(Spec::paper(), gentle, GENTLE_KICK)?, 1.0, 0.0)?;
    let wood = grown(Spec::preset(Preset::MeasuredWood), gentle, MEASURED_KICK)?;
    let measured = gentle_on(wood, 1.0, MEASURED_STAYS_ON)?;
    let on_stems = gentle_on(grown(stems.clone(), gentle, STEMS_KICK)?, STEMS_PULL, MEASURED_STAYS_ON)?;
    let in_wind = gentle_on(grown(windy()?, WINDY, WINDY_KICK)?, WINDY_PULL, MEASURED_STAYS_ON)?;
    let broken = breaking(gpu, count(BREAKING))?;
    let released = releasing(gpu, stems, count(RELEASING))?;
    let row = |name: &str, value: f64, unit: &str| Row::measured(name, value, unit);
    let enough = row("gpu.events", broken.all as f64, "events");
    let mut rows = vec![
        row("gpu.state_error", paper.state.largest, "1").at_most(STATE_ERROR),
        row("gpu.tip_error", paper.tip, "m").at_most(TIP_ERROR),
        row("gpu.measured_wood.state_error", measured.state.largest, "1"),
        row("gpu.measured_wood.lanes.state_error", measured.in_lanes.largest, "1"),
        row("gpu.measured_wood.over_lanes", measured.over_lanes(), "1").at_most(OVER_LANES),
        row("gpu.measured_wood.tip_error", measured.tip, "m").at_most(TIP_ERROR),
        row("gpu.measured_wood.worlds", f64::from(measured.worlds), "worlds").at_least(1.0),
    ];
    for (name, errors) in [("stems", on_stems), ("wind", in_wind)] {
        rows.extend([
            row(&format!("gpu.{name}.state_error"), errors.state.largest, "1").at_most(MEASURED_STATE_ERROR),
            row(&format!("gpu.{name}.tip_error"), errors.tip, "m").at_most(TIP_ERROR),
            row(&format!("gpu.{name}.fruit_error"), errors.fruit, "m").at_most(TIP_ERROR),
            row(&format!("gpu.{name}.worlds"), f64::from(errors.worlds), "worlds").at_least(1.0),
        ]);
    }
    rows.extend(robots::rows(gpu, gentle)?);
    rows.extend(worlds::rows(gpu, gentle)?);
    rows.push(if is_software { enough } else { enough.at_least(EVENTS) });
    rows.extend(broken.rows("gpu.events"));
    rows.push(row("gpu.stems.events", released.all as f64, "events"));
    rows.extend(released.rows("gpu.stems.events"));
    let mut measured = Measured::from(rows);
    measured.context.insert("adapter", Some(gpu.info().name.clone()));
    measured.context.insert("driver", Some(gpu.info().driver.clone()));
    Ok(measured)
}

/// The preset `measured-wood` with fruit on stems that bend, in wind.
fn windy() -> anyhow::Result<Spec> {
    let mut spec = Spec::preset(Preset::MeasuredWood);
    spec.fruit.stem = Spec::preset(Preset::Calibrated).fruit.stem;
    let wind = spec.wind.as_mut().context("the preset measured-wood has no table [wind]")?;
    wind.speed = wind.speed.with_value(WIND).map_err(anyhow::Error::msg)?;
    Ok(spec)
}

/// The first `count` kicked worlds of a spec that find their static equilibrium.
fn grown(spec: Spec, count: u32, rate: f64) -> anyhow::Result<Vec<TreeWorld>> {
    let spec = Arc::new(spec);
    let grow = |index: u32| match TreeWorld::grow(spec.clone(), SEED, index) {
        Ok(mut world) => {
            let mut stream = Stream::new(SEED, index, Purpose::Test);
            world.data_mut().v.iter_mut().for_each(|v| *v = stream.uniform(-rate, rate));
            Ok(Some(world))
        }
        Err(TreeWorldError::Equilibrium(_)) => Ok(None),
        Err(e) => Err(e),
    };
    let mut worlds: Vec<TreeWorld> = Vec::with_capacity(count as usize);
    let mut next = 0;
    while worlds.len() < count as usize {
        ensure!(next < 2 * count, "half of the trees find no static equilibrium");
        let missing = count - worlds.len() as u32;
        let more: Vec<Option<TreeWorld>> =
            (next..next + missing).into_par_iter().map(grow).collect::<Result<_, _>>()?;
        worlds.extend(more.into_iter().flatten());
        next += missing;
    }
    Ok(worlds)
}

/// Largest errors of any world.
#[derive(Debug, Clone, Copy, Default)]
struct Errors {
    /// Of an angle of the wood's joints by the largest one: on the device, and in lanes.
    state: AngleErrors,
    in_lanes: AngleErrors,
    /// Of a segment's tip \[m\].
    tip: f64,
    /// Of a fruit \[m\].
    fruit: f64,
    /// Number of worlds that were compared.
    worlds: u32,
}

impl Errors {
    /// Root mean square error of the angles on the device over that in lanes.
    fn over_lanes(&self) -> f64 {
        (self.state.squares / self.in_lanes.squares).sqrt()
    }
}

/// Errors of the angles of the wood's joints of all worlds, by the largest angle of each world.
#[derive(Debug, Clone, Copy, Default)]
struct AngleErrors {
    largest: f64,
    /// Sum of squares.
    squares: f64,
}

impl AngleErrors {
    /// Adds a world's angles, beside those in f64.
    fn add(&mut self, angles: &[f64], expected: &[f64]) {
        let most = expected.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        for (angle, expected) in angles.iter().zip(expected) {
            let error = (angle - expected).abs() / most;
            self.largest = self.largest.max(error);
            self.squares += error * error;
        }
    }
}

/// Errors after half a second of a pull on some tips, and half a second with a part of it.
fn pull_and_release(
    gpu: &Gpu,
    mut worlds: Vec<TreeWorld>,
    pull: Vec3,
    stays_on: f64,
) -> anyhow::Result<Errors> {
    let mut batch =
        GpuBatch::with_options(gpu, &worlds, Options { pushes_each: GENTLE_TIPS, ..Options::default() })?;
    let mut lanes = Batch::new(&worlds)?;
    let mut fastest = vec![0.0_f64; worlds.len()];
    for force in [pull, pull * stays_on] {
        for (index, world) in worlds.iter_mut().enumerate() {
            let parent = world.plant().tree.parent.clone();
            for segment in (0..parent.len()).filter(|i| !parent.contains(&Some(*i))).take(GENTLE_TIPS) {
                ensure!(batch.push(index, segment, force, Vec3::zeros()), "the batch has no free force slot");
                lanes.push(index, segment, force, Vec3::zeros());
                let body = world.plant().tree.bodies[segment];
                world.data_mut().body_force_world[body.index()] = force;
            }
        }
        batch.advance(HALF);
        lanes.step(HALF);
        worlds.par_iter_mut().zip(&mut fastest).for_each(|(world, fastest)| {
            for _ in 0..HALF {
                world.step();
                *fastest = fastest.max(fastest_link(world));
            }
        });
    }
    let broken: Vec<usize> = batch.events()?.into_iter().map(|event| event.world).collect();
    let mut worst = Errors::default();
    let is_modal = worlds.iter().any(|world| world.plant().tree.is_modal);
    for (index, world) in worlds.iter().enumerate() {
        if is_modal && fastest[index] > FASTEST {
            continue;
        }
        ensure!(!broken.contains(&index), "a joint or stem broke in the comparison without ruptures");
        worst.worlds += 1;
        let [mut data, mut in_lanes] = [(); 2].map(|()| world.data().clone());
        batch.store(index, &mut data)?;
        lanes.store(index, &mut in_lanes);
        let plant = world.plant();
        let angles = |data: &Data| -> Vec<f64> {
            plant.tree.bodies.iter().flat_map(|&id| &data.q[plant.model.qs(id)]).copied().collect()
        };
        let largest = |x: &mut dyn Iterator<Item = f64>| x.fold(0.0_f64, |most, x| most.max(x.abs()));
        let apart = |a: &[Vec3], b: &[Vec3]| largest(&mut a.iter().zip(b).map(|(a, b)| (a - b).norm()));
        let expected = angles(world.data());
        worst.state.add(&angles(&data), &expected);
        worst.in_lanes.add(&angles(&in_lanes), &expected);
        worst.fruit = worst.fruit.max(apart(&data.point_p_world, &world.data().point_p_world));
        worst.tip = worst.tip.max(apart(&tips(world, data), &tips(world, world.data().clone())));
    }
    Ok(worst)
}

/// Angular velocity of the fastest link of a tree [rad/s].
fn fastest_link(world: &TreeWorld) -> f64 {
    let (plant, mut data) = (world.plant(), world.data().clone());
    forward_kinematics(&plant.model, &mut data);
    plant.tree.bodies.iter().fold(0.0, |most, &id| data.velocity(id).angular.norm().max(most))
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
    let mut worlds = grown(Spec::paper(), count, KICK)?;
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
    Events::of(batch, &mut worlds, is_landing)
}

/// Fruit pulled off stems that bend. A world is compared until a limb breaks or a twig whips ([`FASTEST`]).
fn releasing(gpu: &Gpu, spec: Spec, count: u32) -> anyhow::Result<Events> {
    let mut worlds = grown(spec, count, MEASURED_KICK)?;
    let mut batch = GpuBatch::new(gpu, &worlds)?;
    for (index, world) in worlds.iter_mut().enumerate() {
        let plant = world.plant().clone();
        let mut stream = Stream::new(SEED + 1, index as u32, Purpose::Test);
        for fruit in 0..FRUIT.min(plant.fruit.len()) {
            let [x, y] = [(); 2].map(|()| stream.uniform(SIDEWAYS.0, SIDEWAYS.1));
            let along = Vec3::new(x, y, -stream.uniform(DOWN.0, DOWN.1));
            let force = along * plant.fruit.fruit[fruit].detach_force;
            batch.pull(index, fruit, force);
            world.data_mut().point_force_world[plant.fruit.points[fruit].index()] = force;
        }
    }
    let whips = |world: &TreeWorld| fastest_link(world) > FASTEST;
    Events::of(batch, &mut worlds, |world| !world.rupture().breaks().is_empty() || whips(world))
}

impl Events {
    /// Events of a second, in the worlds and on the device; a world is compared until `is_over` says so.
    fn of(
        mut batch: GpuBatch,
        worlds: &mut [TreeWorld],
        is_over: impl Fn(&TreeWorld) -> bool + Sync,
    ) -> anyhow::Result<Self> {
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
                    if is_over(world) {
                        return (events, frame);
                    }
                }
                (events, SECOND)
            })
            .collect();
        let mut events = Self { all: 0, missed: 0, late: 0, listed: Vec::new() };
        for (index, (mut expected, end)) in expected.into_iter().enumerate() {
            expected.sort_unstable();
            let of_world = |event: &&BatchEvent| event.world == index && event.frame <= end;
            let found: Vec<&BatchEvent> = found.iter().filter(of_world).collect();
            events.compare(&expected, &found, end);
        }
        Ok(events)
    }

    /// Rows of the share in the same frame, and of those that are further off than one.
    fn rows(self, name: &str) -> [Row; 2] {
        let share = (self.all - self.missed.min(self.all)) as f64 / self.all.max(1) as f64;
        let note = (!self.listed.is_empty()).then(|| self.listed.join("; "));
        let same = Row::measured(&format!("{name}.same_frame"), share, "1").at_least(SAME_FRAME);
        let late = Row::measured(&format!("{name}.over_a_frame_off"), self.late as f64, "events");
        [Row { note, ..same }, late.at_most(0.0)]
    }

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
