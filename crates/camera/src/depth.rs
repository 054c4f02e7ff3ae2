//! Exact depth camera: a z-buffer over the screen rectangles of primitives.

use crate::primitive::{Hit, Primitive, for_each_primitive};
use crate::raster::Raster;
use crate::{Label, NO_INSTANCE, Scene};
use orchard_geometry::{DepthImage, Image, Intrinsics, Pose};

/// Upper bound of the relative rounding error of a depth, f32 included.
const ROUNDING: f64 = 1e-6;

/// Depth image with label and instance of every pixel.
///
/// A pixel without a valid depth (nothing there, nearer than `near`, beyond `far`) has depth 0, label
/// [`Label::None`] and instance [`NO_INSTANCE`].
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Depth along the optical axis \[m\], 0 where invalid.
    pub depth: DepthImage,
    /// Kind of the object that the pixel shows.
    pub label: Image<Label>,
    /// Index of the object among those of its label.
    pub instance: Image<u32>,
}

impl Frame {
    /// Makes an image without valid depths.
    pub fn new(width: usize, height: usize) -> Self {
        Self {
            depth: Image::filled(width, height, 0.0),
            label: Image::filled(width, height, Label::None),
            instance: Image::filled(width, height, NO_INSTANCE),
        }
    }
}

/// Renders the scene into `out`, which is resized to the intrinsics' size.
///
/// `x_world_camera` is the pose of the optical frame (x right, y down, z forward); depth is z in that frame.
/// A surface nearer than `near` \[m\] hides surfaces behind it and is invalid, as is one beyond `far` \[m\]. Of two surfaces at
/// the same depth the earlier item of the scene is visible.
pub fn render(
    scene: &Scene,
    intrinsics: &Intrinsics,
    x_world_camera: &Pose,
    near: f64,
    far: f64,
    out: &mut Frame,
) {
    let Intrinsics { width, height, .. } = *intrinsics;
    if (out.depth.width(), out.depth.height()) != (width, height) {
        *out = Frame::new(width, height);
    }
    rasterise(scene, intrinsics, x_world_camera, far, &mut out.depth, &mut out.instance);
    let shown: Vec<(Label, u32)> = scene.items.iter().map(|item| (item.label, item.instance)).collect();
    let pixels = out.depth.pixels_mut().iter_mut().zip(out.label.pixels_mut());
    for ((depth, label), instance) in pixels.zip(out.instance.pixels_mut()) {
        let z = f64::from(*depth);
        if *instance != NO_INSTANCE && z >= near && z <= far {
            (*label, *instance) = shown[*instance as usize];
        } else {
            (*depth, *label, *instance) = (0.0, Label::None, NO_INSTANCE);
        }
    }
}

/// Finds the nearest surface up to `far`: its depth (infinite if none) and the index of its item (or
/// [`NO_INSTANCE`]). Both images must have the intrinsics' size.
pub(crate) fn rasterise(
    scene: &Scene,
    intrinsics: &Intrinsics,
    x_world_camera: &Pose,
    far: f64,
    depth: &mut DepthImage,
    index: &mut Image<u32>,
) {
    depth.pixels_mut().fill(f32::INFINITY);
    index.pixels_mut().fill(NO_INSTANCE);
    let x_camera_world = x_world_camera.inverse();
    let raster = Raster::new(intrinsics, far);
    let within = raster.view();
    for (i, item) in (0_u32..).zip(&scene.items) {
        let mut canvas = Canvas { item: i, depth, index };
        for_each_primitive(item, &x_camera_world, &within, |primitive| match primitive {
            Primitive::Sphere(p) => canvas.draw(&raster, p),
            Primitive::Capsule(p) => canvas.draw(&raster, p),
            Primitive::Box(p) => canvas.draw(&raster, p),
            Primitive::Plane(p) => canvas.draw(&raster, p),
            Primitive::Triangle(p) => canvas.draw(&raster, p),
        });
    }
}

/// Z-buffer into which an item is drawn.
struct Canvas<'a> {
    item: u32,
    depth: &'a mut DepthImage,
    index: &'a mut Image<u32>,
}

impl Canvas<'_> {
    fn draw(&mut self, raster: &Raster, primitive: &impl Hit) {
        // Skip pixels whose depth is nearer than the whole primitive.
        let nearest = (primitive.depths().0 * (1.0 - ROUNDING)) as f32;
        for row in raster.rows(primitive) {
            let depths = self.depth.pixels_mut()[row.pixels.clone()].iter_mut();
            let items = self.index.pixels_mut()[row.pixels.clone()].iter_mut();
            for ((ray, depth), index) in row.rays().zip(depths).zip(items) {
                if *depth <= nearest {
                    continue;
                }
                if let Some(z) = primitive.hit(&ray) {
                    let z = z as f32;
                    if z < *depth {
                        (*depth, *index) = (z, self.item);
                    }
                }
            }
        }
    }
}
