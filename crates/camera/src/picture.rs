//! Pictures of a scene for people: sun with shadow, sky light with ambient occlusion, supersampling.
//!
//! Colour here is linear light until the last step; nothing in it is a photometric model.

mod false_color;
mod light;
mod material;
mod noise;

pub use false_color::{depth_picture, depth_picture_enlarged};

use crate::depth::rasterise;
use crate::primitive::{Primitive, for_each_primitive};
use crate::{Geometry, Item, NO_INSTANCE, Scene};
use light::Lighting;
use material::Palette;
use orchard_geometry::{DepthImage, Image, Intrinsics, Pose, Shape, Vec3, math};

/// Light and image quality of a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PictureStyle {
    /// Direction towards the sun, world, unit.
    pub sun_world: Vec3,
    /// Samples a pixel side: 3 draws 9 samples a pixel.
    pub supersampling: usize,
    /// Distance over which haze takes 63 % of the contrast [m].
    pub haze_length: f64,
}

impl Default for PictureStyle {
    fn default() -> Self {
        Self { sun_world: Vec3::new(-0.45, -0.50, 0.74).normalize(), supersampling: 3, haze_length: 120.0 }
    }
}

/// What a ray of the picture meets.
#[derive(Debug, Clone, Copy)]
struct Surface {
    p_world: Vec3,
    /// Unit normal on the viewer's side.
    n_world: Vec3,
    /// Whether that is the side that the geometry calls outer (a blade's upper face).
    outer_side: bool,
    /// Unit direction from the viewer.
    view_world: Vec3,
}

/// A colour picture of the scene (sRGB), seen through a pinhole camera.
pub fn picture(
    scene: &Scene,
    intrinsics: &Intrinsics,
    x_world_camera: &Pose,
    style: &PictureStyle,
) -> Image<[u8; 3]> {
    let side = style.supersampling.max(1);
    let fine = supersampled(intrinsics, side);
    let mut depth = DepthImage::filled(fine.width, fine.height, 0.0);
    let mut index = Image::filled(fine.width, fine.height, NO_INSTANCE);
    rasterise(scene, &fine, x_world_camera, f64::INFINITY, &mut depth, &mut index);
    let lighting = Lighting::new(scene, &style.sun_world);
    let palette = Palette::new();
    let x_camera_world = x_world_camera.inverse();
    let primitives_of = |item, within: &[Vec3]| {
        let mut all: Vec<Primitive> = Vec::new();
        for_each_primitive(item, &x_camera_world, within, |p| all.push(*p));
        all
    };
    // Terrain has too many to try: of it only those at the place in question are taken.
    let is_terrain = |item: &Item| matches!(item.geometry, Geometry::Shape(Shape::HeightField(_)));
    let listed = |item| if is_terrain(item) { Vec::new() } else { primitives_of(item, &[]) };
    let primitives: Vec<_> = scene.items.iter().map(listed).collect();
    let surface_at = |index: usize, ray: &Vec3, z: f64| {
        let rounding = 2.0 * f64::from(f32::EPSILON);
        let ends = [ray * (z * (1.0 - rounding)), ray * (z * (1.0 + rounding))];
        let here = is_terrain(&scene.items[index]).then(|| primitives_of(&scene.items[index], &ends));
        let candidates = here.as_ref().unwrap_or(&primitives[index]);
        let hits = candidates.iter().filter_map(|p| p.hit_with_normal(ray));
        hits.min_by(|a, b| a.0.total_cmp(&b.0))
    };
    let samples = side * side;
    let sample = |u: usize, v: usize, k: usize| -> Vec3 {
        let ray = fine.ray(u as f64, v as f64);
        let view_world = (x_world_camera.rotation * ray).normalize();
        let sky = lighting.sky(&view_world);
        let item = index[(u, v)];
        if item == NO_INSTANCE {
            return sky;
        }
        let Some((z, normal)) = surface_at(item as usize, &ray, f64::from(depth[(u, v)])) else {
            return sky;
        };
        let outer_side = normal.dot(&ray) < 0.0;
        let facing = if outer_side { normal } else { -normal };
        let surface = Surface {
            p_world: orchard_geometry::transform(x_world_camera, &(ray * z)),
            n_world: (x_world_camera.rotation * facing).normalize(),
            outer_side,
            view_world,
        };
        let material = palette.material(&scene.items[item as usize], &surface);
        let color = lighting.shade(&surface, &material, (k, samples));
        // Haze: distance blends into the horizon.
        let clear = math::exp(-z * ray.norm() / style.haze_length);
        color * clear + lighting.horizon() * (1.0 - clear)
    };
    let pixel = |i: usize| {
        let (u, v) = (i % intrinsics.width, i / intrinsics.width);
        let mut sum = Vec3::zeros();
        for k in 0..samples {
            // Each sample is brought to display range first, so that edges of bright things stay smooth.
            sum += sample(u * side + k % side, v * side + k / side, k).map(display);
        }
        let mean = sum / samples as f64;
        [0, 1, 2].map(|k| (255.0 * mean[k]).round() as u8)
    };
    let pixels = (0..intrinsics.width * intrinsics.height).map(pixel).collect();
    Image::from_pixels(intrinsics.width, intrinsics.height, pixels)
        .unwrap_or_else(|| Image::filled(intrinsics.width, intrinsics.height, [0; 3]))
}

/// The intrinsics of the same view with `side` x `side` samples a pixel.
fn supersampled(k: &Intrinsics, side: usize) -> Intrinsics {
    let s = side as f64;
    Intrinsics {
        width: k.width * side,
        height: k.height * side,
        fx: k.fx * s,
        fy: k.fy * s,
        cx: s * (k.cx + 0.5) - 0.5,
        cy: s * (k.cy + 0.5) - 0.5,
    }
}

/// Linear light to an sRGB value, 0 to 1: a filmic curve with a little toe and a soft shoulder.
fn display(linear: f64) -> f64 {
    let x = EXPOSURE * linear.max(0.0);
    // Rational, 0 at 0, slope rising from its toe, 1 at infinity.
    let y = x * (x + TOE) / (x * (x + SHOULDER) + SHOULDER * TOE);
    if y <= 0.003_130_8 { 12.92 * y } else { 1.055 * math::pow(y, 1.0 / 2.4) - 0.055 }
}

/// Brightness of a picture.
const EXPOSURE: f64 = 1.1;
/// Shape of the display curve.
const TOE: f64 = 0.3;
const SHOULDER: f64 = 0.9;

/// Pose of a camera at `p_world` that looks at `target_world`, image up towards world up.
pub fn look_at(p_world: &Vec3, target_world: &Vec3) -> Pose {
    let z = (target_world - p_world).try_normalize(0.0).unwrap_or_else(Vec3::x);
    // Straight up or down has no horizon: then image right is world x.
    let x = z.cross(&Vec3::z()).try_normalize(1e-9).unwrap_or_else(Vec3::x);
    let axes = nalgebra::Matrix3::from_columns(&[x, z.cross(&x), z]);
    let rotation = nalgebra::Rotation3::from_matrix_unchecked(axes);
    Pose::from_parts((*p_world).into(), nalgebra::UnitQuaternion::from_rotation_matrix(&rotation))
}
