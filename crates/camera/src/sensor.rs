//! Depth cameras as a config describes them: what they see, and what they measure of it.

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

/// Which image it is. Its noise is a function of this alone: the same image taken twice has the same bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ImageKey {
    /// Seed of the population.
    pub seed: u64,
    /// Index of the world under its seed.
    pub world: u32,
    /// Frame in which the image is taken, or its number among the images of a world.
    pub frame: u32,
}

/// One image: what the camera measured, and the truth behind it.
#[derive(Debug, Clone, PartialEq)]
pub struct Capture {
    /// What the camera delivers: depth along the optical axis [m], 0 where it measured nothing.
    pub measured: DepthImage,
    /// What stands before it, pixel by pixel, within its range.
    pub truth: Frame,
}

impl Sensor {
    /// The camera that a spec describes.
    pub fn new(spec: &CameraSpec) -> Self {
        Self { spec: spec.clone(), intrinsics: intrinsics(spec.view()) }
    }

    /// The same camera with another pinhole.
    #[must_use]
    pub fn with_intrinsics(self, intrinsics: Intrinsics) -> Self {
        Self { intrinsics, ..self }
    }

    /// Its intrinsics.
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
            // What is out of range still hides other things and gives windows something to match.
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

/// Takes out of an image what is nearer or farther than a range [m].
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
