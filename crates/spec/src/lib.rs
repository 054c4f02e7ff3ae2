//! Typed simulation config and named, seeded, portable random streams.
//!
//! [`Spec`] defines a world besides its seed: growth, wood, fruit, leaves, camera and time stepping. The preset `paper` ([`Spec::paper`]) holds the figures
//! of the OrchardBench paper. Robot, detector and picker keep their config in their own crates, so that detector and picker
//! need not depend on this one, which could regrow the tree from a seed.

mod axis;
mod figure;
mod preset;
mod streams;

pub mod camera;
pub mod episode;
pub mod fault;
pub mod foliage;
pub mod fruit;
pub mod light;
pub mod randomisation;
pub mod scenery;
pub mod sensing;
pub mod sim;
pub mod terrain;
pub mod tree;
pub mod wind;
pub mod wood;

pub use preset::Preset;
pub use streams::{Purpose, Stream};

use orchard_quantity::ConfigError;
use serde::{Deserialize, Serialize};

/// Definition of a world besides its seed and its robot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spec {
    /// Name of the preset, written into results.
    pub preset: String,
    /// Time, gravity and contact.
    pub sim: sim::SimSpec,
    /// Bumps of the ground.
    pub terrain: terrain::TerrainSpec,
    /// Growth of the tree.
    pub tree: tree::TreeSpec,
    /// Material and rupture.
    pub wood: wood::WoodSpec,
    /// Apples and stems.
    pub fruit: fruit::FruitSpec,
    /// Leaf density, size and shape.
    pub foliage: foliage::FoliageSpec,
    /// The depth camera.
    pub camera: camera::CameraSpec,
    /// Robot start and reach rule.
    pub episode: episode::EpisodeSpec,
    /// Variation from world to world.
    pub randomisation: randomisation::RandomisationSpec,
    /// Posts and wires; absent for a tree that stands alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scenery: Option<scenery::ScenerySpec>,
    /// Wind; absent for still air.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wind: Option<wind::WindSpec>,
    /// Errors and delays of the robot's sensors; absent for exact ones without delay.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sensing: Option<sensing::SensingSpec>,
    /// Light of colour images; absent for a clear day.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub light: Option<light::LightSpec>,
    /// A fault of sensors or hand, or a limb that falls; absent if nothing fails.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fault: Option<fault::FaultSpec>,
}

impl Spec {
    /// Reads a spec from TOML text; `file` names it in errors. With `base = "NAME"` the text holds only the
    /// differences from that preset: a constant (value or interval, range, unit, source), a grammar or a camera replaces the
    /// preset's, and omitted fields keep the preset's values.
    ///
    /// # Errors
    /// Not TOML, no such base, a field missing or unknown, a value outside its range.
    pub fn from_toml(file: &str, text: &str) -> Result<Self, ConfigError> {
        preset::read(file, text)
    }

    /// Returns a preset.
    ///
    /// # Panics
    /// Never: the embedded files are read in this crate's tests.
    pub fn preset(preset: Preset) -> Self {
        match Self::from_toml(preset.name(), preset.toml()) {
            Ok(spec) => spec,
            Err(e) => unreachable!("embedded preset: {e}"),
        }
    }

    /// Returns the preset `paper`.
    pub fn paper() -> Self {
        Self::preset(Preset::Paper)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_field_and_value_out_of_range_are_named() {
        let paper = Preset::Paper.toml();
        let text = paper.replacen("density = {", "densty = {", 1);
        let e = Spec::from_toml("x.toml", &text).unwrap_err().to_string();
        assert!(e.starts_with("x.toml: wood") && e.contains("densty"), "{e}");

        let text = paper.replacen("density = { value = 850.0", "density = { value = 8.5", 1);
        let e = Spec::from_toml("x.toml", &text).unwrap_err().to_string();
        assert!(e.contains("wood.density") && e.contains("8.5") && e.contains("[780, 1000]"), "{e}");
    }
}
