//! Exact depth camera: a z-buffer over the screen rectangles of primitives.

use crate::primitive::{Hit, Primitive, for_each_primitive};
use crate::raster::Raster;
use crate::{Item, Label, NO_INSTANCE, Scene};
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
    out.instance.pixels_mut().fill(NO_INSTANCE);
    let item = |item, _| item;
    rasterise(&scene.items, intrinsics, x_world_camera, far, &mut out.depth, &mut out.instance, item);
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

/// Finds the nearest surface up to `far`: its depth (infinite if none), and a mark made of the indices of its item and of the primitive among
/// those of the item. Marks of pixels without a surface stay as they are. Both images must have the intrinsics' size.
pub(crate) fn rasterise<'a, M: Copy>(
    items: impl IntoIterator<Item = &'a Item>,
    intrinsics: &Intrinsics,
    x_world_camera: &Pose,
    far: f64,
    depth: &mut DepthImage,
    marks: &mut Image<M>,
    mark: impl Fn(u32, u32) -> M,
) {
    depth.pixels_mut().fill(f32::INFINITY);
    let x_camera_world = x_world_camera.inverse();
    let raster = Raster::new(intrinsics, far);
    let within = raster.view();
    for (i, item) in (0_u32..).zip(items) {
        let mut parts = 0_u32..;
        for_each_primitive(item, &x_camera_world, &within, |primitive| {
            let mark = mark(i, parts.next().unwrap_or(u32::MAX));
            let mut canvas = Canvas { mark, depth, marks };
            match primitive {
                Primitive::Sphere(p) => canvas.draw(&raster, p),
                Primitive::Capsule(p) => canvas.draw(&raster, p),
                Primitive::Box(p) => canvas.draw(&raster, p),
                Primitive::Plane(p) => canvas.draw(&raster, p),
                Primitive::Triangle(p) => canvas.draw(&raster, p),
            }
        });
    }
}

/// Z-buffer into which a primitive is drawn.
struct Canvas<'a, M> {
    mark: M,
    depth: &'a mut DepthImage,
    marks: &'a mut Image<M>,
}

impl<M: Copy> Canvas<'_, M> {
    fn draw(&mut self, raster: &Raster, primitive: &impl Hit) {
        // Skip pixels whose depth is nearer than the whole primitive.
        let nearest = (primitive.depths().0 * (1.0 - ROUNDING)) as f32;
        for row in raster.rows(primitive) {
            let depths = self.depth.pixels_mut()[row.pixels.clone()].iter_mut();
            let marks = self.marks.pixels_mut()[row.pixels.clone()].iter_mut();
            for ((ray, depth), mark) in row.rays().zip(depths).zip(marks) {
                if *depth <= nearest {
                    continue;
                }
                if let Some(z) = primitive.hit(&ray) {
                    let z = z as f32;
                    if z < *depth {
                        (*depth, *mark) = (z, self.mark);
                    }
                }
            }
        }
    }
}
