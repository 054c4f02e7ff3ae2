//! Draws of the randomisation axes for one tree.

use super::Appearance;
use orchard_camera::Tint;
use orchard_fruit::Fruit;
use orchard_geometry::{Vec3, math};
use orchard_spec::randomisation::{Axis, RandomisationSpec};
use orchard_spec::{Spec, Stream};
use orchard_treegen::{Habit, LeafSite};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Draws that hold for the whole tree: one of each axis, strengths applied.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Variation {
    pub wood_density: f64,
    pub youngs_modulus: f64,
    pub rupture_stress: f64,
    pub leaf_size: f64,
    pub leaf_density: f64,
    pub appearance: Appearance,
}

impl Variation {
    /// Draws every axis from its own stream.
    pub fn draw(spec: &RandomisationSpec, stream: impl Fn(Axis) -> Stream) -> Self {
        Self {
            wood_density: spec.wood_density.draw(&mut stream(Axis::WoodDensity)),
            youngs_modulus: spec.youngs_modulus.draw(&mut stream(Axis::YoungsModulus)),
            rupture_stress: spec.rupture_stress.draw(&mut stream(Axis::RuptureStress)),
            leaf_size: spec.leaf_size.draw(&mut stream(Axis::LeafSize)),
            leaf_density: spec.leaf_density.draw(&mut stream(Axis::LeafDensity)),
            appearance: appearance(spec, &stream),
        }
    }

    /// The spec with this tree's wood and foliage dial; the given spec if they are unchanged.
    pub fn constants(&self, spec: &Arc<Spec>) -> Arc<Spec> {
        let factors = [self.wood_density, self.youngs_modulus, self.rupture_stress, self.leaf_density];
        if factors.iter().all(|&f| f == 1.0) {
            return spec.clone();
        }
        let mut own = Spec::clone(spec);
        for (constant, factor) in [
            (&mut own.wood.density, self.wood_density),
            (&mut own.wood.youngs_modulus, self.youngs_modulus),
            (&mut own.wood.rupture_stress, self.rupture_stress),
            (&mut own.foliage.density, self.leaf_density),
        ] {
            *constant = constant.scaled(factor);
        }
        Arc::new(own)
    }

    /// Gives leaves this tree's size.
    pub fn size_leaves(&self, leaves: &mut [LeafSite]) {
        for leaf in leaves {
            leaf.length *= self.leaf_size;
            leaf.width *= self.leaf_size;
        }
    }
}

/// Changes to a base tree's fruit.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Crop {
    pub size: f64,
    pub mass: f64,
    /// Order in which the base tree's fruit are tested for clearance: no strength changes it, so that a weaker
    /// dial shows what a stronger one shows, and more.
    pub order: Vec<usize>,
    /// Number of fruit to keep.
    pub count: usize,
}

impl Crop {
    /// Draws the axes of so many fruit.
    pub fn draw(spec: &RandomisationSpec, fruit: usize, stream: impl Fn(Axis) -> Stream) -> Self {
        let mut visible = stream(Axis::FruitVisible);
        let part = spec.fruit_visible.draw(&mut visible);
        let mut order: Vec<usize> = (0..fruit).collect();
        visible.shuffle(&mut order);
        Self {
            size: spec.fruit_size.draw(&mut stream(Axis::FruitSize)),
            mass: spec.fruit_mass.draw(&mut stream(Axis::FruitMass)),
            order,
            count: (part * fruit as f64).round() as usize,
        }
    }

    /// Fruit in this tree's size and mass.
    pub fn resized(&self, spec: &RandomisationSpec, fruit: Vec<Fruit>) -> Vec<Fruit> {
        let resized = |fruit: Fruit| Fruit {
            radius: spec.fruit_size.apply(fruit.radius, self.size),
            mass: spec.fruit_mass.apply(fruit.mass, self.mass),
            ..fruit
        };
        fruit.into_iter().map(resized).collect()
    }
}

/// Habit and dimensions of a tree of so many segments.
pub(super) fn draw_habit(
    spec: &RandomisationSpec,
    segments: usize,
    stream: impl Fn(Axis) -> Stream,
) -> Habit {
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
