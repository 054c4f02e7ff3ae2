//! Light of a picture: sun, sky, and the views from which shadow maps are drawn. The renderer of this crate and that of graphics devices both draw by it.

use super::figures::OFFSET;
pub use super::material::Palette;
use super::material::plain;
use super::noise::Noise;
pub use super::noise::SIZE as NOISE;
use super::{PictureStyle, look_at, supersampled};
use crate::{Geometry, Item, Label, Scene};
use orchard_geometry::{Aabb, Intrinsics, Pose, Shape, Vec3, math};

/// Distance of a shadow map's camera \[m\]: far enough for nearly parallel rays, near enough for f32 depth.
const DISTANCE: f64 = 100.0;
/// Tolerance in depth against a surface shading itself \[m\]; in the sun's map at least a pixel.
const BIAS: f64 = 0.004;
/// Number of sky directions.
pub const SKY_DIRECTIONS: usize = 36;
/// Most groups into which the samples of a pixel share out the directions of the sky.
pub const MOST_SHARES: usize = SKY_DIRECTIONS / 4;

/// Light of sun and sky, linear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Daylight {
    /// Direction towards the sun, world, unit.
    pub sun_world: Vec3,
    /// Light of the sun on a surface that faces it.
    pub sun_color: Vec3,
    /// Light of the sky around the sun.
    pub glow: Vec3,
    /// Light of the sky towards the viewer, at the horizon.
    pub horizon: Vec3,
    /// Light of the sky towards the viewer, overhead.
    pub zenith: Vec3,
    /// Light of the sky onto a surface that faces up.
    pub from_above: Vec3,
    /// Light reflected by the ground onto a surface that faces down.
    pub from_below: Vec3,
}

/// View of a light onto the scene: its depth image is the light's shadow map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightView {
    /// Direction towards the light, world, unit.
    pub towards_world: Vec3,
    /// Intrinsics of the map.
    pub intrinsics: Intrinsics,
    /// Pose of its camera.
    pub x_world_light: Pose,
    /// Tolerance in depth \[m\]: what is farther than the map's depth by more is in shadow.
    pub bias: f64,
    /// Offset of a surface along its normal before it is looked up \[m\].
    pub offset: f64,
}

/// Light of a picture, and the views from which its shadow maps are drawn. The ground receives shadow and casts none.
#[derive(Debug, Clone, PartialEq)]
pub struct Recipe {
    /// Sun and sky.
    pub daylight: Daylight,
    /// Shadow map of the sun; `None` without sun.
    pub sun: Option<LightView>,
    /// Maps of the parts of the sky; none if nothing hides the sky.
    pub sky: Vec<LightView>,
}

impl Recipe {
    /// The light of a scene under a style.
    pub fn new(scene: &Scene, style: &PictureStyle) -> Self {
        Self::of(scene.items.iter().map(|item| (item, item.x_world_item)), style)
    }

    /// The light of some items under a style, which are given with their poses in the world.
    pub fn of<'a>(items: impl Iterator<Item = (&'a Item, Pose)>, style: &PictureStyle) -> Self {
        let daylight = Daylight::under(style);
        let bounds = ball_about(items.filter(|(item, _)| casts_shadow(item)));
        let shines = style.strength() > 0.0;
        let sky = (0..SKY_DIRECTIONS).map(sky_direction);
        Self {
            daylight,
            sun: shines
                .then(|| LightView::new(&bounds, &daylight.sun_world, style.shadows.sun).tolerant(bounds.1)),
            sky: match style.shadows.sky {
                0 => Vec::new(),
                size => sky.map(|d| LightView::new(&bounds, &d, size)).collect(),
            },
        }
    }
}

/// True if an item casts shadow. The ground lies under all objects.
pub fn casts_shadow(item: &Item) -> bool {
    item.label != Label::Ground
}

/// Tables of the noise of textures: values, and the order by which coordinates of cells are hashed.
pub fn noise_tables() -> ([f64; NOISE], [u8; NOISE]) {
    let Noise { values, order } = Noise::new();
    (values, order)
}

/// Variation of an item among those of its label, 0 to 1, and its colour if it has no texture.
pub fn paint(palette: &Palette, item: &Item) -> (f64, Vec3) {
    (palette.variation(item), plain(item))
}

/// Intrinsics of the samples of a picture.
pub fn samples(style: &PictureStyle, intrinsics: &Intrinsics) -> Intrinsics {
    supersampled(intrinsics, style.supersampling.max(1))
}

impl PictureStyle {
    /// Strength of the sun under the cloud.
    fn strength(&self) -> f64 {
        self.sun_strength.max(0.0) * (1.0 - self.overcast.clamp(0.0, 1.0))
    }
}

impl Daylight {
    fn under(style: &PictureStyle) -> Self {
        let sun_world = style.sun_world.try_normalize(0.0).unwrap_or_else(Vec3::z);
        let overcast = style.overcast.clamp(0.0, 1.0);
        let mix = |clear: [f64; 3], cloud: [f64; 3]| {
            Vec3::from(clear) * (1.0 - overcast) + Vec3::from(cloud) * overcast
        };
        let through_air = through_air(sun_world.z) * style.strength();
        Self {
            sun_world,
            sun_color: Vec3::new(2.9, 2.6, 2.1).component_mul(&through_air),
            glow: Vec3::new(0.30, 0.24, 0.15).component_mul(&through_air),
            // An overcast sky is uniformly white.
            horizon: mix([1.15, 1.45, 1.75], [1.52, 1.58, 1.64]),
            zenith: mix([0.16, 0.45, 1.25], [1.52, 1.58, 1.64]),
            from_above: mix([0.42, 0.52, 0.68], [1.22, 1.26, 1.30]),
            from_below: mix([0.20, 0.19, 0.12], [0.28, 0.27, 0.20]),
        }
    }
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
pub fn sky_direction(i: usize) -> Vec3 {
    let r = ((i as f64 + 0.5) / SKY_DIRECTIONS as f64).sqrt();
    let (sin, cos) = math::sin_cos(std::f64::consts::PI * (3.0 - 5.0_f64.sqrt()) * i as f64);
    Vec3::new(r * cos, r * sin, (1.0 - r * r).sqrt())
}

/// Centre and radius of a ball around all bounded items.
fn ball_about<'a>(items: impl Iterator<Item = (&'a Item, Pose)>) -> (Vec3, f64) {
    let of = |(item, x_world): (&Item, Pose)| match &item.geometry {
        Geometry::Shape(shape) => shape.aabb(&x_world),
        Geometry::Blade { length, width, .. } => Shape::Sphere { radius: length.max(*width) }.aabb(&x_world),
    };
    let boxes = items.map(of).filter(|b| b.min.norm().is_finite() && b.max.norm().is_finite());
    let all =
        boxes.reduce(|a: Aabb, b| a.union(&b)).unwrap_or(Aabb { min: Vec3::zeros(), max: Vec3::zeros() });
    (0.5 * (all.min + all.max), 0.5 * (all.max - all.min).norm() + BIAS)
}

impl LightView {
    /// The view of a light at a distance, along nearly parallel rays, onto a ball.
    fn new((center, radius): &(Vec3, f64), towards_world: &Vec3, size: usize) -> Self {
        let f = 0.5 * size as f64 * DISTANCE / radius;
        let c = 0.5 * (size as f64 - 1.0);
        Self {
            towards_world: *towards_world,
            intrinsics: Intrinsics { width: size, height: size, fx: f, fy: f, cx: c, cy: c },
            x_world_light: look_at(&(center + towards_world * (DISTANCE + radius)), center),
            bias: BIAS,
            offset: OFFSET,
        }
    }

    /// The view with a tolerance and an offset of at least a pixel.
    fn tolerant(self, radius: f64) -> Self {
        let pixel = 2.0 * radius / self.intrinsics.width as f64;
        Self { bias: self.bias.max(pixel), offset: self.offset.max(pixel), ..self }
    }
}
