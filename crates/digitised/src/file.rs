//! Files of digitised trees that replace grown ones.

use orchard_spec::Spec;
use orchard_treegen::Skeleton;
use serde::{Deserialize, Serialize};

use crate::{DigitisedTree, json, mtg};

/// Format of a tree's file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TreeFormat {
    /// A skeleton in JSON.
    Json,
    /// A multiscale tree graph.
    Mtg,
}

impl TreeFormat {
    /// The format of a file by the extension of its name.
    ///
    /// # Errors
    /// Another extension.
    pub fn of_name(name: &str) -> Result<Self, String> {
        match name.rsplit_once('.') {
            Some((_, "json")) => Ok(Self::Json),
            Some((_, "mtg")) => Ok(Self::Mtg),
            _ => Err("the file name must end in .json or .mtg".to_owned()),
        }
    }
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
    /// Reads the bytes of a file; the extension of its name gives the format. JSON is in UTF-8; MTG is, too, or else in Latin-1, in which every byte
    /// is a character. An MTG file may need the units of its lengths and diameters, and has one or more plants (see [`mtg::Choice`]).
    ///
    /// # Errors
    /// Another extension, bytes that are no text, text that holds no valid tree, or a unit or plant that is not of its format.
    pub fn of_bytes(
        name: &str,
        bytes: Vec<u8>,
        unit: Option<String>,
        plant: Option<String>,
    ) -> Result<Self, String> {
        let format = TreeFormat::of_name(name)?;
        let text = String::from_utf8(bytes).or_else(|e| match format {
            TreeFormat::Mtg => Ok(e.into_bytes().into_iter().map(char::from).collect()),
            TreeFormat::Json => {
                let at = e.utf8_error().valid_up_to();
                Err(format!("is not text in UTF-8: byte {at} cannot be read"))
            }
        })?;
        Self::parse(RawTree { name: name.to_owned(), format, text, unit, plant })
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
