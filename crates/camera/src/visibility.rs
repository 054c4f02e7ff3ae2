//! Ground truth of visibility.

use crate::{Frame, Label, Scene};
use orchard_geometry::{Intrinsics, Pose};

/// How much of one fruit an image shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FruitVisibility {
    /// Instance of the fruit.
    pub instance: u32,
    /// Pixels that show it.
    pub visible_px: u32,
    /// Pixels that would show it if it hung alone within range, cut by the image border only.
    pub unoccluded_px: u32,
}

/// Visibility of every fruit of the scene, in scene order.
pub fn fruit_visibility(
    frame: &Frame,
    scene: &Scene,
    _intrinsics: &Intrinsics,
    _x_world_camera: &Pose,
) -> Vec<FruitVisibility> {
    let visible = |instance: u32| {
        let labels = frame.label.pixels().iter().zip(frame.instance.pixels());
        labels.filter(|&(&l, &i)| l == Label::Fruit && i == instance).count() as u32
    };
    let fruit = scene.items.iter().filter(|i| i.label == Label::Fruit);
    fruit
        .map(|i| FruitVisibility { instance: i.instance, visible_px: visible(i.instance), unoccluded_px: 0 })
        .collect()
}
