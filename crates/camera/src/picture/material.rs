//! Colours by label and instance.

use super::Surface;
use super::figures::*;
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
#[derive(Debug)]
pub struct Palette {
    noise: Noise,
}

fn mix(a: Vec3, b: Vec3, t: f64) -> Vec3 {
    a + (b - a) * t.clamp(0.0, 1.0)
}

impl Default for Palette {
    fn default() -> Self {
        Self { noise: Noise::new() }
    }
}

impl Palette {
    pub(super) fn material(&self, item: &Item, s: &Surface) -> Material {
        let mut material = match item.label {
            Label::Fruit => self.apple(item, s),
            Label::Leaf => self.leaf(item, s),
            Label::Wood => self.bark(item, s),
            Label::Robot => Material::glossy(plain(item), ROBOT_GLOSS, ROBOT_SHININESS as u32),
            Label::Ground => self.ground(s),
            Label::Scenery => self.weathered_wood(item, s),
            Label::None => Material::matt(plain(item)),
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

    /// Variation of an item among those of its label, 0 to 1: ripeness of apples, age of leaves.
    pub(super) fn variation(&self, item: &Item) -> f64 {
        let channel = if item.label == Label::Fruit { 1 } else { 2 };
        self.noise.of(item.instance, channel)
    }

    /// Apple skin: red over yellow-green, streaked from the stem; ripeness varies by apple.
    fn apple(&self, item: &Item, s: &Surface) -> Material {
        let local = inverse_transform(&item.x_world_item, &s.p_world).normalize();
        let ripeness = self.variation(item);
        let streaks = local.component_mul(&SKIN_STREAKS) + Vec3::z() * (STREAK_SHIFT * ripeness);
        let streaks = self.noise.at(&streaks);
        let cheek = self.noise.at(&(local * CHEEK_CELLS + Vec3::repeat(CHEEK_SHIFT * ripeness)));
        let red = mix(SKIN_DARK_RED, SKIN_RED, streaks);
        let blush = BLUSH_LEAST
            + BLUSH_RIPENESS * ripeness
            + BLUSH_CHEEK * (cheek - BLUSH_CHEEK_MEAN)
            + BLUSH_STREAKS * (streaks - 0.5);
        Material::glossy(mix(SKIN_GROUND, red, blush), SKIN_GLOSS, SKIN_SHININESS as u32)
    }

    /// Leaf: dark and slightly glossy above, paler below, translucent.
    fn leaf(&self, item: &Item, s: &Surface) -> Material {
        let upper = mix(LEAF_YOUNG, LEAF_OLD, self.variation(item));
        let color = if s.outer_side { upper } else { upper * LEAF_BELOW_GAIN + LEAF_BELOW };
        let local = inverse_transform(&item.x_world_item, &s.p_world);
        let midrib = if local.y.abs() < MIDRIB { MIDRIB_GAIN } else { 1.0 };
        Material {
            color: color * midrib,
            transmitted: LEAF_THROUGH,
            gloss: if s.outer_side { LEAF_GLOSS } else { 0.0 },
            shininess: LEAF_SHININESS as u32,
        }
    }

    /// Bark: grey-brown, cracked along the wood.
    fn bark(&self, item: &Item, s: &Surface) -> Material {
        let local = inverse_transform(&item.x_world_item, &s.p_world);
        let streak = self.noise.rough(&local.component_mul(&BARK_CELLS));
        let patch = self.noise.rough(&(s.p_world * PATCH_CELLS));
        let brown = mix(BARK_CRACK, BARK_RIDGE, BARK_CONTRAST * streak - BARK_DARK);
        Material::matt(mix(brown, BARK_PATCH, PATCH_CONTRAST * patch - PATCH_DARK))
    }

    /// Weathered post: silver-grey, grained along the post.
    fn weathered_wood(&self, item: &Item, s: &Surface) -> Material {
        let local = inverse_transform(&item.x_world_item, &s.p_world);
        let grain = self.noise.rough(&local.component_mul(&GRAIN_CELLS));
        Material::matt(mix(POST_DARK, POST_PALE, GRAIN_CONTRAST * grain - GRAIN_DARK))
    }

    /// Ground: grass, and bare soil around the trunk.
    fn ground(&self, s: &Surface) -> Material {
        let p = Vec3::new(s.p_world.x, s.p_world.y, 0.0);
        let (broad, fine) = (self.noise.rough(&(p * BROAD_CELLS)), self.noise.rough(&(p * FINE_CELLS)));
        let blades = self.noise.at(&(p * BLADE_CELLS));
        let grass = mix(GRASS_DARK, GRASS_PALE, BROAD_CONTRAST * broad - BROAD_DARK);
        let grass = grass * (GRASS_LEAST + GRASS_FINE * fine + GRASS_BLADES * blades);
        let soil = mix(SOIL_DARK, SOIL_PALE, SOIL_FINE * fine + SOIL_BLADES * blades);
        let bare = BARE - BARE_FALL * p.norm() + BARE_BROAD * (broad - BARE_BROAD_MEAN);
        Material::matt(mix(grass, soil, bare))
    }
}

/// Colour of an item without texture. Robots are dark grey with orange parts.
pub(super) fn plain(item: &Item) -> Vec3 {
    match item.label {
        Label::Robot if item.instance % 4 == 1 => ROBOT_ORANGE,
        Label::Robot => ROBOT_GREY,
        _ => UNLABELLED,
    }
}
