//! The detector's thresholds.

use orchard_quantity::{ConfigError, Count, Quantity, Span, from_table, parse};
use serde::{Deserialize, Serialize};

/// The preset `paper` as TOML text.
pub const PAPER_TOML: &str = include_str!("../configs/paper/perception.toml");
/// The preset `d435i` as TOML text.
pub const D435I_TOML: &str = include_str!("../configs/d435i/perception.toml");

/// Every threshold of detector, masks and tracker; read from `perception.toml`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DetectorConfig {
    /// Which pixels count and how they are joined.
    pub segmentation: Segmentation,
    /// How a sphere is found in a patch.
    pub fit: Fit,
    /// What a sphere must satisfy.
    pub gates: Gates,
    /// Robot and ground masks.
    pub mask: Mask,
    /// Persistence over images.
    pub tracking: Tracking,
}

/// Depth-continuous patches.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Segmentation {
    /// Working range of the detector, depth.
    pub range: Span,
    /// Largest depth step between neighbouring pixels of one patch.
    pub depth_jump: Quantity,
    /// Fewest pixels of a patch and of a detection.
    pub min_pixels: Count,
}

/// Sphere search within a patch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fit {
    /// Whether spheres are also searched within patches (fruit that touches leaves, wood or other fruit) and
    /// outliers trimmed. Off: one sphere a patch through all its pixels.
    pub refine: bool,
    /// Half-width of the window of a local fit over the disc of the smallest radius that the gate allows.
    pub window: Quantity,
    /// Distance between the pixels from which local fits start.
    pub stride: Count,
    /// Distance from the sphere within which a pixel belongs to it: about three sigma of the depth noise.
    pub band: Quantity,
    /// The band at a depth of one metre, where it grows with depth squared as a stereo camera's noise does; the wider of
    /// the two bands counts.
    pub noise: Quantity,
    /// First, wider band of a fit, as a multiple of its RMS; it is halved every round.
    pub trim: Quantity,
    /// Most rounds of collecting pixels and fitting again.
    pub rounds: Count,
    /// Most pixels that the search looks at, counted again whenever it does, over those of the image: an end for images
    /// made to have none.
    pub effort: Count,
}

/// Gates. Each has a switch, so that an ablation can take it out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gates {
    /// Radius of an apple.
    pub radius: IntervalGate,
    /// Largest RMS of the radial residual.
    pub residual: LimitGate,
    /// The surface must bulge towards the camera.
    pub convexity: LimitGate,
    /// Part of the silhouette border at which depth must jump or end.
    pub isolation: LimitGate,
    /// Pixels over those that the sphere's disc covers, pi (R f / z)^2.
    pub pixel_ratio: IntervalGate,
    /// Largest ratio of the footprint's second moments (elongation squared).
    pub elongation: LimitGate,
    /// A cylinder may not fit this much better than the sphere.
    pub cylinder: LimitGate,
    /// No gate of its own: what lies at least this much before the sphere hides it. Elongation then counts hidden pixels of
    /// the disc as footprint, isolation leaves them out of the border where depth does not jump.
    pub hidden: LimitGate,
}

/// A gate with one limit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LimitGate {
    /// Whether the gate is applied.
    pub on: bool,
    /// Its limit.
    pub limit: Quantity,
}

/// A gate with an allowed interval.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct IntervalGate {
    /// Whether the gate is applied.
    pub on: bool,
    /// The allowed interval.
    pub limit: Span,
}

/// Masks from kinematics.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mask {
    /// By how much the robot's shapes are grown.
    pub robot_margin: Quantity,
    /// Height over the ground below which a pixel is ground.
    pub ground_margin: Quantity,
}

/// The tracker.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tracking {
    /// Largest distance between a track and a sighting of it.
    pub merge_distance: Quantity,
    /// Sightings that confirm a track.
    pub hits: Count,
    /// Sightings over which the position is averaged.
    pub memory: Count,
    /// Time after which an unconfirmed track that is not seen again is dropped.
    pub tentative_life: Quantity,
    /// Time after which a confirmed track that is not seen again is dropped.
    pub confirmed_life: Quantity,
}

impl LimitGate {
    /// The limit in SI units; `None` where the gate is off.
    pub fn si(&self) -> Option<f64> {
        self.on.then(|| self.limit.si())
    }
}

impl IntervalGate {
    /// The interval in SI units; `None` where the gate is off.
    pub fn si(&self) -> Option<(f64, f64)> {
        self.on.then(|| self.limit.si())
    }
}

impl DetectorConfig {
    /// Reads a config from TOML text; `file` names it in errors. With `base = "NAME"` it holds only what differs from
    /// that preset.
    ///
    /// # Errors
    /// Not TOML, a field missing or unknown, a value outside its range.
    pub fn from_toml(file: &str, text: &str) -> Result<Self, ConfigError> {
        from_table(file, with_base(file, text)?)
    }

    /// The presets that come with the crate: their names and files.
    pub const FILES: &[(&str, &str)] = &[("paper", PAPER_TOML), ("d435i", D435I_TOML)];

    /// A preset that comes with the crate.
    ///
    /// # Errors
    /// There is none of that name.
    pub fn named(name: &str) -> Result<Self, String> {
        let text = preset_text(name)?;
        Self::from_toml(&format!("{name}/perception.toml"), text).map_err(|e| e.to_string())
    }

    /// The preset `paper`: for a camera without errors.
    ///
    /// # Panics
    /// Never: the embedded file is read in this crate's tests.
    pub fn paper() -> Self {
        Self::named("paper").unwrap_or_else(|e| unreachable!("embedded preset: {e}"))
    }

    /// The preset `d435i`: for the errors of an Intel RealSense D435i at 848 x 480.
    ///
    /// # Panics
    /// Never: the embedded file is read in this crate's tests.
    pub fn d435i() -> Self {
        Self::named("d435i").unwrap_or_else(|e| unreachable!("embedded preset: {e}"))
    }
}

/// The field by which a config names the preset that it changes.
const BASE: &str = "base";

/// The whole table of a config: the entries of its sections take the place of those of its base.
fn with_base(file: &str, text: &str) -> Result<toml::Table, ConfigError> {
    let mut table = parse(file, text)?;
    let Some(base) = table.remove(BASE) else { return Ok(table) };
    let bad = |problem: String| ConfigError { file: file.to_owned(), field: BASE.to_owned(), problem };
    let name = base.as_str().ok_or_else(|| bad("the name of a detector is text".into()))?;
    let mut whole = with_base(name, preset_text(name).map_err(bad)?)?;
    for (key, said) in table {
        match (whole.get_mut(&key), said) {
            (Some(toml::Value::Table(section)), toml::Value::Table(entries)) => section.extend(entries),
            (_, said) => drop(whole.insert(key, said)),
        }
    }
    Ok(whole)
}

fn preset_text(name: &str) -> Result<&'static str, String> {
    let known = DetectorConfig::FILES.iter().find(|(known, _)| *known == name);
    known.map(|(_, text)| *text).ok_or_else(|| {
        let names: Vec<&str> = DetectorConfig::FILES.iter().map(|(known, _)| *known).collect();
        format!("no detector '{name}'; the detectors are: {}", names.join(", "))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_preset_reads_and_a_value_out_of_range_is_named() {
        for (name, text) in DetectorConfig::FILES {
            assert_eq!(
                DetectorConfig::from_toml("x.toml", text).unwrap(),
                DetectorConfig::named(name).unwrap()
            );
        }
        assert_ne!(DetectorConfig::paper(), DetectorConfig::d435i());
        assert!(DetectorConfig::named("d415").unwrap_err().contains("paper, d435i"));
        let other = DetectorConfig::from_toml("x.toml", "base = \"paper\"\n[fit]\nrefine = false\n").unwrap();
        assert_eq!(other.gates, DetectorConfig::paper().gates);
        assert!(!other.fit.refine && other.fit.band == DetectorConfig::paper().fit.band);
        for (text, told) in [
            ("base = 3", "base: the name of a detector is text"),
            ("base = \"d415\"", "base: no detector 'd415'"),
            ("base = \"paper\"\n[fitt]\nrefine = true", "unknown field `fitt`"),
            ("base = \"paper\"\n[fit]\nband = 3", "fit.band"),
            ("base = \"paper\"\nfit = 3", "fit"),
        ] {
            let e = DetectorConfig::from_toml("x.toml", text).unwrap_err().to_string();
            assert!(e.contains(told), "{e}");
        }
        let text = PAPER_TOML.replacen("depth_jump = { value = 15.0", "depth_jump = { value = -1.0", 1);
        let e = DetectorConfig::from_toml("x.toml", &text).unwrap_err().to_string();
        assert!(e.contains("segmentation.depth_jump") && e.contains("-1"), "{e}");
        let text = PAPER_TOML.replacen("depth_jump", "depth_jmp", 1);
        let e = DetectorConfig::from_toml("x.toml", &text).unwrap_err().to_string();
        assert!(e.contains("depth_jmp"), "{e}");
    }
}
