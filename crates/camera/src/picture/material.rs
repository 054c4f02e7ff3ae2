//! Colours by label and instance.

use super::Surface;
use super::noise::Noise;
use crate::{Item, Label};
use orchard_geometry::{Vec3, inverse_transform};

/// Reflection and transmission of a surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Material {
    /// Diffuse reflectance.
    pub(super) color: Vec3,
    /// Diffuse transmittance: light from the other side of a leaf.
    pub(super) transmitted: Vec3,
    /// Strength of the specular highlight.
    pub(super) gloss: f64,
    /// Exponent of the specular highlight.
    pub(super) shininess: u32,
}

impl Material {
    fn matt(color: Vec3) -> Self {
        Self { color, transmitted: Vec3::zeros(), gloss: 0.0, shininess: 1 }
    }

    fn glossy(color: Vec3, gloss: f64, shininess: u32) -> Self {
        Self { gloss, shininess, ..Self::matt(color) }
    }
}

/// Colours of an orchard.
pub(super) struct Palette {
    noise: Noise,
}

fn mix(a: Vec3, b: Vec3, t: f64) -> Vec3 {
    a + (b - a) * t.clamp(0.0, 1.0)
}

impl Palette {
    pub(super) fn new() -> Self {
        Self { noise: Noise::new() }
    }

    pub(super) fn material(&self, item: &Item, s: &Surface) -> Material {
        let mut material = match item.label {
            Label::Fruit => self.apple(item, s),
            Label::Leaf => self.leaf(item, s),
            Label::Wood => self.bark(item, s),
            Label::Robot => robot(item),
            Label::Ground => self.ground(s),
            Label::Scenery => self.weathered_wood(item, s),
            Label::None => Material::matt(Vec3::repeat(0.5)),
        };
        if let Some([r, g, b]) = item.color {
            material.color = Vec3::new(r.into(), g.into(), b.into());
        }
        if let Some(tint) = &item.tint {
            material.color = tint.apply(material.color);
            material.transmitted = tint.apply(material.transmitted);
        }
        material
    }

    /// Apple skin: red over yellow-green, streaked from the stem; ripeness varies by apple.
    fn apple(&self, item: &Item, s: &Surface) -> Material {
        let local = inverse_transform(&item.x_world_item, &s.p_world).normalize();
        let ripeness = self.noise.of(item.instance, 1);
        let streaks = self.noise.at(&Vec3::new(9.0 * local.x, 9.0 * local.y, 1.5 * local.z + 7.0 * ripeness));
        let cheek = self.noise.at(&(local * 1.3 + Vec3::repeat(40.0 * ripeness)));
        let red = mix(Vec3::new(0.50, 0.025, 0.03), Vec3::new(0.62, 0.07, 0.03), streaks);
        let ground_color = Vec3::new(0.66, 0.47, 0.09);
        let blush = 0.45 + 0.7 * ripeness + 1.1 * (cheek - 0.45) + 0.5 * (streaks - 0.5);
        Material::glossy(mix(ground_color, red, blush), 0.22, 60)
    }

    /// Leaf: dark and slightly glossy above, paler below, translucent.
    fn leaf(&self, item: &Item, s: &Surface) -> Material {
        let age = self.noise.of(item.instance, 2);
        let upper = mix(Vec3::new(0.045, 0.13, 0.025), Vec3::new(0.12, 0.23, 0.04), age);
        let color = if s.outer_side { upper } else { upper * 1.2 + Vec3::new(0.05, 0.06, 0.045) };
        let local = inverse_transform(&item.x_world_item, &s.p_world);
        let midrib = if local.y.abs() < 0.0012 { 1.35 } else { 1.0 };
        Material {
            color: color * midrib,
            transmitted: Vec3::new(0.13, 0.22, 0.025),
            gloss: if s.outer_side { 0.06 } else { 0.0 },
            shininess: 20,
        }
    }

    /// Bark: grey-brown, cracked along the wood.
    fn bark(&self, item: &Item, s: &Surface) -> Material {
        let local = inverse_transform(&item.x_world_item, &s.p_world);
        let streak = self.noise.rough(&Vec3::new(220.0 * local.x, 220.0 * local.y, 45.0 * local.z));
        let patch = self.noise.rough(&(s.p_world * 14.0));
        let brown = mix(Vec3::new(0.105, 0.07, 0.045), Vec3::new(0.25, 0.185, 0.135), 1.6 * streak - 0.3);
        Material::matt(mix(brown, Vec3::new(0.27, 0.25, 0.20), 1.4 * patch - 0.55))
    }

    /// Weathered post: silver-grey, grained along the post.
    fn weathered_wood(&self, item: &Item, s: &Surface) -> Material {
        let local = inverse_transform(&item.x_world_item, &s.p_world);
        let grain = self.noise.rough(&Vec3::new(160.0 * local.x, 160.0 * local.y, 6.0 * local.z));
        Material::matt(mix(Vec3::new(0.20, 0.18, 0.15), Vec3::new(0.42, 0.40, 0.36), 1.5 * grain - 0.25))
    }

    /// Ground: grass, and bare soil around the trunk.
    fn ground(&self, s: &Surface) -> Material {
        let p = Vec3::new(s.p_world.x, s.p_world.y, 0.0);
        let (broad, fine) = (self.noise.rough(&(p * 1.7)), self.noise.rough(&(p * 34.0)));
        let blades = self.noise.at(&(p * 210.0));
        let grass = mix(Vec3::new(0.06, 0.125, 0.025), Vec3::new(0.17, 0.23, 0.055), 1.5 * broad - 0.25);
        let grass = grass * (0.35 + 0.8 * fine + 0.5 * blades);
        let soil =
            mix(Vec3::new(0.11, 0.075, 0.045), Vec3::new(0.24, 0.175, 0.11), 0.6 * fine + 0.4 * blades);
        let bare = 1.6 - 1.9 * p.norm() + 1.5 * (broad - 0.5);
        Material::matt(mix(grass, soil, bare))
    }
}

/// Robot: dark grey with orange parts.
fn robot(item: &Item) -> Material {
    let orange = item.instance % 4 == 1;
    let color = if orange { Vec3::new(0.70, 0.16, 0.012) } else { Vec3::repeat(0.04) };
    Material::glossy(color, 0.12, 30)
}
