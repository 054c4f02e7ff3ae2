//! Digitised trees that replace grown ones.

use std::path::Path;

use orchard_exchange::{DigitisedTree, json, mtg};
use orchard_spec::Spec;
use orchard_treegen::Skeleton;
use serde::{Deserialize, Serialize};

/// Format of a tree's file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TreeFormat {
    /// A skeleton in JSON.
    Json,
    /// A multiscale tree graph.
    Mtg,
}

/// The file of a digitised tree, read and checked.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "RawTree", into = "RawTree")]
pub struct TreeFile {
    name: String,
    format: TreeFormat,
    text: String,
    unit: Option<String>,
    plant: Option<String>,
    tree: DigitisedTree,
    notes: Vec<String>,
}

/// The form of a tree's file in results.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawTree {
    name: String,
    format: TreeFormat,
    text: String,
    /// Units of an MTG file, if they were given beside it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    unit: Option<String>,
    /// Plant of an MTG file, if it was chosen.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    plant: Option<String>,
}

impl TryFrom<RawTree> for TreeFile {
    type Error = String;

    fn try_from(raw: RawTree) -> Result<Self, String> {
        Self::parse(raw)
    }
}

impl From<TreeFile> for RawTree {
    fn from(file: TreeFile) -> Self {
        Self { name: file.name, format: file.format, text: file.text, unit: file.unit, plant: file.plant }
    }
}

impl TreeFile {
    /// Reads a file; its extension gives the format. An MTG file may need the units of its lengths and diameters, and has one or more
    /// plants (see [`mtg::Choice`]).
    ///
    /// # Errors
    /// Another extension, a file that cannot be read, a file that holds no valid tree, or a unit or plant that is not of its format.
    pub fn read(path: &Path, unit: Option<String>, plant: Option<String>) -> Result<Self, String> {
        let format = match path.extension().and_then(|extension| extension.to_str()) {
            Some("json") => TreeFormat::Json,
            Some("mtg") => TreeFormat::Mtg,
            _ => return Err("the file name must end in .json or .mtg".to_owned()),
        };
        let text = match format {
            TreeFormat::Json => orchard_input::text(path, orchard_input::TREE),
            TreeFormat::Mtg => orchard_input::latin_text(path, orchard_input::TREE),
        };
        let text = text.map_err(|e| e.to_string())?;
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Self::parse(RawTree { name, format, text, unit, plant })
    }

    fn parse(raw: RawTree) -> Result<Self, String> {
        let RawTree { name, format, text, unit, plant } = raw;
        let (tree, notes) = match format {
            TreeFormat::Json if unit.is_some() || plant.is_some() => {
                return Err(
                    "a tree in JSON is one plant in metres; a unit and a plant are of MTG files".to_owned()
                );
            }
            TreeFormat::Json => (json::read(&text).map_err(|e| e.to_string())?, Vec::new()),
            TreeFormat::Mtg => {
                let units = unit.as_deref().map(str::parse).transpose();
                let units = units.map_err(|e| format!("the unit {e}"))?;
                let choice = mtg::Choice { units, plant: plant.clone() };
                let import = mtg::read_with(&text, &choice).map_err(|e| e.to_string())?;
                (import.tree, import.notes)
            }
        };
        Ok(Self { name, format, text, unit, plant, tree, notes })
    }

    /// Assumptions made when the file was read, one sentence each.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Name of the file.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The tree as a skeleton. Seed and world determine its leaves if the file has none.
    pub fn skeleton(&self, spec: &Spec, seed: u64, world: u32) -> Skeleton {
        self.tree.clone().into_skeleton(spec, seed, world)
    }
}
