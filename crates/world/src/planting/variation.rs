//! What the axes of the randomisation have drawn for one tree.

use super::Appearance;
use orchard_camera::Tint;
use orchard_fruit::Fruit;
use orchard_geometry::{Vec3, math};
use orchard_spec::randomisation::{Axis, RandomisationSpec};
use orchard_spec::{Spec, Stream};
use orchard_treegen::Habit;
use std::f64::consts::TAU;
use std::sync::Arc;

/// One draw of every axis, strengths applied.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Variation {
    pub habit: Habit,
    pub wood_density: f64,
    pub youngs_modulus: f64,
    pub rupture_stress: f64,
    pub fruit_size: f64,
    pub fruit_mass: f64,
    /// Which of the base tree's fruit there are.
    pub fruit_visible: Vec<bool>,
    pub leaf_size: f64,
    pub leaf_density: f64,
    pub appearance: Appearance,
}

impl Variation {
    /// Draws every axis from its own stream for a tree of so many segments and fruit.
    pub fn draw(
        spec: &RandomisationSpec,
        segments: usize,
        fruit: usize,
        stream: impl Fn(Axis) -> Stream,
    ) -> Self {
        Self {
            habit: habit(spec, segments, &stream),
            wood_density: spec.wood_density.draw(&mut stream(Axis::WoodDensity)),
            youngs_modulus: spec.youngs_modulus.draw(&mut stream(Axis::YoungsModulus)),
            rupture_stress: spec.rupture_stress.draw(&mut stream(Axis::RuptureStress)),
            fruit_size: spec.fruit_size.draw(&mut stream(Axis::FruitSize)),
            fruit_mass: spec.fruit_mass.draw(&mut stream(Axis::FruitMass)),
            fruit_visible: visible(spec, fruit, stream(Axis::FruitVisible)),
            leaf_size: spec.leaf_size.draw(&mut stream(Axis::LeafSize)),
            leaf_density: spec.leaf_density.draw(&mut stream(Axis::LeafDensity)),
            appearance: appearance(spec, &stream),
        }
    }

    /// The spec with this tree's materials and leaves; the same one where nothing differs.
    pub fn constants(&self, spec: &Arc<Spec>) -> Arc<Spec> {
        let factors =
            [self.wood_density, self.youngs_modulus, self.rupture_stress, self.leaf_size, self.leaf_density];
        if factors.iter().all(|&f| f == 1.0) {
            return spec.clone();
        }
        let mut own = Spec::clone(spec);
        let (wood, foliage) = (&mut own.wood, &mut own.foliage);
        for (constant, factor) in [
            (&mut wood.density, self.wood_density),
            (&mut wood.youngs_modulus, self.youngs_modulus),
            (&mut wood.rupture_stress, self.rupture_stress),
            (&mut foliage.density, self.leaf_density),
            (&mut foliage.blade_length_base, self.leaf_size),
            (&mut foliage.blade_length_slope, self.leaf_size),
            (&mut foliage.blade_width_base, self.leaf_size),
            (&mut foliage.blade_width_slope, self.leaf_size),
        ] {
            *constant = constant.scaled(factor);
        }
        Arc::new(own)
    }

    /// Whether fruit may hang elsewhere than on the base tree, or be of other size.
    pub fn moves_fruit(&self) -> bool {
        !self.habit.is_neutral() || self.fruit_size != 1.0
    }

    /// The base tree's fruit that there are, in their size and mass.
    pub fn fruit(&self, spec: &RandomisationSpec, fruit: Vec<Fruit>) -> Vec<Fruit> {
        let resized = |fruit: Fruit| Fruit {
            radius: spec.fruit_size.apply(fruit.radius, self.fruit_size),
            mass: spec.fruit_mass.apply(fruit.mass, self.fruit_mass),
            ..fruit
        };
        let seen =
            fruit.into_iter().zip(&self.fruit_visible).filter_map(|(fruit, &seen)| seen.then_some(fruit));
        seen.map(resized).collect()
    }
}

fn habit(spec: &RandomisationSpec, segments: usize, stream: &impl Fn(Axis) -> Stream) -> Habit {
    let scale = spec.scale.draw(&mut stream(Axis::Scale));
    let thickness = scale * spec.stockiness.draw(&mut stream(Axis::Stockiness));
    let (mut lengths, mut radii) = (stream(Axis::SegmentLength), stream(Axis::SegmentRadius));
    let mut bends = stream(Axis::SegmentBend);
    Habit {
        length: (0..segments).map(|_| scale * spec.segment_length.draw(&mut lengths)).collect(),
        radius: (0..segments).map(|_| thickness * spec.segment_radius.draw(&mut radii)).collect(),
        bend: (0..segments).map(|_| spec.segment_bend.draw(&mut bends)).collect(),
        droop: spec.droop.draw(&mut stream(Axis::Droop)),
        lean_world: lean(spec, stream(Axis::Lean)),
        fork_spread: spec.fork_spread.draw(&mut stream(Axis::ForkSpread)),
        twist: spec.twist.draw(&mut stream(Axis::Twist)),
    }
}

fn lean(spec: &RandomisationSpec, mut stream: Stream) -> Vec3 {
    let angle = spec.lean.draw(&mut stream);
    let (sin, cos) = math::sin_cos(stream.uniform(0.0, TAU));
    Vec3::new(cos, sin, 0.0) * angle
}

/// A part of all fruit, in an order that no strength changes: a weaker dial shows what a stronger one shows, and more.
fn visible(spec: &RandomisationSpec, fruit: usize, mut stream: Stream) -> Vec<bool> {
    let part = spec.fruit_visible.draw(&mut stream);
    let mut order: Vec<usize> = (0..fruit).collect();
    stream.shuffle(&mut order);
    let mut visible = vec![false; fruit];
    for &i in &order[..((part * fruit as f64).round() as usize).min(fruit)] {
        visible[i] = true;
    }
    visible
}

fn appearance(spec: &RandomisationSpec, stream: &impl Fn(Axis) -> Stream) -> Appearance {
    let (bark_brightness, warmth) = spec.wood_tint.draw(&mut stream(Axis::WoodTint));
    let (leaf_brightness, leaf_hue) = spec.foliage_colour.draw(&mut stream(Axis::FoliageColour));
    let apple_hue = spec.apple_hue.draw(&mut stream(Axis::AppleHue));
    let wood = Vec3::new(warmth, 1.0, warmth.recip()) * bark_brightness;
    let leaf_gain = Vec3::repeat(leaf_brightness);
    Appearance {
        wood: (wood != Vec3::repeat(1.0)).then(|| Tint::gains(wood)),
        leaf: ((leaf_brightness, leaf_hue) != (1.0, 0.0))
            .then(|| Tint::hue(leaf_hue).then(Tint::gains(leaf_gain))),
        fruit: (apple_hue != 0.0).then(|| Tint::hue(apple_hue)),
    }
}
