//! What is kept of one piece of work.

use serde::Serialize;
use serde::de::DeserializeOwned;

/// What one result file holds.
pub trait Record: Serialize + DeserializeOwned {
    /// What the record is a function of. A stored record is reused only if all of this is equal.
    type Key: PartialEq + Serialize + Sync;
    /// Folder of these records under the result folder.
    const FOLDER: &'static str;
    /// The record's own key.
    fn key(&self) -> &Self::Key;
    /// Name of the file of a key in [`Self::FOLDER`].
    fn file(key: &Self::Key) -> String;
    /// The same under the result folder.
    fn path(key: &Self::Key) -> String {
        format!("{}/{}", Self::FOLDER, Self::file(key))
    }
}
