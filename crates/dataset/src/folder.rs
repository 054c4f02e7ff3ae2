//! Folder of a data set: its recipe, its files, and the check of existing files.

use std::fs;
use std::path::{Path, PathBuf};

use orchard_bench::store::{StoreError, write_bytes, write_json};
use serde_json::Value;

use crate::error::DatasetError;
use crate::recipe::{Plan, Recipe};
use crate::record::{TreeRecord, sha256, stem};

/// Folders under it.
const FOLDERS: [&str; 5] = ["color", "depth", "label", "instance", "trees"];
/// Folder of true depth, for cameras with errors.
const TRUE_DEPTH: &str = "true_depth";
/// File name of the recipe, which is written first.
const RECIPE: &str = "recipe.json";

/// A folder that holds this data set or a part of it.
pub(crate) struct Folder {
    root: PathBuf,
    recipe_hash: String,
}

impl Folder {
    /// Opens a folder and creates it if needed.
    ///
    /// # Errors
    /// The folder cannot be created, or it holds something else.
    pub fn open(root: &Path, plan: &Plan) -> Result<Self, DatasetError> {
        let refuse = |problem: String| DatasetError::Folder { folder: root.display().to_string(), problem };
        let wanted = as_json(&plan.recipe);
        match orchard_input::bytes(&root.join(RECIPE), orchard_input::RESULT) {
            Ok(bytes) => {
                let found = serde_json::from_slice(&bytes)
                    .map_err(|e| refuse(format!("its {RECIPE} is damaged: {e}")))?;
                if let Some(difference) = difference("", &found, &wanted) {
                    let advice = "choose another folder or delete this one";
                    return Err(refuse(format!("holds another data set ({difference}): {advice}")));
                }
            }
            Err(e) if !e.is_missing() => return Err(refuse(format!("{RECIPE} there cannot be read: {e}"))),
            Err(_) => {
                fs::create_dir_all(root).map_err(|e| refuse(e.to_string()))?;
                if let Some(name) = something(root).map_err(|e| refuse(e.to_string()))? {
                    return Err(refuse(format!("holds {name} but no data set: choose a new folder")));
                }
                // Writing the first file fails if the folder is not writable.
                write_json(&root.join(RECIPE), &wanted).map_err(|e| match e.is_full() {
                    true => DatasetError::Store(e),
                    false => refuse(e.to_string()),
                })?;
            }
        }
        let true_depth = plan.needs_true_depth().then_some(TRUE_DEPTH);
        for name in FOLDERS.into_iter().chain(true_depth) {
            fs::create_dir_all(root.join(name)).map_err(|e| refuse(format!("{name}: {e}")))?;
        }
        Ok(Self { root: root.to_owned(), recipe_hash: sha256(wanted.to_string().as_bytes()) })
    }

    pub fn recipe_hash(&self) -> &str {
        &self.recipe_hash
    }

    /// Writes a file atomically.
    pub fn write(&self, path: &str, bytes: &[u8]) -> Result<(), StoreError> {
        write_bytes(&self.root.join(path), bytes)
    }

    /// Writes the record of a tree, after its files.
    pub fn write_tree(&self, record: &TreeRecord) -> Result<(), StoreError> {
        write_json(&self.tree_path(record.seed, record.world), record)
    }

    /// The record of a tree if all of its files exist and match their hashes.
    pub fn whole_tree(&self, seed: u64, world: u32, views: u32) -> Option<TreeRecord> {
        let bytes = orchard_input::bytes(&self.tree_path(seed, world), orchard_input::RESULT).ok()?;
        let record: TreeRecord = serde_json::from_slice(&bytes).ok()?;
        let is_this = (&record.recipe, record.seed, record.world) == (&self.recipe_hash, seed, world);
        let is_there = |path: &str, hash: &str| {
            let bytes = orchard_input::bytes(&self.root.join(path), orchard_input::RESULT);
            bytes.is_ok_and(|bytes| sha256(&bytes) == hash)
        };
        let whole = is_this
            && record.views.len() == views as usize
            && record
                .views
                .iter()
                .flat_map(|view| view.files.all())
                .all(|file| is_there(&file.path, &file.sha256));
        whole.then_some(record)
    }

    /// Removes a file, if there.
    pub fn remove(&self, path: &str) {
        // A file that cannot be removed cannot be replaced either; the later write reports the error.
        let _ = fs::remove_file(self.root.join(path));
    }

    fn tree_path(&self, seed: u64, world: u32) -> PathBuf {
        self.root.join("trees").join(format!("{}.json", stem(seed, world)))
    }
}

fn as_json(recipe: &Recipe) -> Value {
    serde_json::to_value(recipe).unwrap_or_else(|e| unreachable!("texts and numbers are JSON: {e}"))
}

/// Returns the name of a file in a folder, except temporary files of a killed run.
fn something(root: &Path) -> std::io::Result<Option<String>> {
    for entry in fs::read_dir(root)? {
        let name = entry?.file_name().to_string_lossy().into_owned();
        if !name.starts_with(".writing-") {
            return Ok(Some(name));
        }
    }
    Ok(None)
}

/// The first field in which a recipe differs from the stored one.
fn difference(field: &str, found: &Value, wanted: &Value) -> Option<String> {
    if let (Value::Object(found), Value::Object(wanted)) = (found, wanted) {
        // The hash differs if any field that it covers does, so a named field is reported first.
        let last = |name: &&String| matches!(name.as_str(), "config_hash" | "code_version");
        let names = || found.keys().chain(wanted.keys().filter(|name| !found.contains_key(*name)));
        let ordered = names().filter(|name| !last(name)).chain(names().filter(last));
        return ordered.into_iter().find_map(|name| {
            let field = if field.is_empty() { name.clone() } else { format!("{field}.{name}") };
            difference(
                &field,
                found.get(name).unwrap_or(&Value::Null),
                wanted.get(name).unwrap_or(&Value::Null),
            )
        });
    }
    (found != wanted).then(|| format!("its {field} is {found}, not {wanted}"))
}
