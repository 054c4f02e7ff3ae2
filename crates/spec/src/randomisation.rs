//! Domain randomisation: the axes along which worlds vary, each with its strength.
//!
//! Every axis has a strength (its dial) and the interval from which it is drawn at strength 1. At strength s a factor f acts
//! as f^s and an angle a as s a: strength 0 is the base, bit for bit, and factors above and below 1 stay balanced.
//! Every axis draws from its own random stream ([`Axis`]) at any strength, so that no dial shifts the draws of
//! another axis. Equations: `docs/computation/randomisation.md`.

use orchard_quantity::{Normal, Quantity, Span};
use serde::{Deserialize, Serialize};

pub use crate::axis::Axis;
use crate::axis::with_axes;
use crate::{Purpose, Stream};

/// Mode of variation: the parts that the worlds of a seed share.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// Every world has the tree of world 0; no axis acts.
    Homogeneous,
    /// Every world has the tree of world 0 with shared dimensions, which every episode draws anew. All other axes vary from
    /// world to world.
    SharedDimensions,
    /// Every world has the tree of world 0; every axis varies from world to world.
    DistinctDimensions,
    /// Every world grows its own tree; every axis varies from world to world.
    DistinctTopology,
}

impl Mode {
    /// All modes.
    pub const ALL: [Self; 4] =
        [Self::Homogeneous, Self::SharedDimensions, Self::DistinctDimensions, Self::DistinctTopology];

    /// Index of the world whose tree, fruit and leaves a world takes as its base.
    pub fn base_world(self, world: u32) -> u32 {
        if self == Self::DistinctTopology { world } else { 0 }
    }

    /// True if every episode has new trees.
    pub fn resamples(self) -> bool {
        self == Self::SharedDimensions
    }

    /// Random stream of an axis. The stream of shared dimensions depends on the episode, all others on the world.
    pub fn stream(self, axis: Axis, seed: u64, world: u32, episode: u32) -> Stream {
        let shared = self == Self::SharedDimensions && axis.is_dimension();
        Stream::new(seed, if shared { episode } else { world }, Purpose::Variation(axis))
    }
}

macro_rules! strengths {
    ($($(#[$doc:meta])* $variant:ident = $field:ident, $stream:literal;)*) => {
        impl RandomisationSpec {
            /// Dial of an axis.
            pub fn strength(&self, axis: Axis) -> &Quantity {
                match axis { $(Axis::$variant => &self.$field.strength,)* }
            }

            /// Mutable dial of an axis.
            pub fn strength_mut(&mut self, axis: Axis) -> &mut Quantity {
                match axis { $(Axis::$variant => &mut self.$field.strength,)* }
            }
        }
    };
}

with_axes!(strengths);

/// The axes, each with its dial and its interval at strength 1.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RandomisationSpec {
    /// Mode of variation.
    pub mode: Mode,
    /// Factor on all lengths and radii.
    pub scale: Factor,
    /// Factor on all radii.
    pub stockiness: Factor,
    /// Factor on each segment's length.
    pub segment_length: NormalFactor,
    /// Factor on each segment's radius.
    pub segment_radius: NormalFactor,
    /// Bend at each segment's base, about a random axis across it.
    pub segment_bend: Bend,
    /// Factor on the droop of an internode.
    pub droop: Droop,
    /// Lean of the whole tree about its foot, to a random side.
    pub lean: Angle,
    /// Factor on the angle between a lateral and the wood that bears it.
    pub fork_spread: Factor,
    /// Angle added to the divergence between successive laterals of an axis.
    pub twist: Angle,
    /// Factor on the density of wood.
    pub wood_density: Factor,
    /// Factor on Young's modulus of wood.
    pub youngs_modulus: Factor,
    /// Factor on the rupture stress of wood.
    pub rupture_stress: Factor,
    /// Factor on the radius of a tree's fruit.
    pub fruit_size: ClippedFactor,
    /// Factor on the mass of a tree's fruit.
    pub fruit_mass: ClippedFactor,
    /// Part of the base tree's fruit that hangs on the tree.
    pub fruit_visible: Factor,
    /// Factor on the length and width of blades.
    pub leaf_size: Factor,
    /// Factor on the foliage dial.
    pub leaf_density: Factor,
    /// Change of the colour of bark.
    pub wood_tint: WoodTint,
    /// Change of the colour of leaves.
    pub foliage_colour: FoliageColour,
    /// Change of the colour of apples.
    pub apple_hue: Angle,
}

/// A factor drawn uniformly.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Factor {
    /// Dial (strength) of the axis.
    pub strength: Quantity,
    /// Interval at strength 1.
    pub factor: Span,
}

/// A factor drawn from a normal distribution.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NormalFactor {
    /// Dial (strength) of the axis.
    pub strength: Quantity,
    /// Interval at strength 1.
    pub factor: Normal,
}

/// A factor drawn uniformly, on a value with limits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClippedFactor {
    /// Dial (strength) of the axis.
    pub strength: Quantity,
    /// Interval at strength 1.
    pub factor: Span,
    /// Limits of the product: it is clamped to them; a base value already outside them is not moved further out.
    pub limits: Span,
}

/// An angle drawn uniformly.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Angle {
    /// Dial (strength) of the axis.
    pub strength: Quantity,
    /// Interval at strength 1.
    pub angle: Span,
}

/// A normally distributed angle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bend {
    /// Dial (strength) of the axis.
    pub strength: Quantity,
    /// Standard deviation at strength 1.
    pub sd: Quantity,
}

/// A factor on a droop that accumulates from internode to internode.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Droop {
    /// Dial (strength) of the axis.
    pub strength: Quantity,
    /// Interval at strength 1.
    pub factor: Span,
    /// Droop of an internode on which the factor acts.
    pub internode: Quantity,
}

/// Variation of brightness and warmth.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WoodTint {
    /// Dial (strength) of the axis.
    pub strength: Quantity,
    /// Factor on all channels.
    pub brightness: Span,
    /// Factor on red; blue is divided by it.
    pub warmth: Span,
}

/// Variation of brightness and hue.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FoliageColour {
    /// Dial (strength) of the axis.
    pub strength: Quantity,
    /// Factor on all channels.
    pub brightness: Span,
    /// Turn about the axis of greys, from red towards green.
    pub hue: Span,
}

/// Factor at a strength: exactly 1 at strength 0.
fn at_strength(factor: f64, strength: &Quantity) -> f64 {
    libm::pow(factor, strength.si())
}

impl Factor {
    /// Draws the factor of one tree.
    pub fn draw(&self, stream: &mut Stream) -> f64 {
        at_strength(stream.within(self.factor.si()), &self.strength)
    }
}

impl NormalFactor {
    /// Draws the next factor.
    pub fn draw(&self, stream: &mut Stream) -> f64 {
        at_strength(stream.cut_normal(&self.factor), &self.strength)
    }
}

impl ClippedFactor {
    /// Draws the factor of one tree.
    pub fn draw(&self, stream: &mut Stream) -> f64 {
        at_strength(stream.within(self.factor.si()), &self.strength)
    }

    /// Applies a factor to a value, within the limits.
    pub fn apply(&self, base: f64, factor: f64) -> f64 {
        let (low, high) = self.limits.si();
        (base * factor).clamp(base.min(low), base.max(high))
    }
}

impl Angle {
    /// Draws the angle of one tree \[rad\].
    pub fn draw(&self, stream: &mut Stream) -> f64 {
        stream.within(self.angle.si()) * self.strength.si()
    }
}

impl Bend {
    /// Draws the next angle \[rad\] and the azimuth of its axis \[rad\].
    pub fn draw(&self, stream: &mut Stream) -> (f64, f64) {
        let angle = stream.normal(0.0, self.sd.si()) * self.strength.si();
        (angle, stream.uniform(0.0, std::f64::consts::TAU))
    }
}

impl Droop {
    /// Draws the additional droop of every internode of one tree \[rad\].
    pub fn draw(&self, stream: &mut Stream) -> f64 {
        (at_strength(stream.within(self.factor.si()), &self.strength) - 1.0) * self.internode.si()
    }
}

impl WoodTint {
    /// Draws brightness and warmth of one tree.
    pub fn draw(&self, stream: &mut Stream) -> (f64, f64) {
        let brightness = at_strength(stream.within(self.brightness.si()), &self.strength);
        (brightness, at_strength(stream.within(self.warmth.si()), &self.strength))
    }
}

impl FoliageColour {
    /// Draws brightness and turn of the hue \[rad\] of one tree.
    pub fn draw(&self, stream: &mut Stream) -> (f64, f64) {
        let brightness = at_strength(stream.within(self.brightness.si()), &self.strength);
        (brightness, stream.within(self.hue.si()) * self.strength.si())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Preset, Spec};
    use std::collections::BTreeSet;

    /// A stream's key holds the whole name, in at most 24 bytes.
    #[test]
    fn every_axis_has_a_stream_of_its_own() {
        let names: BTreeSet<&str> = Axis::ALL.iter().map(|axis| axis.stream_name()).collect();
        assert_eq!(names.len(), Axis::ALL.len());
        assert!(names.iter().all(|name| name.len() <= 24 && name.starts_with("vary-")));
    }

    #[test]
    fn factors_and_angles_follow_the_dial() {
        let mut spec = Spec::preset(Preset::Randomised).randomisation;
        let draw = |spec: &RandomisationSpec| {
            let stream = |axis| Mode::DistinctTopology.stream(axis, 1, 2, 0);
            (spec.scale.draw(&mut stream(Axis::Scale)), spec.twist.draw(&mut stream(Axis::Twist)))
        };
        let (factor, angle) = draw(&spec);
        assert!(spec.scale.factor.contains_si(factor) && factor != 1.0, "{factor}");
        assert!(spec.twist.angle.contains_si(angle) && angle != 0.0, "{angle}");
        for (strength, power) in [(0.0, 1.0), (0.5, factor.sqrt()), (2.0, factor * factor)] {
            for axis in [Axis::Scale, Axis::Twist] {
                let dial = spec.strength_mut(axis);
                *dial = dial.with_value(strength).unwrap();
            }
            let (f, a) = draw(&spec);
            // One rounding of a power or a product.
            assert!((f / power - 1.0).abs() < 1e-15 && (a - angle * strength).abs() < 1e-15);
            assert!(strength != 0.0 || (f == 1.0 && a == 0.0));
        }
    }

    #[test]
    fn a_clip_pulls_nothing_back() {
        let clipped = Spec::preset(Preset::Randomised).randomisation.fruit_size;
        let (low, high) = clipped.limits.si();
        assert_eq!((clipped.apply(high, 1.1), clipped.apply(low, 0.9)), (high, low));
        assert_eq!(
            (clipped.apply(2.0 * high, 1.0), clipped.apply(2.0 * high, 1.1)),
            (2.0 * high, 2.0 * high)
        );
    }

    #[test]
    fn the_paper_preset_randomises_nothing_and_the_randomised_one_every_axis() {
        let (paper, randomised) = (Spec::paper(), Spec::preset(Preset::Randomised));
        for &axis in Axis::ALL {
            assert_eq!(paper.randomisation.strength(axis).si(), 0.0, "{}", axis.name());
            assert_eq!(randomised.randomisation.strength(axis).si(), 1.0, "{}", axis.name());
        }
        assert_eq!(paper.randomisation.mode, Mode::DistinctTopology);
        assert_eq!(randomised.randomisation.mode, Mode::DistinctTopology);
    }
}
