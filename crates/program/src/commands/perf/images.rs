//! Suite `images`: depth images and colour pictures of many trees at once on a graphics device.

use std::sync::Arc;
use std::time::Instant;

use orchard_camera::picture::look_at;
use orchard_camera::{Exposure, ImageKey, Sensor};
use orchard_geometry::{Intrinsics, Vec3};
use orchard_gpu::{Choice, DeviceArray, Gpu, ImageBatch, Look, Subject, View};
use orchard_robot::RobotModel;
use orchard_spec::{Preset, Spec};
use orchard_world::{Sight, World};
use rayon::prelude::*;

use super::pictures;
use crate::rows::{Effort, Measured, Row};

/// Seed of the trees.
const SEED: u64 = 20250704;
/// Columns and rows of the small images, and their vertical field of view \[rad\].
const SIDE: usize = 128;
const FOV: f64 = 1.0;
/// Distance and height of the camera from the trunk's foot \[m\]; it stands where a robot's wrist is at work.
const DISTANCE: f64 = 0.9;
const HEIGHT: f64 = 1.2;
/// Targets on one card \[images/s\]: small images, and those of a stereo camera with its noise.
const SMALL: f64 = 400_000.0;
const STEREO: f64 = 15_000.0;
/// Other cameras with noise.
const OTHERS: [&str; 4] = ["d435i-aligned", "zed-mini", "azure-kinect-native", "azure-kinect"];
/// Unit of the rows.
const UNIT: &str = "images/s";
/// Times that the device draws in a round without being read.
const AGAIN: usize = 10;

/// Measures images of distinct trees with leaves, fruit and a robot; each is seen from a place of its own.
pub fn measure(effort: Effort) -> anyhow::Result<Measured> {
    let (trees, small, stereo, others, rounds) = match effort {
        Effort::Full => (1024, 4096, 512, 64, 5),
        Effort::Quick => (2, 4, 2, 1, 1),
    };
    let gpu = Gpu::open(Choice::Any)?;
    let (spec, robot) = (Arc::new(Spec::preset(Preset::Paper)), Arc::new(RobotModel::paper()));
    let sights: Result<Vec<Sight>, _> = (0..trees)
        .into_par_iter()
        .map(|tree| World::new(spec.clone(), robot.clone(), SEED, tree).map(|world| world.sight_now()))
        .collect();
    let sights = sights?;
    let subject = |k: usize| {
        let place = k % sights.len();
        Subject::Kept { place, x_world_body: &sights[place].x_world_body }
    };
    let place = |k: usize| {
        let angle = std::f64::consts::TAU * k as f64 / small as f64;
        let (sin, cos) = orchard_geometry::math::sin_cos(angle);
        look_at(&Vec3::new(DISTANCE * cos, DISTANCE * sin, HEIGHT), &Vec3::new(0.0, 0.0, HEIGHT))
    };
    let mut rows = Vec::new();
    let items = sights.iter().map(|sight| sight.visible.items().len()).sum::<usize>() / sights.len();
    let intrinsics = Intrinsics::from_vertical_fov(SIDE, SIDE, FOV);
    let views: Vec<View<'_>> = (0..small)
        .map(|k| View {
            subject: subject(k),
            exposure: Exposure { intrinsics, x_world_camera: place(k), near: 0.1, far: 3.0 },
        })
        .collect();
    let note = format!("{small} images {SIDE} x {SIDE} of {trees} trees, {items} items each");
    rows.extend(rows_of(
        keeping(&gpu, &sights),
        "images.depth_128",
        &views,
        rounds,
        &note,
        Some(SMALL),
        false,
    )?);
    rows.push(row_that_stays(&gpu, keeping(&gpu, &sights), &views, rounds, &note)?);
    rows.extend(rows_of(keeping(&gpu, &sights), "images.labels_128", &views, rounds, &note, None, true)?);
    let sensor = Sensor::new(&spec_of("d435i")?);
    let views: Vec<View<'_>> =
        (0..stereo).map(|k| View { subject: subject(k), exposure: sensor.exposure(&place(k)) }).collect();
    let note =
        format!("{stereo} images of d435i, {} x {}", sensor.intrinsics().width, sensor.intrinsics().height);
    rows.extend(rows_of(keeping(&gpu, &sights), "images.d435i_exact", &views, rounds, &note, None, false)?);
    let key = |k: usize| ImageKey { seed: SEED, world: 0, frame: k as u32 };
    let look = |k: usize| Look { subject: subject(k), x_world_camera: place(k), key: key(k) };
    let looks: Vec<Look<'_>> = (0..stereo).map(look).collect();
    let mut batch = keeping(&gpu, &sights);
    let (mut alone, mut whole, mut here) = (Vec::new(), Vec::new(), Vec::new());
    let rate = |start: Instant, times: usize| (times * stereo) as f64 / start.elapsed().as_secs_f64();
    // The first round warms up.
    for round in 0..=rounds {
        let start = Instant::now();
        std::hint::black_box(batch.measured(&sensor, &looks)?.len());
        let of_whole = rate(start, 1);
        let start = Instant::now();
        batch.draw_again(AGAIN)?;
        if round > 0 {
            alone.push(rate(start, AGAIN));
            whole.push(of_whole);
        }
    }
    for round in 0..=rounds {
        let start = Instant::now();
        let seen = batch.depths(&views)?;
        let noisy = seen
            .par_iter()
            .enumerate()
            .map(|(k, seen)| sensor.measure(seen, key(k)).pixels().iter().filter(|z| **z > 0.0).count());
        std::hint::black_box(noisy.sum::<usize>());
        if round > 0 {
            here.push(rate(start, 1));
        }
    }
    let row = |name: &str, rates: Vec<f64>, what: &str| {
        Row::of_rounds(name, rates, UNIT, &format!("{note}: drawn on the device, {what}"))
    };
    rows.extend([
        row("images.d435i.device", alone, "noise by kernels; the device alone").at_least(STEREO),
        row("images.d435i", whole, "noise by kernels; from poses in the processor's memory to images there"),
        row("images.d435i_processor", here, "noise on the processor, all included"),
    ]);
    for camera in OTHERS {
        let sensor = Sensor::new(&spec_of(camera)?);
        let mut batch = keeping(&gpu, &sights);
        batch.measured(&sensor, &(0..others).map(look).collect::<Vec<_>>())?;
        let rates = (0..rounds).map(|_| {
            let start = Instant::now();
            batch.draw_again(AGAIN)?;
            Ok((AGAIN * others) as f64 / start.elapsed().as_secs_f64())
        });
        let rates: anyhow::Result<Vec<f64>> = rates.collect();
        let (width, height) = (sensor.intrinsics().width, sensor.intrinsics().height);
        let note =
            format!("{others} images of {camera}, {width} x {height}, noise by kernels; the device alone");
        rows.push(Row::of_rounds(&format!("images.{camera}.device"), rates?, UNIT, &note));
    }
    rows.extend(pictures::rows(&gpu, SEED, effort)?);
    Ok(rows.into())
}

fn spec_of(camera: &str) -> anyhow::Result<orchard_spec::camera::CameraSpec> {
    let scenario = orchard_scenario::Scenario::of(&[("camera", camera)])?;
    Ok(scenario.spec().camera.clone())
}

/// A batch that keeps all that can be seen in some worlds.
fn keeping(gpu: &Gpu, sights: &[Sight]) -> ImageBatch {
    let mut batch = ImageBatch::new(gpu);
    sights.iter().enumerate().for_each(|(place, sight)| batch.keep(place, &sight.visible));
    batch
}

/// Row of small images that stay on the device, in an array.
fn row_that_stays(
    gpu: &Gpu,
    mut batch: ImageBatch,
    views: &[View<'_>],
    rounds: usize,
    note: &str,
) -> anyhow::Result<Row> {
    let array = DeviceArray::new(gpu, "depth", views.len(), size_of::<f32>() * SIDE * SIDE, false)?;
    let (places, mut rates): (Vec<usize>, _) = ((0..views.len()).collect(), Vec::new());
    for round in 0..=rounds {
        let start = Instant::now();
        batch.depths_into(views, &array, &places)?;
        gpu.finish()?;
        if round > 0 {
            rates.push(views.len() as f64 / start.elapsed().as_secs_f64());
        }
    }
    let note = format!("{note}; from poses in the processor's memory to an array on the device");
    Ok(Row::of_rounds("images.depth_128.stays", rates, UNIT, &note).at_least(SMALL))
}

/// Rows of the device alone, and of all from scenes to images in memory.
fn rows_of(
    mut batch: ImageBatch,
    name: &str,
    views: &[View<'_>],
    rounds: usize,
    note: &str,
    target: Option<f64>,
    labels: bool,
) -> anyhow::Result<[Row; 2]> {
    let (mut whole, mut alone) = (Vec::new(), Vec::new());
    // The first round warms up.
    for round in 0..=rounds {
        let start = Instant::now();
        let drawn = if labels { batch.frames(views)?.len() } else { batch.depths(views)?.len() };
        let took = start.elapsed().as_secs_f64();
        let start = Instant::now();
        batch.draw_again(AGAIN)?;
        let took_alone = start.elapsed().as_secs_f64() / AGAIN as f64;
        if round > 0 {
            whole.push(drawn as f64 / took);
            alone.push(drawn as f64 / took_alone);
        }
    }
    let row = |name: &str, rates: Vec<f64>, what: &str| {
        Row::of_rounds(name, rates, UNIT, &format!("{note}; {what}"))
    };
    let alone = row(&format!("{name}.device"), alone, "on the device alone");
    Ok([
        target.map_or(alone.clone(), |target| alone.at_least(target)),
        row(name, whole, "from poses in the processor's memory to images there"),
    ])
}
