//! What trees a command works on: a preset or a config file, and a digitised tree in place of a grown one.

use std::path::{Path, PathBuf};

use orchard_exchange::{json, mtg};
use orchard_spec::{Preset, Spec};
use orchard_treegen::Skeleton;

use crate::failure::Failure;
use crate::sensing_args::read_camera;

/// The config that defines the worlds.
#[derive(clap::Args)]
pub struct SpecArgs {
    /// Configuration that comes with the project [default: paper, but for verify randomised]
    #[arg(long, value_name = "NAME", conflicts_with = "config")]
    preset: Option<Preset>,
    /// Configuration file; with a name of its own and `base = "NAME"` it holds only what differs from that preset
    #[arg(long, value_name = "FILE.toml")]
    config: Option<PathBuf>,
    /// Depth camera in place of the configuration's: ideal, paper, d435i, or a file of figures that differ
    #[arg(long, value_name = "NAME|FILE.toml")]
    camera: Option<String>,
}

impl SpecArgs {
    /// Reads it.
    pub fn read(&self) -> Result<Spec, Failure> {
        self.read_or(Preset::Paper)
    }

    /// Reads it, with a default of the command's own.
    pub fn read_or(&self, default: Preset) -> Result<Spec, Failure> {
        let mut spec = match &self.config {
            None => Spec::preset(self.preset.unwrap_or(default)),
            Some(file) => {
                let name = file.display().to_string();
                let text = std::fs::read_to_string(file)
                    .map_err(|e| Failure::BadInput(format!("--config {name}: {e}")))?;
                Spec::from_toml(&name, &text).map_err(|e| Failure::BadInput(e.to_string()))?
            }
        };
        if let Some(camera) = &self.camera {
            spec.camera = read_camera(camera)?;
        }
        Ok(spec)
    }
}

/// Reads a digitised tree; the ending of the file's name tells the format. Seed and world draw its leaves where the file
/// has none.
pub fn read_tree(file: &Path, spec: &Spec, seed: u64, world: u32) -> Result<Skeleton, Failure> {
    let bad = |problem: String| Failure::BadInput(format!("--from {}: {problem}", file.display()));
    let read = match file.extension().and_then(|extension| extension.to_str()) {
        Some("json") => json::read,
        Some("mtg") => mtg::read,
        _ => return Err(bad("trees are read from .json and .mtg".into())),
    };
    let text = std::fs::read_to_string(file).map_err(|e| bad(e.to_string()))?;
    Ok(read(&text).map_err(|e| bad(e.to_string()))?.into_skeleton(spec, seed, world))
}
