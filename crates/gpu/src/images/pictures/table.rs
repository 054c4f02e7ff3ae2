//! Numbers of pictures as the kernel `light` reads them, in quads: place of the shots, noise, and directions of the sky; items of scenes that stay; shots; items that are sent.

use orchard_camera::picture::PictureStyle;
use orchard_camera::picture::recipe::{self, Palette, Recipe};
use orchard_camera::{Item, Tint};
use orchard_geometry::{Pose, Vec3};

use super::super::solids::{pose_quads, quad};
use crate::layout::QUAD;

/// Four words.
pub(in super::super) type Words = [u32; QUAD];

/// First quads of the noise's values and order, of the directions of the sky, and of the items that stay.
pub(in super::super) const VALUES: usize = 1;
pub(in super::super) const ORDER: usize = VALUES + recipe::NOISE / QUAD;
pub(in super::super) const DIRECTIONS: usize = ORDER + recipe::NOISE / QUAD;
pub(in super::super) const HEAD: usize = DIRECTIONS + recipe::SKY_DIRECTIONS;
/// Quads of a shot and of an item, and of a tint, which lies before the items.
pub(in super::super) const SHOT: usize = 12;
pub(in super::super) const ITEM: usize = 4;
const TINT: usize = 3;

/// View of the sun's map where no sun shines.
pub(super) const NO_SUN: u32 = u32::MAX;

/// A picture that is to be lit, as `kernels/picture.wgsl` reads it.
pub(super) struct Shot<'a> {
    pub view: u32,
    /// First quads of its items that stay, and of those that are sent.
    pub items: u32,
    pub loose: u32,
    pub sun: u32,
    pub sky: u32,
    /// First pixel, and first word of its bytes.
    pub pixels: u32,
    pub words: u32,
    pub x_world_camera: &'a Pose,
    pub style: &'a PictureStyle,
    pub recipe: &'a Recipe,
}

fn bits(values: [f32; QUAD]) -> Words {
    values.map(f32::to_bits)
}

/// A vector, with a fourth number behind it.
fn with(v: &Vec3, fourth: f64) -> Words {
    let [x, y, z, _] = quad(v);
    bits([x, y, z, fourth as f32])
}

/// The quads before the items that stay. The first one tells which quad is the first of the shots.
pub(super) fn head(shots: u32) -> Vec<Words> {
    let (values, order) = recipe::noise_tables();
    let fours = |words: &[u32]| words.as_chunks::<QUAD>().0.to_vec();
    let mut head = vec![[shots, 0, 0, 0]];
    head.extend(fours(&values.map(|value| (value as f32).to_bits())));
    head.extend(fours(&order.map(u32::from)));
    head.extend((0..recipe::SKY_DIRECTIONS).map(|i| with(&recipe::sky_direction(i), 0.0)));
    head
}

impl Shot<'_> {
    pub fn quads(&self) -> [Words; SHOT] {
        let Self { view, items, loose, sun, sky, pixels, words, x_world_camera, style, recipe } = self;
        let light = &recipe.daylight;
        let [turn, _] = pose_quads(x_world_camera);
        let (offset, bias) = recipe.sun.as_ref().map_or((0.0, 0.0), |sun| (sun.offset, sun.bias));
        let sky_bias = recipe.sky.first().map_or(0.0, |map| map.bias);
        let (side, once) = (style.supersampling.max(1) as u32, u32::from(style.light_once));
        [
            [*view, *items, *sun, *sky],
            [side, once, recipe.sky.len() as u32, *pixels],
            [*words, *loose, 0, 0],
            bits(turn),
            with(&x_world_camera.translation.vector, style.haze_length),
            with(&light.sun_world, offset),
            with(&light.sun_color, bias),
            with(&light.glow, sky_bias),
            with(&light.horizon, 0.0),
            with(&light.zenith, 0.0),
            with(&light.from_above, 0.0),
            with(&light.from_below, 0.0),
        ]
    }
}

/// Items as `kernels/picture_material.wgsl` reads them, behind their different tints; and the number of quads of these.
pub(super) fn items(palette: &Palette, items: &[Item]) -> (Vec<Words>, usize) {
    let mut tints: Vec<Tint> = Vec::new();
    let mut records = Vec::with_capacity(ITEM * items.len());
    for item in items {
        let tint = item.tint.map(|tint| {
            let known = tints.iter().position(|known| *known == tint);
            known.unwrap_or_else(|| {
                tints.push(tint);
                tints.len() - 1
            })
        });
        // The last tint comes first, so that each is found from the items.
        records.extend(record(palette, item, tint.map_or(0, |tint| tint as u32 + 1)));
    }
    let columns = tints.iter().rev().flat_map(Tint::columns).map(|column| with(&column, 0.0));
    (columns.chain(records).collect(), TINT * tints.len())
}

fn record(palette: &Palette, item: &Item, tint: u32) -> [Words; ITEM] {
    let (variation, plain) = recipe::paint(palette, item);
    let own = item.color.map_or(plain, |rgb| Vec3::from(rgb.map(f64::from)));
    let [turn, _] = pose_quads(&item.x_world_item);
    [
        [item.label.number() as u32, u32::from(item.color.is_some()), tint, 0],
        bits(turn),
        with(&item.x_world_item.translation.vector, variation),
        with(&own, 0.0),
    ]
}
