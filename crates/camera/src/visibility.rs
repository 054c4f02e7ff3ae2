//! Ground truth of visibility.

use crate::depth::rasterise;
use crate::{Frame, Label, NO_INSTANCE, Scene};
use orchard_geometry::{Image, Intrinsics, Pose};

/// How much of one fruit an image shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FruitVisibility {
    /// Instance of the fruit.
    pub instance: u32,
    /// Pixels that show it with a valid depth.
    pub visible_px: u32,
    /// Pixels that the fruit alone in the world would cover at any range, cut by the image's border.
    pub unoccluded_px: u32,
}

/// Visibility of every fruit of the scene, in scene order. `frame` is the image of that scene.
pub fn fruit_visibility(
    frame: &Frame,
    scene: &Scene,
    intrinsics: &Intrinsics,
    x_world_camera: &Pose,
) -> Vec<FruitVisibility> {
    let mut visible = std::collections::BTreeMap::new();
    for (label, instance) in frame.label.pixels().iter().zip(frame.instance.pixels()) {
        if *label == Label::Fruit {
            *visible.entry(*instance).or_insert(0) += 1;
        }
    }
    let mut depth = Image::filled(intrinsics.width, intrinsics.height, 0.0);
    let mut index = Image::filled(intrinsics.width, intrinsics.height, NO_INSTANCE);
    let mut alone = Scene { items: Vec::with_capacity(1) };
    let mut of = |fruit: &crate::Item| {
        alone.items.clear();
        alone.items.push(fruit.clone());
        rasterise(&alone, intrinsics, x_world_camera, f64::INFINITY, &mut depth, &mut index);
        FruitVisibility {
            instance: fruit.instance,
            visible_px: visible.get(&fruit.instance).copied().unwrap_or(0),
            unoccluded_px: index.pixels().iter().filter(|&&i| i != NO_INSTANCE).count() as u32,
        }
    };
    scene.items.iter().filter(|i| i.label == Label::Fruit).map(&mut of).collect()
}
