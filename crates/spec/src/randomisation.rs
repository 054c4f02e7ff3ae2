//! Domain randomisation: what varies from one world to the next, and how strongly.
//!
//! Every axis has a strength, its dial, and the interval that it is drawn from at strength 1. At strength s a factor f acts
//! as f^s and an angle a as s a: strength 0 is the base, bit for bit, and factors above and below 1 stay balanced.
//! Every axis draws from a random stream of its own ([`Axis`]), whatever its strength, so that no dial shifts the draws of
//! another axis. `docs/computation/randomisation.md` has the whole.

use orchard_quantity::{Normal, Quantity, Span};
use serde::{Deserialize, Serialize};

use crate::{Purpose, Stream};

/// Which worlds of a seed share what.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// The tree of world 0 in every world; no axis acts.
    Homogeneous,
    /// The tree of world 0 in every world, in dimensions that all worlds share and that the next episode draws anew. All other
    /// axes vary from world to world.
    SharedDimensions,
    /// The tree of world 0 in every world; every axis varies from world to world.
    DistinctDimensions,
    /// Every world grows a tree of its own; every axis varies from world to world.
    DistinctTopology,
}

impl Mode {
    /// All of them.
    pub const ALL: [Self; 4] =
        [Self::Homogeneous, Self::SharedDimensions, Self::DistinctDimensions, Self::DistinctTopology];

    /// The world whose tree, fruit and leaves are the base of a world's.
    pub fn base_world(self, world: u32) -> u32 {
        if self == Self::DistinctTopology { world } else { 0 }
    }

    /// Whether the next episode has other trees than the one before.
    pub fn resamples(self) -> bool {
        self == Self::SharedDimensions
    }

    /// The random stream of an axis. The shared dimensions know the episode and not the world, everything else the world
    /// and not the episode.
    pub fn stream(self, axis: Axis, seed: u64, world: u32, episode: u32) -> Stream {
        let shared = self == Self::SharedDimensions && axis.is_dimension();
        Stream::new(seed, if shared { episode } else { world }, Purpose::Variation(axis))
    }
}

macro_rules! axes {
    ($($(#[$doc:meta])* $variant:ident = $field:ident, $stream:literal;)*) => {
        /// What is randomised.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum Axis {
            $($(#[$doc])* $variant,)*
        }

        impl Axis {
            /// All of them.
            pub const ALL: &[Self] = &[$(Self::$variant,)*];

            /// Name of its table in a config.
            pub fn name(self) -> &'static str {
                match self { $(Self::$variant => stringify!($field),)* }
            }

            /// The name that keys its stream. Part of the seed version: never rename.
            pub(crate) fn stream_name(self) -> &'static str {
                match self { $(Self::$variant => $stream,)* }
            }
        }

        impl RandomisationSpec {
            /// The dial of an axis.
            pub fn strength(&self, axis: Axis) -> &Quantity {
                match axis { $(Axis::$variant => &self.$field.strength,)* }
            }

            /// The dial of an axis, to be turned.
            pub fn strength_mut(&mut self, axis: Axis) -> &mut Quantity {
                match axis { $(Axis::$variant => &mut self.$field.strength,)* }
            }
        }
    };
}

axes! {
    /// Size of the whole tree.
    Scale = scale, "vary-scale";
    /// Thickness of all wood over its length.
    Stockiness = stockiness, "vary-stockiness";
    /// Length of each segment.
    SegmentLength = segment_length, "vary-length";
    /// Radius of each segment.
    SegmentRadius = segment_radius, "vary-radius";
    /// Bend at the base of each segment.
    SegmentBend = segment_bend, "vary-bend";
    /// Droop of every limb's internodes.
    Droop = droop, "vary-droop";
    /// Lean of the whole tree.
    Lean = lean, "vary-lean";
    /// Angle between a lateral and the wood that bears it.
    ForkSpread = fork_spread, "vary-fork-spread";
    /// Roll from one lateral of an axis to the next.
    Twist = twist, "vary-twist";
    /// Density of wood.
    WoodDensity = wood_density, "vary-wood-density";
    /// Young's modulus of wood.
    YoungsModulus = youngs_modulus, "vary-modulus";
    /// Rupture stress of wood.
    RuptureStress = rupture_stress, "vary-rupture";
    /// Radius of fruit.
    FruitSize = fruit_size, "vary-fruit-size";
    /// Mass of fruit.
    FruitMass = fruit_mass, "vary-fruit-mass";
    /// Part of the base tree's fruit that there is.
    FruitVisible = fruit_visible, "vary-fruit-visible";
    /// Size of leaves.
    LeafSize = leaf_size, "vary-leaf-size";
    /// The foliage dial.
    LeafDensity = leaf_density, "vary-leaf-density";
    /// Colour of bark.
    WoodTint = wood_tint, "vary-wood-tint";
    /// Colour of leaves.
    FoliageColour = foliage_colour, "vary-foliage";
    /// Hue of apples.
    AppleHue = apple_hue, "vary-apple-hue";
}

impl Axis {
    /// Whether it changes lengths or radii, as against angles, materials and colours.
    pub fn is_dimension(self) -> bool {
        matches!(self, Self::Scale | Self::Stockiness | Self::SegmentLength | Self::SegmentRadius)
    }
}

/// The axes, each with its dial and its interval at strength 1.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RandomisationSpec {
    /// Which worlds share what.
    pub mode: Mode,
    /// On all lengths and radii.
    pub scale: Factor,
    /// On all radii.
    pub stockiness: Factor,
    /// On each segment's length.
    pub segment_length: NormalFactor,
    /// On each segment's radius.
    pub segment_radius: NormalFactor,
    /// Bend at each segment's base, about a random axis across it.
    pub segment_bend: Bend,
    /// On the droop of an internode.
    pub droop: Droop,
    /// Of the whole tree about its foot, to a random side.
    pub lean: Angle,
    /// On the angle between a lateral and the wood that bears it.
    pub fork_spread: Factor,
    /// Added to the divergence between successive laterals of an axis.
    pub twist: Angle,
    /// On the density of wood.
    pub wood_density: Factor,
    /// On Young's modulus of wood.
    pub youngs_modulus: Factor,
    /// On the rupture stress of wood.
    pub rupture_stress: Factor,
    /// On the radius of a tree's fruit.
    pub fruit_size: ClippedFactor,
    /// On the mass of a tree's fruit.
    pub fruit_mass: ClippedFactor,
    /// Part of the base tree's fruit that there is.
    pub fruit_visible: Factor,
    /// On the length and width of blades.
    pub leaf_size: Factor,
    /// On the foliage dial.
    pub leaf_density: Factor,
    /// On the colour of bark.
    pub wood_tint: WoodTint,
    /// On the colour of leaves.
    pub foliage_colour: FoliageColour,
    /// On the colour of apples.
    pub apple_hue: Angle,
}

/// A factor drawn uniformly.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Factor {
    /// The dial.
    pub strength: Quantity,
    /// At strength 1.
    pub factor: Span,
}

/// A factor drawn from a normal distribution.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NormalFactor {
    /// The dial.
    pub strength: Quantity,
    /// At strength 1.
    pub factor: Normal,
}

/// A factor drawn uniformly, on something that keeps within limits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClippedFactor {
    /// The dial.
    pub strength: Quantity,
    /// At strength 1.
    pub factor: Span,
    /// What the factor leads beyond these is set to them; what was beyond them before is led no further.
    pub limits: Span,
}

/// An angle drawn uniformly.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Angle {
    /// The dial.
    pub strength: Quantity,
    /// At strength 1.
    pub angle: Span,
}

/// A normally distributed angle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bend {
    /// The dial.
    pub strength: Quantity,
    /// Standard deviation at strength 1.
    pub sd: Quantity,
}

/// A factor on a droop that accumulates from internode to internode.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Droop {
    /// The dial.
    pub strength: Quantity,
    /// At strength 1.
    pub factor: Span,
    /// Droop of an internode that the factor acts on.
    pub internode: Quantity,
}

/// Brightness and warmth.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WoodTint {
    /// The dial.
    pub strength: Quantity,
    /// Factor on all channels.
    pub brightness: Span,
    /// Factor on red; blue is divided by it.
    pub warmth: Span,
}

/// Brightness and hue.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FoliageColour {
    /// The dial.
    pub strength: Quantity,
    /// Factor on all channels.
    pub brightness: Span,
    /// Turn about the axis of greys, from red towards green.
    pub hue: Span,
}

/// A factor at some strength: exactly 1 at strength 0.
fn at_strength(factor: f64, strength: &Quantity) -> f64 {
    libm::pow(factor, strength.si())
}

impl Factor {
    /// The factor of one tree.
    pub fn draw(&self, stream: &mut Stream) -> f64 {
        at_strength(stream.within(self.factor.si()), &self.strength)
    }
}

impl NormalFactor {
    /// The next factor.
    pub fn draw(&self, stream: &mut Stream) -> f64 {
        at_strength(stream.cut_normal(&self.factor), &self.strength)
    }
}

impl ClippedFactor {
    /// The factor of one tree.
    pub fn draw(&self, stream: &mut Stream) -> f64 {
        at_strength(stream.within(self.factor.si()), &self.strength)
    }

    /// A value under a factor.
    pub fn apply(&self, base: f64, factor: f64) -> f64 {
        let (low, high) = self.limits.si();
        (base * factor).clamp(base.min(low), base.max(high))
    }
}

impl Angle {
    /// The angle of one tree [rad].
    pub fn draw(&self, stream: &mut Stream) -> f64 {
        stream.within(self.angle.si()) * self.strength.si()
    }
}

impl Bend {
    /// The next angle [rad], and the azimuth of its axis [rad].
    pub fn draw(&self, stream: &mut Stream) -> (f64, f64) {
        let angle = stream.normal(0.0, self.sd.si()) * self.strength.si();
        (angle, stream.uniform(0.0, std::f64::consts::TAU))
    }
}

impl Droop {
    /// Further droop of every internode of one tree [rad].
    pub fn draw(&self, stream: &mut Stream) -> f64 {
        (at_strength(stream.within(self.factor.si()), &self.strength) - 1.0) * self.internode.si()
    }
}

impl WoodTint {
    /// Brightness and warmth of one tree.
    pub fn draw(&self, stream: &mut Stream) -> (f64, f64) {
        let brightness = at_strength(stream.within(self.brightness.si()), &self.strength);
        (brightness, at_strength(stream.within(self.warmth.si()), &self.strength))
    }
}

impl FoliageColour {
    /// Brightness, and turn of the hue [rad], of one tree.
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

    /// The whole name takes part in a stream's key, which has 24 bytes for it.
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
