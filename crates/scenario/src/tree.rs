//! Digitised trees that replace grown ones.

use std::path::Path;

use orchard_digitised::{TreeFile, TreeFormat};

/// Reads the file of a digitised tree.
///
/// # Errors
/// A file that cannot be read, and all of [`TreeFile::of_bytes`].
pub(crate) fn read(path: &Path, unit: Option<String>, plant: Option<String>) -> Result<TreeFile, String> {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    // Before a large file of another kind is read.
    TreeFormat::of_name(&name)?;
    let bytes = orchard_input::bytes(path, orchard_input::TREE).map_err(|e| e.to_string())?;
    TreeFile::of_bytes(&name, bytes, unit, plant)
}
