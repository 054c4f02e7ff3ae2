//! Images of the stereo camera follow the law of `docs/computation/sensor.md`.

mod edges;
mod missing;
mod walls;

use orchard_camera::{Capture, Geometry, ImageKey, Label, Scene, Sensor};
use orchard_geometry::{Pose, Shape, Vec3};
use orchard_spec::camera::{CameraSpec, StereoSpec};

/// A d435i with some figures changed.
struct Camera {
    sensor: Sensor,
    spec: StereoSpec,
    /// Focal length times baseline [m px].
    focal_baseline: f64,
}

impl Camera {
    /// `figures`: field, value and unit of each that differs.
    fn new(figures: &[(&str, f64, &str)]) -> Self {
        let mut text = "[d435i]\n".to_owned();
        for (field, value, unit) in figures {
            text += &format!(
                "{field} = {{ value = {value}, range = [0, 10000], unit = '{unit}', source = 'x' }}\n"
            );
        }
        Self::from_toml(&text)
    }

    fn from_toml(text: &str) -> Self {
        let camera = CameraSpec::from_toml("test", text).unwrap();
        let CameraSpec::D435i(spec) = &camera else { panic!("another camera") };
        let sensor = Sensor::new(&camera);
        let focal_baseline = sensor.intrinsics().fx * spec.baseline.si();
        Self { spec: (**spec).clone(), sensor, focal_baseline }
    }

    fn take(&self, scene: &Scene, frame: u32) -> Capture {
        self.sensor.capture(scene, &Pose::identity(), ImageKey { seed: 20_250_704, world: 0, frame })
    }

    /// Disparity at a depth \[px\].
    fn disparity(&self, z: f64) -> f64 {
        self.focal_baseline / z
    }

    fn window(&self) -> usize {
        2 * self.spec.window_radius.get() as usize + 1
    }

    /// A wall at depth `z` that covers the columns `columns`, ends included, and all rows.
    fn wall(&self, scene: &mut Scene, z: f64, columns: std::ops::RangeInclusive<usize>) {
        const THICKNESS: f64 = 0.001;
        let k = self.sensor.intrinsics();
        let x = |u: f64| (u - k.cx) / k.fx * z;
        let (left, right) = (x(*columns.start() as f64 - 0.5), x(*columns.end() as f64 + 0.5));
        let height = k.height as f64 / k.fy * z;
        let half = Vec3::new(0.5 * (right - left), height, 0.5 * THICKNESS);
        let centre = Pose::translation(0.5 * (right + left), 0.0, z + half.z);
        scene.push(Geometry::Shape(Shape::Box { half }), centre, Label::Scenery, 0);
    }

    /// A scene of one wall that fills the image.
    fn whole_wall(&self, z: f64) -> Scene {
        let mut scene = Scene::default();
        self.wall(&mut scene, z, 0..=self.sensor.intrinsics().width - 1);
        scene
    }
}

/// In the shade nothing is dropped.
const NO_DROPOUT: (&str, f64, &str) = ("sunlight", 0.0, "1");

#[test]
fn an_image_is_a_function_of_its_key() {
    let camera = Camera::new(&[]);
    let scene = camera.whole_wall(1.0);
    let take = |seed, world, frame| {
        camera.sensor.capture(&scene, &Pose::identity(), ImageKey { seed, world, frame }).measured
    };
    let first = take(1, 2, 3);
    assert_eq!(first, take(1, 2, 3));
    for other in [take(2, 2, 3), take(1, 1, 3), take(1, 2, 4), take(1, 3, 2)] {
        assert_ne!(first, other);
    }
}

#[test]
fn the_other_cameras_measure_the_truth() {
    for name in ["ideal", "paper"] {
        let sensor = Sensor::new(&CameraSpec::named(name).unwrap());
        let scene = Camera::new(&[]).whole_wall(1.0);
        let images = [0, 1].map(|frame| {
            sensor.capture(&scene, &Pose::identity(), ImageKey { seed: frame, world: 0, frame: frame as u32 })
        });
        assert_eq!(images[0], images[1]);
        assert_eq!(images[0].measured, images[0].truth.depth);
        assert!(images[0].measured.pixels().iter().any(|&z| z > 0.0));
    }
}

/// Noise is part of results: the same bits on every platform and in every version.
#[test]
fn golden_values() {
    let camera = Camera::new(&[]);
    let measured = camera.take(&camera.whole_wall(1.3), 7).measured;
    let mix = |hash: u64, z: &f32| hash.wrapping_mul(31).wrapping_add(u64::from(z.to_bits()));
    assert_eq!(measured.pixels().iter().fold(0, mix), GOLDEN);
}
const GOLDEN: u64 = 17_422_816_547_795_529_313;
