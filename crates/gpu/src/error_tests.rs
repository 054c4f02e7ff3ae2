//! Errors of cameras on the device at hand against those of the processor.

use orchard_camera::{ImageKey, Scene, Sensor};
use orchard_geometry::{DepthImage, Pose};
use orchard_spec::camera::CameraSpec;
use orchard_spec::{Purpose, Stream};

use crate::direction::direction;
use crate::images::{ImageBatch, Look, Subject, View};
use crate::shapes::{rotation, shapes};
use crate::testing::device;

/// Cameras of small images whose rows begin at all places of a word, with windows, ramps and light of their own.
const CAMERAS: [&str; 4] = [
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
    for text in CAMERAS {
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
