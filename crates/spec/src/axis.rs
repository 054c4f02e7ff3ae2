//! Axes of the randomisation.

/// Calls a macro with the list of axes: variant, field of the config, name of the random stream.
macro_rules! with_axes {
    ($macro:ident) => {
        $macro! {
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
            /// Part of the base tree's fruit that hangs on the tree.
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
    };
}
pub(crate) use with_axes;

macro_rules! axes {
    ($($(#[$doc:meta])* $variant:ident = $field:ident, $stream:literal;)*) => {
        /// Axis of the randomisation.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum Axis {
            $($(#[$doc])* $variant,)*
        }

        impl Axis {
            /// All axes.
            pub const ALL: &[Self] = &[$(Self::$variant,)*];

            /// Name of the axis's table in a config.
            pub fn name(self) -> &'static str {
                match self { $(Self::$variant => stringify!($field),)* }
            }

            /// Name that keys the axis's random stream. Part of the seed version: never rename.
            pub(crate) fn stream_name(self) -> &'static str {
                match self { $(Self::$variant => $stream,)* }
            }
        }
    };
}

with_axes!(axes);

impl Axis {
    /// True if the axis changes lengths or radii, false for angles, materials and colours.
    pub fn is_dimension(self) -> bool {
        matches!(self, Self::Scale | Self::Stockiness | Self::SegmentLength | Self::SegmentRadius)
    }
}
