//! Sun and sky. Shadow maps are depth images from far away, drawn by the depth camera's rasteriser.

use super::figures::{GLOW_EXPONENT, OFFSET, SKY_BELOW, SKY_LEAST, SKY_RISE};
use super::material::Material;
use super::recipe::{Daylight, LightView, MOST_SHARES, Recipe, casts_shadow};
use super::{PictureStyle, Surface};
use crate::depth::rasterise;
use crate::{Item, Scene};
use orchard_geometry::{DepthImage, Image, Mat3, Vec3, math};

/// All light of a picture.
pub(super) struct Lighting {
    daylight: Daylight,
    /// Shadow map of the sun; `None` without sun.
    sun: Option<ShadowMap>,
    sky: Vec<ShadowMap>,
}

impl Lighting {
    pub(super) fn new(scene: &Scene, style: &PictureStyle) -> Self {
        let Recipe { daylight, sun, sky } = Recipe::new(scene, style);
        let casters: Vec<&Item> = scene.items.iter().filter(|item| casts_shadow(item)).collect();
        let map = |view| ShadowMap::new(&casters, view);
        Self { daylight, sun: sun.map(map), sky: sky.into_iter().map(map).collect() }
    }

    /// Colour of the sky in a direction.
    pub(super) fn sky(&self, d: &Vec3) -> Vec3 {
        let up = d.z.max(0.0);
        let blend = 1.0 - math::exp(-SKY_RISE * up);
        let towards = d.dot(&self.daylight.sun_world);
        let glow = if towards > 0.0 { power(towards, GLOW_EXPONENT as u32) } else { 0.0 };
        self.horizon() * (1.0 - blend) + self.daylight.zenith * blend + self.daylight.glow * glow
    }

    pub(super) fn horizon(&self) -> Vec3 {
        self.daylight.horizon
    }

    /// Light that a surface sends to the viewer. Sample `k` of `n` of a pixel uses its share of the sky's
    /// directions only; the pixel's mean covers all of them.
    pub(super) fn shade(&self, s: &Surface, m: &Material, (k, n): (usize, usize)) -> Vec3 {
        let Daylight { sun_world, sun_color, .. } = &self.daylight;
        let facing = s.n_world.dot(sun_world);
        let (front, back) = (facing.max(0.0), (-facing).max(0.0));
        let lit_side = if facing >= 0.0 { s.n_world } else { -s.n_world };
        // The far side of a surface that lets no light through needs no look at the map.
        let receives = front > 0.0 || m.transmitted != Vec3::zeros();
        let map = self.sun.as_ref().filter(|_| receives);
        let lit = map.map_or(0.0, |map| map.light(&(s.p_world + lit_side * map.view.offset)));
        let sun = sun_color * lit;
        let mut out = m.color.component_mul(&sun) * front;
        out += m.transmitted.component_mul(&sun) * back;
        out += m.color.component_mul(&self.ambient(s, (k, n)));
        if lit > 0.0 && front > 0.0 && m.gloss > 0.0 {
            let half = (sun_world - s.view_world).normalize();
            out += sun * (m.gloss * power(s.n_world.dot(&half).max(0.0), m.shininess));
        }
        out
    }

    /// Sky light, less where other objects hide the sky, and light from the ground.
    fn ambient(&self, s: &Surface, (k, n): (usize, usize)) -> Vec3 {
        let up = 0.5 + 0.5 * s.n_world.z;
        let sky = self.daylight.from_above * up + self.daylight.from_below * (1.0 - up);
        if self.sky.is_empty() {
            return sky;
        }
        let p = s.p_world + s.n_world * OFFSET;
        let (mut open, mut all) = (0.0, 1e-9);
        let stride = n.clamp(1, MOST_SHARES);
        for map in self.sky.iter().skip(k % stride).step_by(stride) {
            // Directions slightly below the surface count too, so that no surface is black.
            let weight = (s.n_world.dot(&map.view.towards_world) + SKY_BELOW).max(0.0);
            all += weight;
            open += weight * map.tap(&p);
        }
        sky * (SKY_LEAST + (1.0 - SKY_LEAST) * open / all)
    }
}

/// A whole power, by squaring: much faster than a power of two real numbers.
fn power(x: f64, exponent: u32) -> f64 {
    let (mut square, mut rest, mut product) = (x, exponent, 1.0);
    while rest > 0 {
        if rest % 2 == 1 {
            product *= square;
        }
        square *= square;
        rest /= 2;
    }
    product
}

/// Shadow map: depth of the scene seen from a light.
struct ShadowMap {
    view: LightView,
    depth: DepthImage,
    /// World to light frame: rotation and offset.
    r_light_world: Mat3,
    t_light_world: Vec3,
}

impl ShadowMap {
    fn new(casters: &[&Item], view: LightView) -> Self {
        let size = view.intrinsics.width;
        let mut depth = DepthImage::filled(size, size, 0.0);
        let (casters, mut unmarked) = (casters.iter().copied(), Image::filled(size, size, ()));
        let (far, from) = (f64::INFINITY, &view.x_world_light);
        rasterise(casters, &view.intrinsics, from, far, &mut depth, &mut unmarked, |_, _| ());
        let x_light_world = from.inverse();
        let r_light_world = *x_light_world.rotation.to_rotation_matrix().matrix();
        Self { view, depth, r_light_world, t_light_world: x_light_world.translation.vector }
    }

    /// Share of the light that reaches a point: mean over four pixels around it.
    fn light(&self, p_world: &Vec3) -> f64 {
        const TAPS: [(f64, f64); 4] = [(-0.75, -0.25), (0.25, -0.75), (0.75, 0.25), (-0.25, 0.75)];
        let Some((u, v, z)) = self.place(p_world) else { return 1.0 };
        0.25 * TAPS.iter().map(|(du, dv)| self.open(u + du, v + dv, z)).sum::<f64>()
    }

    /// Returns 1 if the light reaches a point, else 0, by one pixel.
    fn tap(&self, p_world: &Vec3) -> f64 {
        self.place(p_world).map_or(1.0, |(u, v, z)| self.open(u, v, z))
    }

    fn place(&self, p_world: &Vec3) -> Option<(f64, f64, f64)> {
        let p = self.r_light_world * p_world + self.t_light_world;
        self.view.intrinsics.project(&p).map(|(u, v)| (u, v, p.z))
    }

    fn open(&self, u: f64, v: f64, z: f64) -> f64 {
        let size = self.view.intrinsics.width as f64;
        // The nearest pixel. Beyond the map nothing casts shadow.
        let (u, v) = (u + 0.5, v + 0.5);
        let inside = (0.0..size).contains(&u) && (0.0..size).contains(&v);
        let shaded = inside && f64::from(self.depth[(u as usize, v as usize)]) < z - self.view.bias;
        if shaded { 0.0 } else { 1.0 }
    }
}
