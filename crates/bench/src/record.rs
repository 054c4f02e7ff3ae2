//! Records: the result of one piece of work.

use serde::Serialize;
use serde::de::DeserializeOwned;

/// A record: the content of one result file.
pub trait Record: Serialize + DeserializeOwned {
    /// All inputs that determine the record. A stored record is reused only if all of them are equal.
    type Key: PartialEq + Serialize + Sync;
    /// Folder of these records under the result folder.
    const FOLDER: &'static str;
    /// Fields of a key that a record leaves out where they have their default.
    const OPTIONAL: &'static [&'static str] = &[];
    /// The record's own key.
    fn key(&self) -> &Self::Key;
    /// Name of the file of a key in [`Self::FOLDER`].
    fn file(key: &Self::Key) -> String;
    /// Path of the file of a key under the result folder.
    fn path(key: &Self::Key) -> String {
        format!("{}/{}", Self::FOLDER, Self::file(key))
    }
}
