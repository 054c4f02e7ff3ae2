//! Sun and sky. Shadow maps are depth images from far away, drawn by the depth camera's rasteriser.

use super::material::Material;
use super::{PictureStyle, Surface, look_at};
use crate::depth::rasterise;
use crate::{Geometry, Item, Label, Scene};
use orchard_geometry::{Aabb, DepthImage, Image, Intrinsics, Mat3, Shape, Vec3, math};

/// Distance of a shadow map's camera \[m\]: far enough for nearly parallel rays, near enough for f32 depth.
const DISTANCE: f64 = 100.0;
/// Offset along the normal, and tolerance in depth, against a surface shading itself \[m\]; in the sun's map both are at least a pixel.
const OFFSET: f64 = 0.004;
const BIAS: f64 = 0.004;
/// Number of sky directions.
const SKY_DIRECTIONS: usize = 36;

/// Light of the sky: towards the viewer, and onto a surface that faces up or, reflected by the ground, down.
struct SkyLight {
    horizon: Vec3,
    zenith: Vec3,
    from_above: Vec3,
    from_below: Vec3,
}

fn clear_sky() -> SkyLight {
    SkyLight {
        horizon: Vec3::new(1.15, 1.45, 1.75),
        zenith: Vec3::new(0.16, 0.45, 1.25),
        from_above: Vec3::new(0.42, 0.52, 0.68),
        from_below: Vec3::new(0.20, 0.19, 0.12),
    }
}

/// Light of an overcast sky: uniformly white.
fn cloud() -> SkyLight {
    SkyLight {
        horizon: Vec3::new(1.52, 1.58, 1.64),
        zenith: Vec3::new(1.52, 1.58, 1.64),
        from_above: Vec3::new(1.22, 1.26, 1.30),
        from_below: Vec3::new(0.28, 0.27, 0.20),
    }
}

impl SkyLight {
    fn under(overcast: f64) -> Self {
        let (clear, cloud) = (clear_sky(), cloud());
        let mix = |a: Vec3, b: Vec3| a * (1.0 - overcast) + b * overcast;
        Self {
            horizon: mix(clear.horizon, cloud.horizon),
            zenith: mix(clear.zenith, cloud.zenith),
            from_above: mix(clear.from_above, cloud.from_above),
            from_below: mix(clear.from_below, cloud.from_below),
        }
    }
}

/// All light of a picture.
pub(super) struct Lighting {
    sun_world: Vec3,
    /// Light of the sun on a surface that faces it.
    sun_color: Vec3,
    /// Light of the sky around the sun.
    glow: Vec3,
    /// Shadow map of the sun; `None` without sun.
    sun: Option<ShadowMap>,
    sky_light: SkyLight,
    sky: Vec<(Vec3, ShadowMap)>,
}

impl Lighting {
    pub(super) fn new(scene: &Scene, style: &PictureStyle) -> Self {
        let sun_world = style.sun_world.try_normalize(0.0).unwrap_or_else(Vec3::z);
        let overcast = style.overcast.clamp(0.0, 1.0);
        let strength = style.sun_strength.max(0.0) * (1.0 - overcast);
        // The ground lies under all objects: it receives shadow and casts none.
        let casters: Vec<&Item> = scene.items.iter().filter(|i| i.label != Label::Ground).collect();
        let bounds = ball_about(&casters);
        let sky = (0..SKY_DIRECTIONS).map(sky_direction);
        let shines = strength > 0.0;
        let through_air = through_air(sun_world.z) * strength;
        Self {
            sun_world,
            sun_color: Vec3::new(2.9, 2.6, 2.1).component_mul(&through_air),
            glow: Vec3::new(0.30, 0.24, 0.15).component_mul(&through_air),
            sun: shines.then(|| ShadowMap::new(&casters, &bounds, &sun_world, style.shadows.sun).tolerant()),
            sky_light: SkyLight::under(overcast),
            sky: match style.shadows.sky {
                0 => Vec::new(),
                size => sky.map(|d| (d, ShadowMap::new(&casters, &bounds, &d, size))).collect(),
            },
        }
    }

    /// Colour of the sky in a direction.
    pub(super) fn sky(&self, d: &Vec3) -> Vec3 {
        let up = d.z.max(0.0);
        let blend = 1.0 - math::exp(-6.0 * up);
        let towards = d.dot(&self.sun_world);
        let glow = if towards > 0.0 { power(towards, 24) } else { 0.0 };
        self.horizon() * (1.0 - blend) + self.sky_light.zenith * blend + self.glow * glow
    }

    pub(super) fn horizon(&self) -> Vec3 {
        self.sky_light.horizon
    }

    /// Light that a surface sends to the viewer. Sample `k` of `n` of a pixel uses its share of the sky's
    /// directions only; the pixel's mean covers all of them.
    pub(super) fn shade(&self, s: &Surface, m: &Material, (k, n): (usize, usize)) -> Vec3 {
        let facing = s.n_world.dot(&self.sun_world);
        let (front, back) = (facing.max(0.0), (-facing).max(0.0));
        let lit_side = if facing >= 0.0 { s.n_world } else { -s.n_world };
        // The far side of a surface that lets no light through needs no look at the map.
        let receives = front > 0.0 || m.transmitted != Vec3::zeros();
        let map = self.sun.as_ref().filter(|_| receives);
        let lit = map.map_or(0.0, |map| map.light(&(s.p_world + lit_side * OFFSET.max(map.pixel))));
        let sun = self.sun_color * lit;
        let mut out = m.color.component_mul(&sun) * front;
        out += m.transmitted.component_mul(&sun) * back;
        out += m.color.component_mul(&self.ambient(s, (k, n)));
        if lit > 0.0 && front > 0.0 && m.gloss > 0.0 {
            let half = (self.sun_world - s.view_world).normalize();
            out += sun * (m.gloss * power(s.n_world.dot(&half).max(0.0), m.shininess));
        }
        out
    }

    /// Sky light, less where other objects hide the sky, and light from the ground.
    fn ambient(&self, s: &Surface, (k, n): (usize, usize)) -> Vec3 {
        let up = 0.5 + 0.5 * s.n_world.z;
        let sky = self.sky_light.from_above * up + self.sky_light.from_below * (1.0 - up);
        if self.sky.is_empty() {
            return sky;
        }
        let p = s.p_world + s.n_world * OFFSET;
        let (mut open, mut all) = (0.0, 1e-9);
        let stride = n.clamp(1, SKY_DIRECTIONS / 4);
        for (d, map) in self.sky.iter().skip(k % stride).step_by(stride) {
            // Directions slightly below the surface count too, so that no surface is black.
            let weight = (s.n_world.dot(d) + 0.3).max(0.0);
            all += weight;
            open += weight * map.tap(&p);
        }
        sky * (0.12 + 0.88 * open / all)
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

/// Red, green and blue of the sun relative to a high sun, at a sine of its elevation: each falls exponentially with
/// the air mass, blue fastest. The default sun counts as high.
fn through_air(sin_elevation: f64) -> Vec3 {
    const HIGH: f64 = 0.7;
    const EXTINCTION: [f64; 3] = [0.04, 0.09, 0.18];
    // The air mass at the horizon is 40, about that of the real atmosphere.
    let air_mass = |sin: f64| 1.0 / (sin.max(0.0) + 0.025);
    let more = (air_mass(sin_elevation) - air_mass(HIGH)).max(0.0);
    Vec3::from(EXTINCTION.map(|k| math::exp(-k * more)))
}

/// Direction `i` of a cosine-weighted Fibonacci lattice over the sky.
fn sky_direction(i: usize) -> Vec3 {
    let r = ((i as f64 + 0.5) / SKY_DIRECTIONS as f64).sqrt();
    let (sin, cos) = math::sin_cos(std::f64::consts::PI * (3.0 - 5.0_f64.sqrt()) * i as f64);
    Vec3::new(r * cos, r * sin, (1.0 - r * r).sqrt())
}

/// Centre and radius of a ball around all bounded items.
fn ball_about(items: &[&Item]) -> (Vec3, f64) {
    let of = |item: &&Item| match &item.geometry {
        Geometry::Shape(shape) => shape.aabb(&item.x_world_item),
        Geometry::Blade { length, width, .. } => {
            Shape::Sphere { radius: length.max(*width) }.aabb(&item.x_world_item)
        }
    };
    let boxes = items.iter().map(of).filter(|b| b.min.norm().is_finite() && b.max.norm().is_finite());
    let all =
        boxes.reduce(|a: Aabb, b| a.union(&b)).unwrap_or(Aabb { min: Vec3::zeros(), max: Vec3::zeros() });
    (0.5 * (all.min + all.max), 0.5 * (all.max - all.min).norm() + BIAS)
}

/// Shadow map: depth of the scene seen from a light, along nearly parallel rays.
struct ShadowMap {
    depth: DepthImage,
    intrinsics: Intrinsics,
    /// World to light frame: rotation and offset.
    r_light_world: Mat3,
    t_light_world: Vec3,
    /// Tolerance in depth \[m\], and size of a pixel.
    bias: f64,
    pixel: f64,
}

impl ShadowMap {
    fn new(casters: &[&Item], (center, radius): &(Vec3, f64), towards_light: &Vec3, size: usize) -> Self {
        let f = 0.5 * size as f64 * DISTANCE / radius;
        let c = 0.5 * (size as f64 - 1.0);
        let intrinsics = Intrinsics { width: size, height: size, fx: f, fy: f, cx: c, cy: c };
        let distance = DISTANCE + radius;
        let x_world_light = look_at(&(center + towards_light * distance), center);
        let mut depth = DepthImage::filled(size, size, 0.0);
        let (casters, mut unmarked) = (casters.iter().copied(), Image::filled(size, size, ()));
        let far = f64::INFINITY;
        rasterise(casters, &intrinsics, &x_world_light, far, &mut depth, &mut unmarked, |_, _| ());
        let x_light_world = x_world_light.inverse();
        let r_light_world = *x_light_world.rotation.to_rotation_matrix().matrix();
        Self {
            depth,
            intrinsics,
            r_light_world,
            t_light_world: x_light_world.translation.vector,
            bias: BIAS,
            pixel: 2.0 * radius / size as f64,
        }
    }

    /// The map with a tolerance of at least a pixel.
    fn tolerant(self) -> Self {
        Self { bias: self.bias.max(self.pixel), ..self }
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
        self.intrinsics.project(&p).map(|(u, v)| (u, v, p.z))
    }

    fn open(&self, u: f64, v: f64, z: f64) -> f64 {
        let size = self.intrinsics.width as f64;
        // The nearest pixel. Beyond the map nothing casts shadow.
        let (u, v) = (u + 0.5, v + 0.5);
        let inside = (0.0..size).contains(&u) && (0.0..size).contains(&v);
        let shaded = inside && f64::from(self.depth[(u as usize, v as usize)]) < z - self.bias;
        if shaded { 0.0 } else { 1.0 }
    }
}
