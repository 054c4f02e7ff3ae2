//! What a world's wrist camera took, and the truth behind it.

use orchard_camera::{Capture, FruitView, Scene, Sensor, fruit_views};
use orchard_geometry::Pose;

/// One image of the wrist camera with the truth behind it.
#[derive(Debug, Clone)]
pub struct CameraTruth {
    /// Frame of the world in which it was taken.
    pub frame: u32,
    /// What was measured, and depth, labels and instances as they were.
    pub capture: Capture,
    /// The scene that it shows.
    pub scene: Scene,
    /// Pose of the optical frame.
    pub x_world_camera: Pose,
    /// What it shows of each fruit, by fruit index.
    pub fruit: Vec<FruitView>,
}

impl CameraTruth {
    /// Takes an image.
    pub(crate) fn take(sensor: &Sensor, scene: Scene, x_world_camera: Pose, frame: u32) -> Self {
        let capture = sensor.capture(&scene, &x_world_camera);
        let fruit = fruit_views(&capture.truth, &scene, sensor.intrinsics(), &x_world_camera);
        Self { frame, capture, scene, x_world_camera, fruit }
    }
}
