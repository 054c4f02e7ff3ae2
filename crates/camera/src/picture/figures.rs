//! Figures of the palette and of light, for every renderer of pictures. All are our own choice: colours are linear light, 0 to 1; lengths are in metres.

use orchard_geometry::Vec3;

/// Declares figures of one kind, and a list of them by name.
macro_rules! figures {
    ($list:ident, $kind:ty: $($(#[$doc:meta])* $name:ident = $value:expr;)*) => {
        $($(#[$doc])* pub(crate) const $name: $kind = $value;)*
        /// All of them, by name.
        pub const $list: &[(&str, $kind)] = &[$((stringify!($name), $name)),*];
    };
}

figures! { NUMBERS, f64:
    /// Offset along the normal against a surface shading itself; in the sun's map at least a pixel.
    OFFSET = 0.004;
    /// Rate at which the colour of the sky turns from that of the horizon to that of the zenith with the sine of elevation.
    SKY_RISE = 6.0;
    /// Exponent of the glow around the sun.
    GLOW_EXPONENT = 24.0;
    /// Directions of the sky slightly below a surface count too, so that no surface is black: sine of the angle.
    SKY_BELOW = 0.3;
    /// Share of the sky's light that nothing hides.
    SKY_LEAST = 0.12;
    /// Brightness of a picture, and shape of its display curve.
    EXPOSURE = 1.1;
    TOE = 0.3;
    SHOULDER = 0.9;
    /// Apples: shift of their textures with ripeness, coarseness of the cheek, and what makes blush.
    STREAK_SHIFT = 7.0;
    CHEEK_CELLS = 1.3;
    CHEEK_SHIFT = 40.0;
    BLUSH_LEAST = 0.45;
    BLUSH_RIPENESS = 0.7;
    BLUSH_CHEEK = 1.1;
    BLUSH_CHEEK_MEAN = 0.45;
    BLUSH_STREAKS = 0.5;
    SKIN_GLOSS = 0.22;
    SKIN_SHININESS = 60.0;
    /// Leaves: paleness of the lower face, half of the midrib's width, its brightness.
    LEAF_BELOW_GAIN = 1.2;
    MIDRIB = 0.0012;
    MIDRIB_GAIN = 1.35;
    LEAF_GLOSS = 0.06;
    LEAF_SHININESS = 20.0;
    /// Bark: contrast of streaks, and cells a metre and contrast of patches.
    BARK_CONTRAST = 1.6;
    BARK_DARK = 0.3;
    PATCH_CELLS = 14.0;
    PATCH_CONTRAST = 1.4;
    PATCH_DARK = 0.55;
    /// Weathered posts: contrast of the grain.
    GRAIN_CONTRAST = 1.5;
    GRAIN_DARK = 0.25;
    /// Ground: cells a metre of its textures, brightness of grass, mix of soil, and where it is bare.
    BROAD_CELLS = 1.7;
    FINE_CELLS = 34.0;
    BLADE_CELLS = 210.0;
    BROAD_CONTRAST = 1.5;
    BROAD_DARK = 0.25;
    GRASS_LEAST = 0.35;
    GRASS_FINE = 0.8;
    GRASS_BLADES = 0.5;
    SOIL_FINE = 0.6;
    SOIL_BLADES = 0.4;
    BARE = 1.6;
    BARE_FALL = 1.9;
    BARE_BROAD = 1.5;
    BARE_BROAD_MEAN = 0.5;
    /// Robots.
    ROBOT_GLOSS = 0.12;
    ROBOT_SHININESS = 30.0;
    /// Octaves of rough noise: cells and weight of the second and third, relative to the first, and the sum of weights.
    SECOND_CELLS = 2.1;
    SECOND_WEIGHT = 0.5;
    THIRD_CELLS = 4.3;
    THIRD_WEIGHT = 0.25;
    OCTAVES = 1.75;
}

figures! { VECTORS, Vec3:
    SKIN_STREAKS = Vec3::new(9.0, 9.0, 1.5);
    SKIN_DARK_RED = Vec3::new(0.50, 0.025, 0.03);
    SKIN_RED = Vec3::new(0.62, 0.07, 0.03);
    SKIN_GROUND = Vec3::new(0.66, 0.47, 0.09);
    LEAF_YOUNG = Vec3::new(0.045, 0.13, 0.025);
    LEAF_OLD = Vec3::new(0.12, 0.23, 0.04);
    LEAF_BELOW = Vec3::new(0.05, 0.06, 0.045);
    LEAF_THROUGH = Vec3::new(0.13, 0.22, 0.025);
    BARK_CELLS = Vec3::new(220.0, 220.0, 45.0);
    BARK_CRACK = Vec3::new(0.105, 0.07, 0.045);
    BARK_RIDGE = Vec3::new(0.25, 0.185, 0.135);
    BARK_PATCH = Vec3::new(0.27, 0.25, 0.20);
    GRAIN_CELLS = Vec3::new(160.0, 160.0, 6.0);
    POST_DARK = Vec3::new(0.20, 0.18, 0.15);
    POST_PALE = Vec3::new(0.42, 0.40, 0.36);
    GRASS_DARK = Vec3::new(0.06, 0.125, 0.025);
    GRASS_PALE = Vec3::new(0.17, 0.23, 0.055);
    SOIL_DARK = Vec3::new(0.11, 0.075, 0.045);
    SOIL_PALE = Vec3::new(0.24, 0.175, 0.11);
    ROBOT_ORANGE = Vec3::new(0.70, 0.16, 0.012);
    ROBOT_GREY = Vec3::new(0.04, 0.04, 0.04);
    UNLABELLED = Vec3::new(0.5, 0.5, 0.5);
}
