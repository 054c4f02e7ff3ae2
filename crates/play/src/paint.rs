//! Choices of what is drawn, and in which colours.

/// Colour as sRGB, each channel 0 to 1.
pub type Colour = [f32; 3];

/// Colours of living wood.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum WoodPaint {
    /// One colour.
    #[default]
    Plain,
    /// Bending moment over rupture moment at the base of each segment, by [`load_colour`].
    Load,
}

/// Choices of what is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Paint {
    /// True if leaves are drawn.
    pub leaves: bool,
    /// Colours of living wood.
    pub wood: WoodPaint,
}

/// Everything, in its plain colours.
impl Default for Paint {
    fn default() -> Self {
        Self { leaves: true, wood: WoodPaint::Plain }
    }
}

/// Stops of the map from dark blue to yellow at equal distances: `cividis` of Nunez, Anderton and Renslow (2018), doi:10.1371/journal.pone.0199239, which
/// all kinds of colour vision see as nearly the same ramp.
const CIVIDIS: [Colour; 6] = [
    [0.0, 0.135, 0.304],
    [0.249, 0.289, 0.425],
    [0.427, 0.431, 0.447],
    [0.596, 0.577, 0.471],
    [0.788, 0.739, 0.412],
    [0.996, 0.909, 0.218],
];

/// Colour of a share, 0 (dark blue) to 1 (yellow); what lies outside is drawn as the end, and what is no number as 0.
pub fn load_colour(share: f64) -> Colour {
    let last = CIVIDIS.len() - 1;
    let at = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) * last as f64 };
    let below = (at as usize).min(last - 1);
    let part = (at - below as f64) as f32;
    std::array::from_fn(|k| CIVIDIS[below][k] * (1.0 - part) + CIVIDIS[below + 1][k] * part)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_map_begins_and_ends_with_its_stops_and_grows_lighter() {
        assert_eq!((load_colour(-1.0), load_colour(0.0)), (CIVIDIS[0], CIVIDIS[0]));
        assert_eq!((load_colour(1.0), load_colour(f64::INFINITY)), (CIVIDIS[5], CIVIDIS[5]));
        assert_eq!(load_colour(f64::NAN), CIVIDIS[0]);
        let light = |share: f64| {
            let [r, g, b] = load_colour(share);
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        let steps: Vec<f32> = (0..=100).map(|k| light(f64::from(k) / 100.0)).collect();
        assert!(steps.windows(2).all(|pair| pair[0] < pair[1]));
    }
}
