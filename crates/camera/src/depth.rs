//! The depth camera: a z-buffer over the screen rectangles of exact primitives.

use crate::primitive::{Hit, Primitive, for_each_primitive};
use crate::{Label, NO_INSTANCE, Scene};
use orchard_geometry::{DepthImage, Image, Intrinsics, Pose, Vec3};

/// Depth with its truth, pixel for pixel.
///
/// A pixel without a valid depth (nothing there, nearer than `near`, beyond `far`) has depth 0, label
/// [`Label::None`] and instance [`NO_INSTANCE`].
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Depth along the optical axis [m], 0 where invalid.
    pub depth: DepthImage,
    /// What the pixel shows.
    pub label: Image<Label>,
    /// Which one of its label.
    pub instance: Image<u32>,
}

impl Frame {
    /// An image of nothing.
    pub fn new(width: usize, height: usize) -> Self {
        Self {
            depth: Image::filled(width, height, 0.0),
            label: Image::filled(width, height, Label::None),
            instance: Image::filled(width, height, NO_INSTANCE),
        }
    }
}

/// Renders the scene into `out`, which takes the intrinsics' size.
///
/// `x_world_camera` is the pose of the optical frame (x right, y down, z forward); depth is z in that frame.
/// A surface nearer than `near` [m] hides what lies behind it and reads as invalid. Of two surfaces at the
/// same depth the earlier item shows.
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
    let pixels = out.depth.pixels_mut().iter_mut().zip(out.label.pixels_mut());
    for ((depth, label), instance) in pixels.zip(out.instance.pixels_mut()) {
        let z = f64::from(*depth);
        if *instance != NO_INSTANCE && z >= near && z <= far {
            let item = &scene.items[*instance as usize];
            (*label, *instance) = (item.label, item.instance);
        } else {
            (*depth, *label, *instance) = (0.0, Label::None, NO_INSTANCE);
        }
    }
}

/// The nearest surface up to `far`: its depth (infinite if none) and the index of its item (or
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
    let view = view(intrinsics, far);
    for (i, item) in (0_u32..).zip(&scene.items) {
        for_each_primitive(item, &x_camera_world, &view, |primitive| match primitive {
            Primitive::Sphere(p) => scan(p, i, intrinsics, far, depth, index),
            Primitive::Capsule(p) => scan(p, i, intrinsics, far, depth, index),
            Primitive::Box(p) => scan(p, i, intrinsics, far, depth, index),
            Primitive::Plane(p) => scan(p, i, intrinsics, far, depth, index),
            Primitive::Triangle(p) => scan(p, i, intrinsics, far, depth, index),
        });
    }
}

/// The camera and the corners of its view at depth `far`: their convex hull holds all that a ray can meet up to there.
/// No points where `far` is infinite.
fn view(intrinsics: &Intrinsics, far: f64) -> Vec<Vec3> {
    // A depth is rounded to f32 before it is held against `far`.
    let end = far * (1.0 + f64::from(f32::EPSILON));
    if !end.is_finite() {
        return Vec::new();
    }
    let (right, bottom) = (intrinsics.width as f64, intrinsics.height as f64);
    let corners = [(-1.0, -1.0), (right, -1.0), (-1.0, bottom), (right, bottom)];
    let rays = corners.map(|(u, v)| intrinsics.ray(u, v) * end);
    rays.into_iter().chain([Vec3::zeros()]).collect()
}

/// Draws one primitive into the z-buffer.
fn scan(
    primitive: &impl Hit,
    item: u32,
    intrinsics: &Intrinsics,
    far: f64,
    depth: &mut DepthImage,
    index: &mut Image<u32>,
) {
    let bounds = primitive.bounds();
    if bounds.z.1 <= 0.0 || bounds.z.0 > far {
        return;
    }
    let Some(rect) = bounds.pixels(intrinsics) else { return };
    let width = intrinsics.width;
    for v in rect.v.0..=rect.v.1 {
        let row = v * width + rect.u.0..=v * width + rect.u.1;
        let depths = depth.pixels_mut()[row.clone()].iter_mut();
        let items = index.pixels_mut()[row].iter_mut();
        for ((u, depth), index) in (rect.u.0..).zip(depths).zip(items) {
            if let Some(z) = primitive.hit(&intrinsics.ray(u as f64, v as f64)) {
                let z = z as f32;
                if z < *depth {
                    (*depth, *index) = (z, item);
                }
            }
        }
    }
}
