//! Colour pictures of a scene: sun with shadow, sky light with ambient occlusion, supersampling.
//!
//! Colour is linear light until the last step; it is no photometric model. The style sets the light: direction and
//! strength of the sun, and cloud cover.

mod false_color;
pub mod figures;
mod light;
mod material;
mod noise;
pub mod recipe;

pub use false_color::{
    ColouredCircle, depth_colour, depth_picture, depth_picture_enlarged, depth_picture_in_range, draw_circles,
};

use crate::depth::rasterise;
use crate::primitive::{Primitive, for_each_primitive};
use crate::{Geometry, Item, Scene};
use figures::{EXPOSURE, SHOULDER, TOE};
use light::Lighting;
use material::Palette;
use orchard_geometry::{DepthImage, Image, Intrinsics, Pose, Shape, Vec3, math};
use orchard_spec::light::LightSpec;
use std::sync::LazyLock;

/// Light and image quality of a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PictureStyle {
    /// Direction towards the sun, world, unit. A low sun is redder and weaker.
    pub sun_world: Vec3,
    /// Strength of the sun, 1 on a clear day; the sky's light does not depend on it. Values below 0 count as 0.
    pub sun_strength: f64,
    /// Cloud cover, 0 to 1. At 1 there is no sun and no cast shadow, and the sky is uniformly bright.
    pub overcast: f64,
    /// Resolution of shadows.
    pub shadows: ShadowMaps,
    /// Samples a pixel side: 3 draws 9 samples a pixel.
    pub supersampling: usize,
    /// Lights each object of a pixel once, at its first sample, instead of each sample: faster, and edges stay smooth.
    pub light_once: bool,
    /// Distance over which haze removes 63 % of the contrast \[m\].
    pub haze_length: f64,
}

impl PictureStyle {
    /// Returns the style under a world's light; without one it stays as it is.
    #[must_use]
    pub fn under(self, light: Option<&LightSpec>) -> Self {
        let Some(LightSpec { sun_azimuth, sun_elevation, sun_strength, overcast }) = light else {
            return self;
        };
        Self {
            sun_world: sun_direction(sun_azimuth.si(), sun_elevation.si()),
            sun_strength: sun_strength.si(),
            overcast: overcast.si(),
            ..self
        }
    }

    /// A colour image of a camera on a robot, which a detector looks at: four samples a pixel, each object of it lit once, and coarse shadows. Our own choice, for speed.
    pub fn of_camera() -> Self {
        let shadows = ShadowMaps { sun: 1024, sky: 128 };
        Self { supersampling: 2, light_once: true, shadows, ..Self::default() }
    }
}

impl Default for PictureStyle {
    fn default() -> Self {
        Self {
            sun_world: Vec3::new(-0.45, -0.50, 0.74).normalize(),
            sun_strength: 1.0,
            overcast: 0.0,
            shadows: ShadowMaps::default(),
            supersampling: 3,
            light_once: false,
            haze_length: 120.0,
        }
    }
}

/// Pixels a side of the shadow maps; each map spans all objects that cast shadow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ShadowMaps {
    /// Size of the sun's map.
    pub sun: usize,
    /// Size of the map of each part of the sky: coarse, since sky light is soft. 0: nothing hides the sky, which is fast.
    pub sky: usize,
}

impl Default for ShadowMaps {
    fn default() -> Self {
        Self { sun: 2048, sky: 384 }
    }
}

/// Direction towards the sun at an azimuth \[rad\] from the world's x axis, counter-clockwise seen from above, and an elevation \[rad\]
/// over the horizon.
pub fn sun_direction(azimuth: f64, elevation: f64) -> Vec3 {
    let ((sin_a, cos_a), (sin_e, cos_e)) = (math::sin_cos(azimuth), math::sin_cos(elevation));
    Vec3::new(cos_e * cos_a, cos_e * sin_a, sin_e)
}

/// Surface point that a ray of the picture meets.
#[derive(Debug, Clone, Copy)]
struct Surface {
    p_world: Vec3,
    /// Unit normal on the viewer's side.
    n_world: Vec3,
    /// True if that is the outer side of the geometry (the upper face of a blade).
    outer_side: bool,
    /// Unit direction from the viewer.
    view_world: Vec3,
}

/// Draws a colour picture of the scene (sRGB), seen through a pinhole camera.
pub fn picture(
    scene: &Scene,
    intrinsics: &Intrinsics,
    x_world_camera: &Pose,
    style: &PictureStyle,
) -> Image<[u8; 3]> {
    Studio::new(scene, style).picture(intrinsics, x_world_camera)
}

/// A lit scene: the light is computed once for any number of pictures.
pub struct Studio<'a> {
    scene: &'a Scene,
    style: PictureStyle,
    lighting: Lighting,
    palette: Palette,
}

impl<'a> Studio<'a> {
    /// Lights a scene.
    pub fn new(scene: &'a Scene, style: &PictureStyle) -> Self {
        Self { scene, style: *style, lighting: Lighting::new(scene, style), palette: Palette::default() }
    }

    /// Draws a colour picture of the scene (sRGB), seen through a pinhole camera.
    pub fn picture(&self, intrinsics: &Intrinsics, x_world_camera: &Pose) -> Image<[u8; 3]> {
        let side = self.style.supersampling.max(1);
        let mut view = View::new(self, supersampled(intrinsics, side), x_world_camera);
        let n = side * side;
        let mut lit: Vec<(Option<u32>, Vec3)> = Vec::with_capacity(n);
        let pixel = |i: usize| {
            let (column, row) = (i % intrinsics.width, i / intrinsics.width);
            if side == 1 {
                return view.sample(column, row, (0, 1)).map(shown).into();
            }
            lit.clear();
            let mut sum = Vec3::zeros();
            for k in 0..n {
                // Each sample is mapped to display range first, so that edges of bright objects stay smooth.
                let (u, v) = (column * side + k % side, row * side + k / side);
                if !self.style.light_once {
                    sum += view.sample(u, v, (k, n)).map(displayed);
                    continue;
                }
                let item = view.met[(u, v)].map(|met| met.item);
                let known = lit.iter().find(|(other, _)| *other == item).map(|(_, light)| *light);
                sum += known.unwrap_or_else(|| {
                    // Neighbouring pixels share out the directions of the sky.
                    let light = view.sample(u, v, ((column + side * row) % n, n)).map(displayed);
                    lit.push((item, light));
                    light
                });
            }
            let mean = sum / n as f64;
            [0, 1, 2].map(|k| (255.0 * mean[k]).round() as u8)
        };
        let pixels = (0..intrinsics.width * intrinsics.height).map(pixel).collect();
        Image::from_pixels(intrinsics.width, intrinsics.height, pixels)
            .unwrap_or_else(|| Image::filled(intrinsics.width, intrinsics.height, [0; 3]))
    }
}

/// Surface that a sample meets: its item, and its primitive among those of the item.
#[derive(Debug, Clone, Copy)]
struct Met {
    item: u32,
    part: u32,
}

/// Samples of one picture.
struct View<'a> {
    studio: &'a Studio<'a>,
    intrinsics: Intrinsics,
    x_world_camera: &'a Pose,
    x_camera_world: Pose,
    depth: DepthImage,
    met: Image<Option<Met>>,
    /// Primitives of each item in the camera frame; none of items that no sample has met.
    primitives: Vec<Vec<Primitive>>,
}

impl<'a> View<'a> {
    fn new(studio: &'a Studio<'a>, intrinsics: Intrinsics, x_world_camera: &'a Pose) -> Self {
        let mut depth = DepthImage::filled(intrinsics.width, intrinsics.height, 0.0);
        let mut met = Image::filled(intrinsics.width, intrinsics.height, None);
        let (items, far) = (&studio.scene.items, f64::INFINITY);
        let mark = |item, part| Some(Met { item, part });
        rasterise(items, &intrinsics, x_world_camera, far, &mut depth, &mut met, mark);
        let x_camera_world = x_world_camera.inverse();
        let primitives = vec![Vec::new(); studio.scene.items.len()];
        Self { studio, intrinsics, x_world_camera, x_camera_world, depth, met, primitives }
    }

    /// Linear light of sample (u, v), which is the `k`-th of `n` of its pixel.
    fn sample(&mut self, u: usize, v: usize, (k, n): (usize, usize)) -> Vec3 {
        let Studio { scene, style, lighting, palette } = self.studio;
        let ray = self.intrinsics.ray(u as f64, v as f64);
        let view_world = (self.x_world_camera.rotation * ray).normalize();
        let met = self.met[(u, v)].and_then(|met| {
            let surface = self.meet(met, &ray, f64::from(self.depth[(u, v)]))?;
            Some((&scene.items[met.item as usize], surface))
        });
        let Some((item, (z, normal))) = met else { return lighting.sky(&view_world) };
        let outer_side = normal.dot(&ray) < 0.0;
        let facing = if outer_side { normal } else { -normal };
        let surface = Surface {
            p_world: orchard_geometry::transform(self.x_world_camera, &(ray * z)),
            n_world: (self.x_world_camera.rotation * facing).normalize(),
            outer_side,
            view_world,
        };
        let material = palette.material(item, &surface);
        let color = lighting.shade(&surface, &material, (k, n));
        // Haze: distance blends into the horizon.
        let clear = math::exp(-z * ray.norm() / style.haze_length);
        color * clear + lighting.horizon() * (1.0 - clear)
    }

    /// Depth and normal (not normalised) at which a ray meets a surface; the depth, rounded to f32, is `z`.
    fn meet(&mut self, met: Met, ray: &Vec3, z: f64) -> Option<(f64, Vec3)> {
        let item = &self.studio.scene.items[met.item as usize];
        // Terrain has too many triangles: only those at the hit point are tried.
        if matches!(item.geometry, Geometry::Shape(Shape::HeightField(_))) {
            let rounding = 2.0 * f64::from(f32::EPSILON);
            let ends = [ray * (z * (1.0 - rounding)), ray * (z * (1.0 + rounding))];
            let primitives = primitives_of(item, &self.x_camera_world, &ends);
            let hits = primitives.iter().filter_map(|p| p.hit_with_normal(ray));
            return hits.min_by(|a, b| a.0.total_cmp(&b.0));
        }
        let known = &mut self.primitives[met.item as usize];
        if known.is_empty() {
            *known = primitives_of(item, &self.x_camera_world, &[]);
        }
        known.get(met.part as usize)?.hit_with_normal(ray)
    }
}

fn primitives_of(item: &Item, x_camera_world: &Pose, within: &[Vec3]) -> Vec<Primitive> {
    let mut all = Vec::new();
    for_each_primitive(item, x_camera_world, within, |p| all.push(*p));
    all
}

/// Intrinsics of the same view with `side` x `side` samples a pixel.
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

/// Maps linear light to an sRGB value, 0 to 1, by a filmic curve with a small toe and a soft shoulder.
fn display(linear: f64) -> f64 {
    let x = EXPOSURE * linear.max(0.0);
    // Rational, 0 at 0, slope rising from its toe, 1 at infinity.
    let y = x * (x + TOE) / (x * (x + SHOULDER) + SHOULDER * TOE);
    if y <= 0.003_130_8 { 12.92 * y } else { 1.055 * math::pow(y, 1.0 / 2.4) - 0.055 }
}

/// The lights at which the rounded value of [`display`] rises, 0 to 255; the last one, infinite, is no rise.
struct Rises {
    lights: [f64; 256],
    /// Number of rises below each run of lights, from the first rise's run to the last one's. A run has at most one rise.
    before: Vec<u8>,
}

impl Rises {
    fn new() -> Self {
        let lights =
            std::array::from_fn(|value| if value < 255 { rise(value as f64) } else { f64::INFINITY });
        let runs = run(lights[0])..=run(lights[254]);
        let before = runs.map(|of| lights.partition_point(|light| run(*light) < of) as u8).collect();
        Self { lights, before }
    }
}

/// [`display`] by a table, to 1e-6: a power a sample would take a quarter of the time of a picture.
fn displayed(linear: f64) -> f64 {
    static CURVE: LazyLock<Vec<f64>> = LazyLock::new(|| {
        let ends = run(CURVE_LIGHTS.0)..=run(CURVE_LIGHTS.1);
        ends.map(|of| display(f64::from_bits(of << RUN_DIGITS))).collect()
    });
    let from = run(linear).wrapping_sub(run(CURVE_LIGHTS.0)) as usize;
    match CURVE.get(from..from.saturating_add(2)) {
        Some(&[low, high]) => {
            let share = (linear.to_bits() & ((1 << RUN_DIGITS) - 1)) as f64 / (1_u64 << RUN_DIGITS) as f64;
            low + share * (high - low)
        }
        _ => display(linear),
    }
}

/// Lights from and to which [`displayed`] uses its table: our own choice, most lights of a picture lie between them.
const CURVE_LIGHTS: (f64, f64) = (1.0 / 1024.0, 64.0);

/// Number of a light's run: lights that share their exponent and eight binary digits.
fn run(linear: f64) -> u64 {
    linear.to_bits() >> RUN_DIGITS
}

/// Binary digits in which the lights of a run differ.
const RUN_DIGITS: u32 = f64::MANTISSA_DIGITS - 1 - 8;

/// Maps linear light to an sRGB value, 0 to 255: [`display`] rounded.
fn shown(linear: f64) -> u8 {
    static RISES: LazyLock<Rises> = LazyLock::new(Rises::new);
    let Rises { lights, before } = &*RISES;
    // Not a number counts as 0.
    let linear = linear.max(0.0);
    let of = run(linear).saturating_sub(run(lights[0])) as usize;
    let value = before[of.min(before.len() - 1)];
    value + u8::from(lights[usize::from(value)] <= linear)
}

/// The least light that [`display`] maps above a value, 0 to 254.
fn rise(value: f64) -> f64 {
    let above = |linear: f64| (255.0 * display(linear)).round() > value;
    let (mut below, mut from) = (0.0, 1.0);
    while !above(from) {
        (below, from) = (from, 2.0 * from);
    }
    loop {
        let middle = 0.5 * (below + from);
        if middle <= below || middle >= from {
            return from;
        }
        if above(middle) { from = middle } else { below = middle }
    }
}

/// Pose of a camera at `p_world` that looks at `target_world`, image up towards world up.
pub fn look_at(p_world: &Vec3, target_world: &Vec3) -> Pose {
    let z = (target_world - p_world).try_normalize(0.0).unwrap_or_else(Vec3::x);
    // For a view straight up or down, image right is world x.
    let x = z.cross(&Vec3::z()).try_normalize(1e-9).unwrap_or_else(Vec3::x);
    let axes = nalgebra::Matrix3::from_columns(&[x, z.cross(&x), z]);
    let rotation = nalgebra::Rotation3::from_matrix_unchecked(axes);
    Pose::from_parts((*p_world).into(), nalgebra::UnitQuaternion::from_rotation_matrix(&rotation))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_follows_the_display_curve() {
        for k in -40..400 {
            let linear = math::exp(0.07 * f64::from(k - 150)) * if k < 0 { -1.0 } else { 1.0 };
            assert!((displayed(linear) - display(linear)).abs() < 1e-6, "{linear}");
        }
        for linear in [0.0, f64::NAN, f64::INFINITY, CURVE_LIGHTS.0, CURVE_LIGHTS.1] {
            assert_eq!(displayed(linear).to_bits(), display(linear).to_bits(), "{linear}");
        }
    }

    #[test]
    fn values_found_by_their_rises_are_those_of_the_display_curve() {
        for k in 0..20_000 {
            let linear = 1e-3 * f64::from(k) - 0.5;
            assert_eq!(f64::from(shown(linear)), (255.0 * display(linear)).round(), "{linear}");
        }
        assert_eq!((shown(f64::NAN), shown(1e300), shown(f64::INFINITY)), (0, 255, 255));
        let rises = Rises::new().lights;
        let at_rises = rises.iter().zip(1..=255_u8).all(|(light, value)| {
            (shown(*light), shown(light.next_down()), shown(light.next_up())) == (value, value - 1, value)
        });
        assert!(at_rises);
        let runs: Vec<u64> = rises.iter().map(|light| run(*light)).collect();
        assert!(runs.windows(2).all(|pair| pair[0] < pair[1]), "two rises in one run");
    }
}
