//! Folder of a data set: its recipe, its files, and the check of existing files.

use std::fs;
use std::path::Path;

use orchard_bench::checksum::Damage;
use orchard_bench::lock::{LOCK_FILE, Lock, LockError};
use orchard_bench::store::{Store, StoreError, encode, encode_plain};
use serde_json::Value;

use crate::error::DatasetError;
use crate::recipe::{Plan, Recipe};
use crate::record::{TreeRecord, sha256, stem};

/// Folders under it.
const FOLDERS: [&str; 5] = ["color", "depth", "label", "instance", "trees"];
/// Folder of true depth, for cameras with errors.
const TRUE_DEPTH: &str = "true_depth";
/// File name of the recipe, which is written first.
pub(crate) const RECIPE: &str = "recipe.json";

/// A folder that holds a data set or a part of it, locked: no other process writes into it.
#[derive(Debug)]
pub struct Folder {
    store: Store,
    recipe_hash: String,
    _lock: Lock,
}

/// A tree's record as it was found.
pub(crate) enum StoredTree {
    /// The record and all its files match their checksums.
    Whole(Box<TreeRecord>),
    /// There is no record, or one of another recipe.
    Missing,
    /// The record does not match its checksum, or a file does not match the record. Holds the file.
    Changed(String),
}

impl Folder {
    /// Opens and locks a folder and creates it if needed.
    ///
    /// # Errors
    /// The folder cannot be created, another process has locked it, or it holds something else.
    pub fn open(root: &Path, plan: &Plan) -> Result<Self, DatasetError> {
        let refuse = |problem: String| DatasetError::Folder { folder: root.display().to_string(), problem };
        let wanted = as_json(&plan.recipe);
        // Nothing is written into a folder that holds something else, not even the lock.
        if root.exists() && !root.join(RECIPE).exists() {
            check_empty(root).map_err(refuse)?;
        }
        let store = Store::open(root).map_err(|e| refuse(e.to_string()))?;
        let lock = store.lock().map_err(|e| match e {
            LockError::Busy(_) => refuse("another run is using this folder: wait until it ends".to_owned()),
            LockError::Store(e) => refuse(e.to_string()),
        })?;
        match store.read(RECIPE) {
            Ok(Some(content)) => {
                let found = serde_json::from_slice(&content)
                    .map_err(|e| refuse(format!("its {RECIPE} is damaged: {e}")))?;
                if let Some(difference) = difference("", &found, &wanted) {
                    let advice = "choose another folder or delete this one";
                    return Err(refuse(format!("holds another data set ({difference}): {advice}")));
                }
            }
            Ok(None) => {
                // Another run may have ended between the first look and the lock.
                check_empty(root).map_err(refuse)?;
                // Writing the first file fails if the folder is not writable.
                store.write(RECIPE, &plan.recipe).map_err(|e| refuse(e.to_string()))?;
            }
            Err(e) => {
                let damage = match e.damage() {
                    Some(Damage::WrongChecksum) => "does not match its checksum".to_owned(),
                    Some(Damage::NoChecksum) => "has no checksum".to_owned(),
                    None => e.to_string(),
                };
                let advice = "choose another folder or delete this one";
                return Err(refuse(format!(
                    "its {RECIPE} is damaged or of another code version ({damage}): {advice}"
                )));
            }
        }
        let true_depth = plan.needs_true_depth().then_some(TRUE_DEPTH);
        for name in FOLDERS.into_iter().chain(true_depth) {
            store.make_folder(name).map_err(|e| refuse(e.to_string()))?;
        }
        Ok(Self { store, recipe_hash: sha256(wanted.to_string().as_bytes()), _lock: lock })
    }

    /// The folder's files, to write more of them, as previews, while it is locked.
    pub fn store(&self) -> &Store {
        &self.store
    }

    pub(crate) fn recipe_hash(&self) -> &str {
        &self.recipe_hash
    }

    /// Writes the record of a tree, after its files.
    pub(crate) fn write_tree(&self, record: &TreeRecord) -> Result<(), StoreError> {
        self.store.write(&tree_file(record.seed, record.world), record)
    }

    /// The record of a tree, if all of its files exist and match their checksums.
    pub(crate) fn stored_tree(&self, seed: u64, world: u32, views: u32) -> StoredTree {
        let path = tree_file(seed, world);
        let content = match self.store.read(&path) {
            Ok(Some(content)) => content,
            Ok(None) => return StoredTree::Missing,
            Err(_) => return StoredTree::Changed(path),
        };
        let Ok(record) = serde_json::from_slice::<TreeRecord>(&content) else {
            return StoredTree::Changed(path);
        };
        // The manifest holds the hash of the file as this code writes it.
        if encode_plain(&record).ok().as_ref() != Some(&content) {
            return StoredTree::Changed(path);
        }
        if (&record.recipe, record.seed, record.world) != (&self.recipe_hash, seed, world)
            || record.views.len() != views as usize
        {
            return StoredTree::Missing;
        }
        let files = || record.views.iter().flat_map(|view| view.files.all());
        let edited = files().find(|file| self.hash(&file.path).as_ref() != Some(&file.sha256));
        match edited.map(|file| file.path.clone()) {
            Some(path) => StoredTree::Changed(path),
            None => StoredTree::Whole(Box::new(record)),
        }
    }

    /// SHA-256 of a file, hexadecimal; `None` if it cannot be read.
    pub(crate) fn hash(&self, path: &str) -> Option<String> {
        fs::read(self.store.path().join(path)).ok().map(|bytes| sha256(&bytes))
    }
}

/// Path of the record of a tree under the folder.
pub(crate) fn tree_file(seed: u64, world: u32) -> String {
    format!("trees/{}.json", stem(seed, world))
}

/// SHA-256 of a JSON file as the store writes it, hexadecimal.
pub(crate) fn file_hash(value: &impl serde::Serialize) -> String {
    sha256(&encode(value).unwrap_or_else(|e| unreachable!("records of numbers and texts are JSON: {e}")))
}

/// Checks that a folder holds nothing but what a run leaves that was killed before its first file.
fn check_empty(root: &Path) -> Result<(), String> {
    match something(root).map_err(|e| e.to_string())? {
        Some(name) => Err(format!("holds {name} but no data set: choose a new folder")),
        None => Ok(()),
    }
}

fn as_json(recipe: &Recipe) -> Value {
    serde_json::to_value(recipe).unwrap_or_else(|e| unreachable!("texts and numbers are JSON: {e}"))
}

/// Returns the name of a file in a folder, except the lock and temporary files of a killed run.
fn something(root: &Path) -> std::io::Result<Option<String>> {
    for entry in fs::read_dir(root)? {
        let name = entry?.file_name().to_string_lossy().into_owned();
        if name != LOCK_FILE && !name.starts_with(".writing-") {
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
