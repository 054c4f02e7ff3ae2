//! The wrist camera of a world, and the truth behind its latest image.

use orchard_camera::{Frame, Scene, fruit_visibility, render};
use orchard_geometry::{Intrinsics, Pose};
use orchard_spec::camera::CameraSpec;

/// The truth behind one depth image.
#[derive(Debug, Clone)]
pub struct CameraTruth {
    /// Frame of the world in which it was taken.
    pub frame: u32,
    /// Depth, labels and instances.
    pub image: Frame,
    /// The scene that it shows.
    pub scene: Scene,
    /// Pose of the optical frame.
    pub x_world_camera: Pose,
    /// Visible pixels of each fruit, by fruit index.
    pub visible_px: Vec<u32>,
}

/// Intrinsics that the spec describes.
pub(crate) fn intrinsics(spec: &CameraSpec) -> Intrinsics {
    Intrinsics::from_vertical_fov(
        spec.width.get() as usize,
        spec.height.get() as usize,
        spec.vertical_fov.si(),
    )
}

/// Takes an image.
pub(crate) fn shoot(
    spec: &CameraSpec,
    intrinsics: &Intrinsics,
    scene: Scene,
    x_world_camera: Pose,
    frame: u32,
    fruit_count: usize,
) -> CameraTruth {
    let mut image = Frame::new(intrinsics.width, intrinsics.height);
    render(&scene, intrinsics, &x_world_camera, spec.near.si(), spec.far.si(), &mut image);
    let mut visible_px = vec![0; fruit_count];
    for v in fruit_visibility(&image, &scene, intrinsics, &x_world_camera) {
        visible_px[v.instance as usize] = v.visible_px;
    }
    CameraTruth { frame, image, scene, x_world_camera, visible_px }
}
