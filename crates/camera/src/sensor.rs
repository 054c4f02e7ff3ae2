//! Depth cameras as a config describes them: what they see, and what they measure of it.

use crate::{Frame, Scene, render};
use orchard_geometry::{DepthImage, Intrinsics, Pose, math};
use orchard_spec::camera::{CameraSpec, ViewSpec};

/// A depth camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensor {
    spec: CameraSpec,
    intrinsics: Intrinsics,
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

    /// Its intrinsics.
    pub fn intrinsics(&self) -> &Intrinsics {
        &self.intrinsics
    }

    /// Takes an image; `x_world_camera` is the pose of the optical frame.
    pub fn capture(&self, scene: &Scene, x_world_camera: &Pose) -> Capture {
        let mut truth = Frame::new(self.intrinsics.width, self.intrinsics.height);
        let (near, far) = self.spec.range();
        render(scene, &self.intrinsics, x_world_camera, near, far, &mut truth);
        let measured = match &self.spec {
            CameraSpec::Ideal(_) | CameraSpec::Paper(_) => truth.depth.clone(),
        };
        Capture { measured, truth }
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
