//! Ground truth of fruit in an image.

use crate::primitive::{Hit, Sphere};
use crate::raster::{Raster, Row};
use crate::{Frame, Geometry, Item, Label, Scene};
use orchard_geometry::{Intrinsics, Pose, Shape, Vec3, inverse_transform};

/// One fruit in one image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FruitView {
    /// Instance of the fruit.
    pub instance: u32,
    /// Number of pixels that show it with a valid depth.
    pub visible_px: u32,
    /// Number of pixels within the image that the fruit would cover if nothing else existed, at any range.
    pub unoccluded_px: u32,
    /// Smallest box around the pixels that show it.
    pub visible_box: Option<PixelBox>,
    /// Centre in the camera frame \[m\].
    pub p_camera: Vec3,
    /// Radius \[m\].
    pub radius: f64,
}

/// A box of pixels, both ends included.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PixelBox {
    /// First and last column.
    pub u: (usize, usize),
    /// First and last row.
    pub v: (usize, usize),
}

impl PixelBox {
    fn around(self, u: usize, v: usize) -> Self {
        Self { u: (self.u.0.min(u), self.u.1.max(u)), v: (self.v.0.min(v), self.v.1.max(v)) }
    }
}

impl FruitView {
    /// Visible pixels over unoccluded pixels; 0 if the fruit is out of view.
    pub fn visible_fraction(&self) -> f64 {
        f64::from(self.visible_px) / f64::from(self.unoccluded_px.max(1))
    }
}

/// Returns the view of every fruit (a ball labelled [`Label::Fruit`]) in scene order. `frame` is the image of that scene.
pub fn fruit_views(
    frame: &Frame,
    scene: &Scene,
    intrinsics: &Intrinsics,
    x_world_camera: &Pose,
) -> Vec<FruitView> {
    let mut visible = std::collections::BTreeMap::new();
    let width = intrinsics.width.max(1);
    for (i, (label, instance)) in frame.label.pixels().iter().zip(frame.instance.pixels()).enumerate() {
        if *label == Label::Fruit {
            let (u, v) = (i % width, i / width);
            let (count, bounds) = visible.entry(*instance).or_insert((0, PixelBox { u: (u, u), v: (v, v) }));
            (*count, *bounds) = (*count + 1, bounds.around(u, v));
        }
    }
    let x_camera_world = x_world_camera.inverse();
    let raster = Raster::new(intrinsics, f64::INFINITY);
    let view = |fruit: &Item, radius: f64| {
        let seen = visible.get(&fruit.instance);
        let ball = Sphere::new((x_camera_world * fruit.x_world_item).translation.vector, radius);
        let in_row = |row: Row<'_>| row.rays().filter(|ray| ball.hit(ray).is_some()).count() as u32;
        FruitView {
            instance: fruit.instance,
            visible_px: seen.map_or(0, |(count, _)| *count),
            unoccluded_px: raster.rows(&ball).map(in_row).sum(),
            visible_box: seen.map(|(_, bounds)| *bounds),
            p_camera: inverse_transform(x_world_camera, &fruit.x_world_item.translation.vector),
            radius,
        }
    };
    let fruit = scene.items.iter().filter(|item| item.label == Label::Fruit);
    let views = fruit.filter_map(|item| match item.geometry {
        Geometry::Shape(Shape::Sphere { radius }) => Some(view(item, radius)),
        _ => None,
    });
    views.collect()
}
