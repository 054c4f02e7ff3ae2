//! Suite `perception`: time of an image of the wrist camera, and of the detector on it. `docs/performance.md`
//! explains each row.

use anyhow::Context;
use orchard_camera::picture::{PictureStyle, Studio};
use orchard_camera::{Capture, Geometry, ImageKey, Label, Scene, Sensor, fruit_views};
use orchard_geometry::{DepthImage, Image, Intrinsics, Pose, Shape, Vec3};
use orchard_perception::{DetectorConfig, RgbdImage, detect, mask};
use orchard_scenario::{OptionValue, Scenario};
use orchard_spec::camera::CameraSpec;
use orchard_tasks::harvest::Harvest;
use orchard_tasks::harvest::WorldFactory;
use orchard_tasks::harvest::interface::BenchController;
use orchard_tasks::protocol::Protocol;
use orchard_world::World;
use std::hint::black_box;

use super::timing::{Rounds, cpu_time};
use orchard_program::rows::{Effort, Measured, Row};

/// Target times of depth and labels of a nominal tree, small and large image, and of the detector on the small one \[ms\].
const SMALL_MS: f64 = 1.5;
const LARGE_MS: f64 = 10.0;
const DETECTOR_MS: f64 = 2.0;

/// Cameras, detectors that are timed on their images, and the target time \[ms\].
const FIELD: [(&str, &str, Option<f64>); 10] = [
    (LARGE_PAPER, "paper", Some(30.0)),
    (LARGE_PAPER, "scored", Some(30.0)),
    ("azure-kinect-native", "azure-kinect-native", None),
    ("d435i", "d435i", Some(40.0)),
    (LARGE_PAPER, "learned", Some(30.0)),
    ("d435i", "learned", Some(40.0)),
    ("azure-kinect", "azure-kinect", Some(150.0)),
    ("azure-kinect", "learned", Some(150.0)),
    ("d435i", "learned-colour", Some(40.0)),
    ("azure-kinect", "learned-colour", Some(150.0)),
];
/// The paper's camera with the large image.
const LARGE_PAPER: &str = "paper";

/// Noise key of every image; its value does not affect the timing.
const KEY: ImageKey = ImageKey { seed: 0, world: 0, frame: 0 };

/// Columns and rows of the large image of the same view.
const LARGE: [u32; 2] = [640, 480];

/// Times of the images in a nominal episode \[s\]: at the start, on the way to the tree, among its branches. Multiples of
/// the camera's period.
const TIMES: [f64; 6] = [0.0, 2.0, 4.0, 8.0, 12.0, 20.0];

/// Amount of measurement.
struct Plan {
    rounds: usize,
    /// Images of a view per round.
    repeats: u32,
}

/// A world at the moment of an image, with its images.
struct View {
    world: World,
    scene: Scene,
    x_world_camera: Pose,
    /// The robot's shapes in the camera frame, without those completely behind it.
    links: Vec<(Shape, Pose)>,
    small: Capture,
    large: Capture,
    ignored: Image<bool>,
    /// Measured depth for each of the detectors, and colour for those that look at it.
    images: Vec<(DepthImage, Option<Image<[u8; 3]>>)>,
}

/// Work that is timed on a view, with its target time \[ms\].
struct Work<'a> {
    name: &'a str,
    target_ms: Option<f64>,
    /// Runs on a view per round.
    repeats: u32,
    run: Box<dyn Fn(&View) + 'a>,
}

fn work<'a>(name: &'a str, target_ms: Option<f64>, repeats: u32, run: impl Fn(&View) + 'a) -> Work<'a> {
    Work { name, target_ms, repeats, run: Box::new(run) }
}

/// A camera with a detector for its images.
struct Eye {
    /// Name of the row.
    name: String,
    sensor: Sensor,
    config: DetectorConfig,
    target_ms: Option<f64>,
}

/// The cameras and the detectors' configs.
struct Vision {
    small: Sensor,
    large: Sensor,
    stereo: Sensor,
    config: DetectorConfig,
    eyes: Vec<Eye>,
}

impl Vision {
    fn new() -> anyhow::Result<Self> {
        let spec = CameraSpec::named("paper").map_err(anyhow::Error::msg)?;
        let mut large = spec.clone();
        if let CameraSpec::Paper(camera) = &mut large {
            let view = &mut camera.view;
            for (count, pixels) in [&mut view.width, &mut view.height].into_iter().zip(LARGE) {
                *count = count.with_value(pixels).map_err(anyhow::Error::msg)?;
            }
        }
        let stereo = CameraSpec::named("d435i").map_err(anyhow::Error::msg)?;
        let eye = |(camera, detector, target_ms): (&str, &str, Option<f64>)| {
            let spec = CameraSpec::named(camera)?;
            let sensor = Sensor::new(if camera == LARGE_PAPER { &large } else { &spec });
            let config = orchard_scenario::detector(&OptionValue::new(detector, "perf"), camera);
            let Intrinsics { width, height, .. } = *sensor.intrinsics();
            let name = format!("detector.{camera}.{detector}.{width}x{height}");
            Ok(Eye { name, sensor, config: config.map_err(|e| e.to_string())?, target_ms })
        };
        let eyes = FIELD.into_iter().map(eye).collect::<Result<_, String>>().map_err(anyhow::Error::msg)?;
        let [small, large, stereo] = [&spec, &large, &stereo].map(Sensor::new);
        Ok(Self { small, large, stereo, config: DetectorConfig::paper(), eyes })
    }
}

/// Images of the wrist camera in nominal episodes of the tuning seeds: processor time each, averaged over the views.
pub fn measure(effort: Effort) -> anyhow::Result<Measured> {
    let plan = match effort {
        Effort::Full => Plan { rounds: 9, repeats: 10 },
        Effort::Quick => Plan { rounds: 3, repeats: 1 },
    };
    let vision = Vision::new()?;
    let bar = super::spinner();
    super::say(&bar, "driving the robot to the tree");
    let views = views(&vision)?;
    let image = |sensor: &Sensor, view: &View| {
        black_box(sensor.capture(&view.world.scene(), &view.x_world_camera, KEY));
    };
    let scene = |view: &View| {
        black_box(view.world.scene());
    };
    let fruit = |sensor: &Sensor, capture: &Capture, view: &View| {
        black_box(fruit_views(&capture.truth, &view.scene, sensor.intrinsics(), &view.x_world_camera));
    };
    let mut works = vec![
        work("camera.192x144", Some(SMALL_MS), plan.repeats, |view| image(&vision.small, view)),
        work("camera.640x480", Some(LARGE_MS), plan.repeats, |view| image(&vision.large, view)),
        work("camera.d435i.848x480", None, plan.repeats, |view| image(&vision.stereo, view)),
        work("camera.scene", None, plan.repeats, scene),
        work("camera.fruit_views.192x144", None, plan.repeats, |view| {
            fruit(&vision.small, &view.small, view)
        }),
        work("camera.fruit_views.640x480", None, plan.repeats, |view| {
            fruit(&vision.large, &view.large, view)
        }),
        work("mask.192x144", None, plan.repeats, |view| {
            black_box(ignored(&vision, view));
        }),
        work("detector.192x144", Some(DETECTOR_MS), plan.repeats, |view| {
            let depth = &view.small.measured;
            black_box(detect(depth, vision.small.intrinsics(), Some(&view.ignored), &vision.config).is_ok());
        }),
    ];
    works.extend(vision.eyes.iter().enumerate().map(|(i, eye)| {
        // One image takes long enough to be timed.
        work(&eye.name, eye.target_ms, 1, move |view| {
            let (depth, colour) = &view.images[i];
            let image = RgbdImage { depth, colour: colour.as_ref() };
            black_box(detect(image, eye.sensor.intrinsics(), None, &eye.config).is_ok());
        })
    }));
    super::say(&bar, "images and detections");
    let timed = time(&plan, &views, &works);
    bar.finish_and_clear();
    let row = |work: &Work<'_>, (rounds, slowest): &(Rounds, f64)| {
        let row = Row::measured(&format!("perception.{}", work.name), rounds.median(), "ms");
        let note = format!("mean over {} views; slowest view {slowest:.3} ms", views.len());
        let row = Row { spread: Some(rounds.spread()), note: Some(note), ..row };
        match work.target_ms {
            Some(target) => row.at_most(target),
            None => row,
        }
    };
    Ok(works.iter().zip(&timed).map(|(work, timed)| row(work, timed)).collect::<Vec<_>>().into())
}

/// The views: the baseline picker's own, on the first tree of each tuning seed.
fn views(vision: &Vision) -> anyhow::Result<Vec<View>> {
    let harvest = Harvest::new(Scenario::of(&[])?)?;
    let mut views = Vec::new();
    let protocol = Protocol::paper();
    let plan = harvest.plan("full", protocol.tuning_seeds.clone(), 1, protocol.full.horizon.si());
    for key in plan.episodes() {
        let seed = key.seed;
        let (mut world, mut picker) =
            harvest.build(&key).map_err(|reason| anyhow::anyhow!("seed {seed}: {reason}"))?;
        let rate = world.spec().sim.frame_rate.si();
        let frames = TIMES.map(|time| (time * rate).round() as u32);
        for frame in 0..=frames[TIMES.len() - 1] {
            let observation = world.observe();
            if frames.contains(&frame) {
                views.push(
                    view(vision, world.clone()).with_context(|| format!("seed {seed}, frame {frame}"))?,
                );
            }
            let command = picker.act(&observation);
            world.step(&command);
        }
    }
    Ok(views)
}

fn view(vision: &Vision, world: World) -> anyhow::Result<View> {
    let (scene, x_world_camera) = (world.scene(), world.x_world_camera());
    let x_camera_world = x_world_camera.inverse();
    let link = |item: &orchard_camera::Item| match &item.geometry {
        Geometry::Shape(shape) if item.label == Label::Robot => {
            Some((shape.clone(), x_camera_world * item.x_world_item))
        }
        _ => None,
    };
    let links = scene.items.iter().filter_map(link).filter(|(shape, x)| shape.aabb(x).max.z > 0.0).collect();
    let [small, large] =
        [&vision.small, &vision.large].map(|sensor| sensor.capture(&scene, &x_world_camera, KEY));
    anyhow::ensure!(small.measured.pixels().iter().any(|&z| z > 0.0), "the image has no valid depth");
    let none = Image::filled(0, 0, false);
    let studio = Studio::new(&scene, &PictureStyle::of_camera());
    let image = |eye: &Eye| {
        let depth = eye.sensor.capture(&scene, &x_world_camera, KEY).measured;
        let colour = || studio.picture(eye.sensor.intrinsics(), &x_world_camera);
        (depth, eye.config.sees_colour().then(colour))
    };
    let images = vision.eyes.iter().map(image).collect();
    drop(studio);
    let mut view = View { world, scene, x_world_camera, links, small, large, ignored: none, images };
    view.ignored = ignored(vision, &view);
    Ok(view)
}

/// The pixels of robot and ground, as the picker masks them.
fn ignored(vision: &Vision, view: &View) -> Image<bool> {
    let (depth, intrinsics, margins) = (&view.small.measured, vision.small.intrinsics(), &vision.config.mask);
    let mut ignored = mask::self_mask(depth, intrinsics, &view.links, margins.robot_margin.si());
    let up_camera = view.x_world_camera.rotation.inverse() * Vec3::z();
    let height = view.x_world_camera.translation.z;
    let ground = mask::ground_mask(depth, intrinsics, &up_camera, height, margins.ground_margin.si());
    mask::add(&mut ignored, &ground);
    ignored
}

/// Times each piece of work on all views, in turns: the mean over the views \[ms\] round by round, and the slowest view's
/// median \[ms\].
fn time(plan: &Plan, views: &[View], works: &[Work<'_>]) -> Vec<(Rounds, f64)> {
    // By work, view and round.
    let mut times = vec![vec![Vec::with_capacity(plan.rounds); views.len()]; works.len()];
    for _ in 0..plan.rounds {
        for (work, times) in works.iter().zip(&mut times) {
            for (view, times) in views.iter().zip(times) {
                let start = cpu_time();
                for _ in 0..work.repeats {
                    (work.run)(view);
                }
                times.push(1e3 * (cpu_time() - start).as_secs_f64() / f64::from(work.repeats));
            }
        }
    }
    let of_work = |times: Vec<Vec<f64>>| {
        let mean = |round| times.iter().map(|view| view[round]).sum::<f64>() / times.len() as f64;
        let rounds = Rounds::new((0..plan.rounds).map(mean).collect());
        (rounds, times.into_iter().map(|view| Rounds::new(view).median()).fold(0.0, f64::max))
    };
    times.into_iter().map(of_work).collect()
}
