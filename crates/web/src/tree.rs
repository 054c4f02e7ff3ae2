//! Digitised trees that a visitor opens, as `--tree FILE` takes them.

use orchard_digitised::TreeFile;

use crate::parts::{AskError, shown};

/// The file of a digitised tree, as it was opened.
#[derive(Debug, Clone, Default)]
pub struct TreeBytes {
    /// Name of the file; its extension gives the format.
    pub name: String,
    /// Content.
    pub bytes: Vec<u8>,
}

/// Options of a tree from a file: its name, and units and plant of an MTG file.
pub(crate) struct Named<'a> {
    pub file: Option<&'a String>,
    pub unit: Option<&'a String>,
    pub plant: Option<&'a String>,
}

/// Reads the tree that options name; `None` if they name none and the tree is grown.
///
/// # Errors
/// The file of another name or none, one that is too large, or one that holds no valid tree.
pub(crate) fn read(named: &Named<'_>, given: Option<&TreeBytes>) -> Result<Option<TreeFile>, AskError> {
    let Some(name) = named.file else {
        let extra = [("tree_unit", named.unit), ("tree_plant", named.plant)];
        return match extra.into_iter().find(|(_, value)| value.is_some()) {
            Some((field, _)) => {
                Err(AskError(format!("{field} is of a tree from a file, and no file is named")))
            }
            None => Ok(None),
        };
    };
    let refuse = |problem: String| AskError(format!("tree {}: {problem}", shown(name)));
    let Some(given) = given.filter(|given| given.name == *name) else {
        return Err(refuse(format!("its file is not here: open {}", shown(name))));
    };
    if given.bytes.len() as u64 > orchard_input::TREE {
        return Err(refuse(format!(
            "has more than {} bytes, the largest size that is read",
            orchard_input::TREE
        )));
    }
    let (unit, plant) = (named.unit.cloned(), named.plant.cloned());
    TreeFile::of_bytes(name, given.bytes.clone(), unit, plant).map(Some).map_err(refuse)
}
