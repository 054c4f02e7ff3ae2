//! Gathers stored records without computing any.

use crate::record::Record;
use crate::store::{Store, StoreError, Stored};

/// Error: no folder holds some records of a plan.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{missing} of {total} {folder} are missing; the first is {first}: {problem}")]
pub struct Missing {
    /// Folder of the records.
    pub folder: &'static str,
    /// The first one's file.
    pub first: String,
    /// Problem with its file.
    pub problem: String,
    /// Number of missing records.
    pub missing: usize,
    /// Number of records in the plan.
    pub total: usize,
}

/// Error of a merge.
#[derive(Debug, thiserror::Error)]
pub enum MergeError {
    /// Records are missing.
    #[error(transparent)]
    Missing(#[from] Missing),
    /// A record cannot be written.
    #[error(transparent)]
    Store(#[from] StoreError),
}

/// The records of all keys, each from the first folder that holds it complete, in the order of the keys.
///
/// # Errors
/// A record that no folder holds as this code writes it.
pub fn gather<R: Record>(keys: &[R::Key], stores: &[&Store]) -> Result<Vec<R>, Missing> {
    let mut records = Vec::with_capacity(keys.len());
    let mut missing: Option<Missing> = None;
    for key in keys {
        match find(key, stores) {
            Ok(record) => records.push(record),
            Err(problem) => {
                let (folder, total) = (R::FOLDER, keys.len());
                let first = R::path(key);
                missing.get_or_insert(Missing { folder, first, problem, missing: 0, total }).missing += 1;
            }
        }
    }
    missing.map_or(Ok(records), Err)
}

/// Gathers the records of all keys and writes them into one folder.
///
/// # Errors
/// A record that no folder holds (nothing is written then), or a file that cannot be written.
pub fn merge<R: Record>(keys: &[R::Key], from: &[&Store], into: &Store) -> Result<Vec<R>, MergeError> {
    let records = gather::<R>(keys, from)?;
    for record in &records {
        into.write_record(record)?;
    }
    Ok(records)
}

fn find<R: Record>(key: &R::Key, stores: &[&Store]) -> Result<R, String> {
    let mut problem = "there is no such file".to_owned();
    for store in stores {
        let file = || store.path().join(R::path(key)).display().to_string();
        match store.stored::<R>(key) {
            Stored::Whole(record) => return Ok(*record),
            Stored::Missing => {}
            Stored::Damaged => problem = format!("{} is damaged or was edited", file()),
            Stored::Other => {
                problem = format!("{} belongs to another plan, config or code version", file());
            }
        }
    }
    Err(problem)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fake::{Sum, record};

    #[test]
    fn parts_make_a_whole_or_tell_what_is_missing() {
        let folders = [0, 1, 2].map(|_| tempfile::tempdir().unwrap());
        let stores = [0, 1, 2].map(|i| Store::open(folders[i].path()).unwrap());
        let records = [0, 1, 2].map(record);
        let keys = records.clone().map(|record| record.key);
        stores[0].write_record(&records[0]).unwrap();
        stores[1].write_record(&records[1]).unwrap();
        let from = [&stores[0], &stores[1]];
        let e = merge::<Sum>(&keys, &from, &stores[2]).unwrap_err().to_string();
        assert_eq!(e, "1 of 3 sums are missing; the first is sums/fake-7-002.json: there is no such file");
        assert!(stores[2].files("sums").is_empty());

        stores[1].write_record(&records[2]).unwrap();
        assert_eq!(merge::<Sum>(&keys, &from, &stores[2]).unwrap(), records);
        assert_eq!(gather::<Sum>(&keys, &[&stores[2]]).unwrap(), records);

        let file = folders[2].path().join("sums/fake-7-001.json");
        let text = std::fs::read_to_string(&file).unwrap();
        std::fs::write(&file, text.replace("\"sum\": 8", "\"sum\":  8")).unwrap();
        let e = gather::<Sum>(&keys, &[&stores[2]]).unwrap_err();
        assert!(e.problem.ends_with("is damaged or was edited"), "{e}");
    }
}
