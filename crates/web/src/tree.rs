//! Digitised trees that a visitor opens, as `--tree FILE` takes them.

use orchard_digitised::TreeFile;

use crate::ask::Ask;
use crate::parts::{AskError, shown};

/// The file of a digitised tree, as it was opened.
#[derive(Debug, Clone, Default)]
pub struct TreeBytes {
    /// Name of the file; its extension gives the format.
    pub name: String,
    /// Content.
    pub bytes: Vec<u8>,
}

/// Reads the tree that the options name; `None` if they name none and the tree is grown.
///
/// # Errors
/// The file of another name or none, one that is too large, or one that holds no valid tree.
pub(crate) fn read(ask: &Ask, given: Option<&TreeBytes>) -> Result<Option<TreeFile>, AskError> {
    let Some(name) = &ask.tree_file else {
        let extra = [("tree_unit", &ask.tree_unit), ("tree_plant", &ask.tree_plant)];
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
    let (unit, plant) = (ask.tree_unit.clone(), ask.tree_plant.clone());
    TreeFile::of_bytes(name, given.bytes.clone(), unit, plant).map(Some).map_err(refuse)
}
