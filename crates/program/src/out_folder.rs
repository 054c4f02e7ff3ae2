//! Folders that commands write into.

use std::path::Path;

use orchard_bench::lock::Lock;
use orchard_bench::store::Store;

use crate::failure::Failure;

/// Opens a folder, which is made if needed, for this process alone, and removes what an earlier process left half written. `what` is the
/// option or argument that names the folder.
pub fn open_folder(what: &str, folder: &Path) -> Result<(Store, Lock), Failure> {
    let bad = |e: &dyn std::fmt::Display| Failure::BadInput(format!("{what}: {e}"));
    let store = Store::open(folder).map_err(|e| bad(&e))?;
    let lock = store.lock().map_err(|e| bad(&e))?;
    Ok((store, lock))
}
