//! Errors of cameras on the device at hand against those of the processor.

use std::sync::Arc;

use orchard_camera::picture::look_at;
use orchard_camera::{ImageKey, Scene, Sensor};
use orchard_geometry::{DepthImage, Pose, Vec3};
use orchard_robot::RobotModel;
use orchard_spec::camera::CameraSpec;
use orchard_spec::{Preset, Purpose, Spec, Stream};
use orchard_world::World;

use crate::device::GpuError;
use crate::direction::direction;
use crate::images::{ImageBatch, Look, Subject, View};
use crate::shapes::{rotation, shapes};
use crate::testing::device;

/// Stereo cameras of small images whose rows begin at all places of a word, with windows, ramps and light of their own.
const STEREO: [&str; 4] = [
    "[d435i.view]
     width = { value = 203, range = [16, 8192], unit = 'px', source = 'test' }
     height = { value = 97, range = [16, 8192], unit = 'px', source = 'test' }",
    "[zed-mini]
     window_radius = { value = 7, range = [1, 15], unit = 'px', source = 'test' }
     edge_ramp = { value = 0, range = [0, 15], unit = 'px', source = 'test' }
     disparity_step = { value = 0.03, range = [0.0001, 1.0], unit = 'px', source = 'test' }
     dropout = { low = 0.3, high = 0.3, range = [0.0, 1.0], unit = '1', source = 'test' }
     [zed-mini.view]
     width = { value = 130, range = [16, 8192], unit = 'px', source = 'test' }
     height = { value = 71, range = [16, 8192], unit = 'px', source = 'test' }",
    "[d435i]
     window_radius = { value = 1, range = [1, 15], unit = 'px', source = 'test' }
     edge_ramp = { value = 5, range = [0, 15], unit = 'px', source = 'test' }
     dropout = { low = 0.0, high = 0.0, range = [0.0, 1.0], unit = '1', source = 'test' }
     [d435i.view]
     width = { value = 33, range = [16, 8192], unit = 'px', source = 'test' }
     height = { value = 64, range = [16, 8192], unit = 'px', source = 'test' }",
    "[d435i-aligned.view]
     width = { value = 231, range = [16, 8192], unit = 'px', source = 'test' }
     height = { value = 118, range = [16, 8192], unit = 'px', source = 'test' }
     [d435i-aligned.native]
     width = { value = 150, range = [16, 8192], unit = 'px', source = 'test' }
     height = { value = 80, range = [16, 8192], unit = 'px', source = 'test' }",
];
/// Cameras by time of flight, in the view of their imager and registered to another.
const TIME_OF_FLIGHT: [&str; 2] = [
    "[azure-kinect-native.view]
     width = { value = 150, range = [16, 8192], unit = 'px', source = 'test' }
     height = { value = 81, range = [16, 8192], unit = 'px', source = 'test' }",
    "[azure-kinect.view]
     width = { value = 241, range = [16, 8192], unit = 'px', source = 'test' }
     height = { value = 136, range = [16, 8192], unit = 'px', source = 'test' }
     [azure-kinect.native]
     width = { value = 101, range = [16, 8192], unit = 'px', source = 'test' }
     height = { value = 90, range = [16, 8192], unit = 'px', source = 'test' }",
];
/// Largest difference of a depth measured by time of flight, over the depth, and share of pixels in which one has a depth and the other none, or another surface's.
const ROUNDING: f32 = 1e-5;
const FEW: f64 = 1e-3;
/// Number of random shapes in a scene.
const SHAPES: u32 = 5;

fn sensor(text: &str) -> Sensor {
    Sensor::new(&CameraSpec::from_toml("camera.toml", text).unwrap())
}

fn looks<'a>(scenes: &'a [Scene], rng: &mut Stream) -> Vec<Look<'a>> {
    let look = |(i, scene)| Look {
        subject: Subject::Scene(scene),
        x_world_camera: Pose::from_parts((0.2 * direction(rng)).into(), rotation(rng)),
        key: ImageKey { seed: u64::MAX - 5, world: 3 + i as u32 % 2, frame: u32::MAX - i as u32 },
    };
    scenes.iter().enumerate().map(look).collect()
}

fn exact(batch: &mut ImageBatch, sensor: &Sensor, looks: &[Look<'_>]) -> Vec<DepthImage> {
    let exposures = looks.iter().map(|look| (look.subject, sensor.exposure(&look.x_world_camera)));
    let views: Vec<View<'_>> = exposures.map(|(subject, exposure)| View { subject, exposure }).collect();
    batch.depths(&views).unwrap()
}

/// From the same exact depths both make the same bits; more images than are measured at once, and one alone, have the same.
#[test]
fn errors_of_stereo_cameras_have_the_bits_of_the_processor() {
    let Some(gpu) = device() else { return };
    let mut rng = Stream::new(8, 0, Purpose::Test);
    let scenes: Vec<Scene> = (0..6).map(|_| shapes(&mut rng, SHAPES)).collect();
    let mut batch = ImageBatch::new(&gpu);
    for text in STEREO {
        let (sensor, looks) = (sensor(text), looks(&scenes, &mut rng));
        let seen = exact(&mut batch, &sensor, &looks);
        let measured = batch.measured(&sensor, &looks).unwrap();
        let mut valid = 0;
        for ((look, seen), measured) in looks.iter().zip(&seen).zip(&measured) {
            let here = sensor.measure(seen, look.key);
            valid += here.pixels().iter().filter(|z| **z > 0.0).count();
            let differ = here.pixels().iter().zip(measured.pixels()).filter(|(a, b)| a != b).count();
            assert_eq!(differ, 0, "of {}: {text}", here.pixels().len());
            assert_eq!((here.width(), here.height()), (measured.width(), measured.height()));
        }
        // Not of empty images.
        let pixels: usize = measured.iter().map(|image| image.pixels().len()).sum();
        assert!(valid * 5 > pixels, "{valid} of {pixels}: {text}");
        assert_eq!(batch.measured(&sensor, &looks[4..5]).unwrap(), measured[4..5]);
    }
}

/// The processor computes in f64, the device in f32: depths agree to some roundings, but for the few pixels at the limit of light, of mixing or of a triangle.
#[test]
fn errors_of_time_of_flight_are_those_of_the_processor() {
    let Some(gpu) = device() else { return };
    let mut rng = Stream::new(9, 0, Purpose::Test);
    let scenes: Vec<Scene> = (0..4).map(|_| shapes(&mut rng, SHAPES)).collect();
    let mut batch = ImageBatch::new(&gpu);
    for text in TIME_OF_FLIGHT {
        let (sensor, looks) = (sensor(text), looks(&scenes, &mut rng));
        let seen = exact(&mut batch, &sensor, &looks);
        let measured = batch.measured(&sensor, &looks).unwrap();
        let (mut valid, mut pixels, mut differ) = (0, 0, 0);
        for ((look, seen), measured) in looks.iter().zip(&seen).zip(&measured) {
            let here = sensor.measure(seen, look.key);
            assert_eq!((here.width(), here.height()), (measured.width(), measured.height()));
            pixels += here.pixels().len();
            valid += here.pixels().iter().filter(|z| **z > 0.0).count();
            differ += (here.pixels().iter().zip(measured.pixels()))
                .filter(|(a, b)| (*a - *b).abs() > ROUNDING * a.max(**b))
                .count();
        }
        assert!(valid * 5 > pixels, "{valid} of {pixels}: {text}");
        assert!(differ as f64 <= FEW * valid as f64, "{differ} of {valid}: {text}");
        assert_eq!(batch.measured(&sensor, &looks[2..3]).unwrap(), measured[2..3]);
    }
}

/// Every camera that comes with the program at its own size, before a tree: counts the pixels that differ, for the docs.
#[test]
#[ignore = "large images; prints a table"]
fn whole_images_of_every_camera() {
    let Some(gpu) = device() else { return };
    let world =
        World::new(Arc::new(Spec::preset(Preset::Paper)), Arc::new(RobotModel::paper()), 4, 0).unwrap();
    let scene = world.scene();
    let eyes = [[-0.7, 0.2, 1.1], [0.9, -0.4, 1.6]];
    let looks: Vec<Look<'_>> = (eyes.iter().zip(0..))
        .map(|(eye, frame)| Look {
            subject: Subject::Scene(&scene),
            x_world_camera: look_at(&(*eye).into(), &Vec3::new(0.0, 0.0, 1.0)),
            key: ImageKey { seed: 20_250_704, world: 0, frame },
        })
        .collect();
    let mut batch = ImageBatch::new(&gpu);
    println!(
        "{}\n| camera | pixels | have a depth | differ | by more than {ROUNDING} | have a depth in one only |",
        gpu.info().name
    );
    for (name, _) in CameraSpec::FILES {
        let sensor = Sensor::new(&CameraSpec::named(name).unwrap());
        let seen = exact(&mut batch, &sensor, &looks);
        let measured = batch.measured(&sensor, &looks).unwrap();
        let here = looks.iter().zip(&seen).map(|(look, seen)| sensor.measure(seen, look.key));
        let (mut valid, mut pixels, mut differ, mut far, mut one) = (0, 0, 0, 0, 0);
        for (here, measured) in here.zip(&measured) {
            for (a, b) in here.pixels().iter().zip(measured.pixels()) {
                pixels += 1;
                valid += usize::from(*a > 0.0);
                differ += usize::from(a != b);
                far += usize::from((a - b).abs() > ROUNDING * a.max(*b));
                one += usize::from((*a > 0.0) != (*b > 0.0));
            }
        }
        println!("| {name} | {pixels} | {valid} | {differ} | {far} | {one} |");
    }
}

/// All cameras that come with the program have kernels. Others are refused by name.
#[test]
fn cameras_without_kernels_are_refused() {
    for (name, _) in CameraSpec::FILES {
        assert!(ImageBatch::can_measure(&Sensor::new(&CameraSpec::named(name).unwrap())), "{name}");
    }
    let wide = "[d435i]\nwindow_radius = { value = 8, range = [1, 15], unit = 'px', source = 'test' }";
    let rectangles =
        "[azure-kinect.native]\nbridge = { value = 0, range = [0, 1000], unit = 'mm', source = 'test' }";
    for text in [wide, rectangles] {
        assert!(!ImageBatch::can_measure(&sensor(text)), "{text}");
    }
    let Some(gpu) = device() else { return };
    let refused = ImageBatch::new(&gpu).measured(&sensor(wide), &[]).unwrap_err();
    assert_eq!(refused, GpuError::NoKernels { camera: "d435i" });
}
