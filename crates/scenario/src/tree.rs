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
    tree: DigitisedTree,
}

/// The form of a tree's file in results.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawTree {
    name: String,
    format: TreeFormat,
    text: String,
}

impl TryFrom<RawTree> for TreeFile {
    type Error = String;

    fn try_from(raw: RawTree) -> Result<Self, String> {
        Self::parse(raw.name, raw.format, raw.text)
    }
}

impl From<TreeFile> for RawTree {
    fn from(file: TreeFile) -> Self {
        Self { name: file.name, format: file.format, text: file.text }
    }
}

impl TreeFile {
    /// Reads a file; its extension gives the format.
    ///
    /// # Errors
    /// Another extension, a file that cannot be read, or a file that holds no valid tree.
    pub fn read(path: &Path) -> Result<Self, String> {
        let format = match path.extension().and_then(|extension| extension.to_str()) {
            Some("json") => TreeFormat::Json,
            Some("mtg") => TreeFormat::Mtg,
            _ => return Err("the file name must end in .json or .mtg".to_owned()),
        };
        let text = orchard_input::text(path, orchard_input::TREE).map_err(|e| e.to_string())?;
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Self::parse(name, format, text)
    }

    fn parse(name: String, format: TreeFormat, text: String) -> Result<Self, String> {
        let tree = match format {
            TreeFormat::Json => json::read(&text),
            TreeFormat::Mtg => mtg::read(&text),
        };
        Ok(Self { name, format, tree: tree.map_err(|e| e.to_string())?, text })
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
