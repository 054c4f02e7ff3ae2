//! Depth cameras with the view and the errors of a config.

mod noise;
mod stereo;
mod window;

use crate::{Frame, Label, NO_INSTANCE, Scene, render};
use orchard_geometry::{DepthImage, Intrinsics, Pose, math};
use orchard_spec::camera::{CameraSpec, ViewSpec};

/// A depth camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensor {
    spec: CameraSpec,
    intrinsics: Intrinsics,
}

/// Key of an image's noise: two images with the same key and scene have the same bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ImageKey {
    /// Seed of the population.
    pub seed: u64,
    /// Index of the world under its seed.
    pub world: u32,
    /// Frame in which the image is taken, or its number among the images of a world.
    pub frame: u32,
}

/// One image: the measured depth and the truth.
#[derive(Debug, Clone, PartialEq)]
pub struct Capture {
    /// Measured depth along the optical axis \[m\], 0 without a measurement.
    pub measured: DepthImage,
    /// True depth, label and instance of every pixel within the camera's range.
    pub truth: Frame,
}

impl Sensor {
    /// Makes the camera of a spec.
    pub fn new(spec: &CameraSpec) -> Self {
        Self { spec: spec.clone(), intrinsics: intrinsics(spec.view()) }
    }

    /// Replaces the intrinsics.
    #[must_use]
    pub fn with_intrinsics(self, intrinsics: Intrinsics) -> Self {
        Self { intrinsics, ..self }
    }

    /// Intrinsics of the camera.
    pub fn intrinsics(&self) -> &Intrinsics {
        &self.intrinsics
    }

    /// Takes an image; `x_world_camera` is the pose of the optical frame.
    pub fn capture(&self, scene: &Scene, x_world_camera: &Pose, key: ImageKey) -> Capture {
        let mut truth = Frame::new(self.intrinsics.width, self.intrinsics.height);
        let range = self.spec.range();
        let mut draw =
            |(near, far): (f64, f64)| render(scene, &self.intrinsics, x_world_camera, near, far, &mut truth);
        let measured = match &self.spec {
            CameraSpec::Ideal(_) | CameraSpec::Paper(_) => {
                draw(range);
                truth.depth.clone()
            }
            // Surfaces out of range still hide others and give windows texture to match.
            CameraSpec::D435i(spec) => {
                draw((0.0, f64::INFINITY));
                let measured = stereo::measure(spec, self.intrinsics.fx, &truth.depth, key);
                keep_range(&mut truth, range);
                measured
            }
        };
        Capture { measured, truth }
    }
}

/// Invalidates pixels nearer or farther than a range \[m\].
fn keep_range(frame: &mut Frame, (near, far): (f64, f64)) {
    let pixels = frame.depth.pixels_mut().iter_mut().zip(frame.label.pixels_mut());
    for ((depth, label), instance) in pixels.zip(frame.instance.pixels_mut()) {
        if !(near..=far).contains(&f64::from(*depth)) {
            (*depth, *label, *instance) = (0.0, Label::None, NO_INSTANCE);
        }
    }
}

/// Pinhole intrinsics of a view: f = n / (2 tan(fov / 2)), the axis in the middle of the image.
fn intrinsics(view: &ViewSpec) -> Intrinsics {
    let (width, height) = (view.width.get() as usize, view.height.get() as usize);
    let square = Intrinsics::from_vertical_fov(width, height, view.vertical_fov.si());
    match &view.horizontal_fov {
        None => square,
        Some(fov) => Intrinsics { fx: 0.5 * width as f64 / math::tan(0.5 * fov.si()), ..square },
    }
}
