//! Gathers stored records without computing any.

use std::fs;
use std::path::Path;

use crate::record::Record;
use crate::store::{Store, StoreError, Stored, encode};
use crate::task::Task;

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
    /// Two files of one record differ.
    #[error("{first} and {second} are copies of one record and differ{why}: delete the wrong one")]
    Differ {
        /// File of the copy that is read first.
        first: String,
        /// File of another copy.
        second: String,
        /// Addition to the message: what is wrong with the second one, if that is known.
        why: &'static str,
    },
    /// A file cannot be written.
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

/// Gathers all records of a task and writes them into one folder, from which the task's summary is removed; `task::finish` writes
/// the new one.
///
/// # Errors
/// A record that no folder holds, or copies of a record that differ (nothing is written then), or a file that cannot be written.
pub fn merge<T: Task>(task: &T, from: &[&Store], into: &Store) -> Result<Vec<T::Record>, MergeError> {
    let records = gather::<T::Record>(&task.keys(), from)?;
    let all: Vec<&Store> = from.iter().copied().chain([into]).collect();
    records.iter().try_for_each(|record| check_copies(record, &all))?;
    // An old summary would not describe the new records.
    into.remove(T::SUMMARY)?;
    for record in &records {
        into.write_record(record)?;
    }
    Ok(records)
}

/// Checks that all copies of a record in some folders have the same bytes. Records of another key, as of older code, are no copies.
fn check_copies<R: Record>(record: &R, stores: &[&Store]) -> Result<(), MergeError> {
    let path = R::path(record.key());
    let own = encode(record).map_err(|e| StoreError::new(Path::new(&path), e))?;
    let file = |store: &Store| store.path().join(&path);
    let is_own = |store: &&&Store| fs::read(file(store)).is_ok_and(|bytes| bytes == own);
    let first =
        stores.iter().find(is_own).map_or_else(String::new, |store| file(store).display().to_string());
    for store in stores.iter().filter(|store| !is_own(store)) {
        let why = match store.stored::<R>(record.key()) {
            Stored::Missing | Stored::Other => continue,
            Stored::Whole(_) => "",
            Stored::Damaged => " (the second one is damaged or was edited)",
        };
        return Err(MergeError::Differ { first, second: file(store).display().to_string(), why });
    }
    Ok(())
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
    use crate::fake::{Sum, keys, record};
    use crate::fake_task::Sums;

    #[test]
    fn parts_make_a_whole_or_tell_what_is_missing() {
        let folders = [0, 1, 2].map(|_| tempfile::tempdir().unwrap());
        let stores = [0, 1, 2].map(|i| Store::open(folders[i].path()).unwrap());
        let task = Sums(keys()[..3].to_vec());
        let records = [0, 1, 2].map(record);
        stores[0].write_record(&records[0]).unwrap();
        stores[1].write_record(&records[1]).unwrap();
        let from = [&stores[0], &stores[1]];
        stores[2].write("sums.json", &records[0]).unwrap();
        let e = merge(&task, &from, &stores[2]).unwrap_err().to_string();
        assert_eq!(e, "1 of 3 sums are missing; the first is sums/fake-7-002.json: there is no such file");
        // Nothing was written or removed.
        assert!(stores[2].files("sums").is_empty() && folders[2].path().join("sums.json").exists());

        stores[1].write_record(&records[2]).unwrap();
        assert_eq!(merge(&task, &from, &stores[2]).unwrap(), records);
        assert!(!folders[2].path().join("sums.json").exists());
        assert_eq!(gather::<Sum>(&task.0, &[&stores[2]]).unwrap(), records);

        let file = folders[2].path().join("sums/fake-7-001.json");
        let text = std::fs::read_to_string(&file).unwrap();
        for (from, to) in [("\"sum\": 8", "\"sum\":  8"), ("\"sum\": 8", "\"sum\": 9")] {
            std::fs::write(&file, text.replace(from, to)).unwrap();
            let e = gather::<Sum>(&task.0, &[&stores[2]]).unwrap_err();
            assert!(e.problem.ends_with("is damaged or was edited"), "{e}");
        }
    }

    #[test]
    fn copies_that_differ_are_refused() {
        let folders = [0, 1, 2].map(|_| tempfile::tempdir().unwrap());
        let stores = [0, 1, 2].map(|i| Store::open(folders[i].path()).unwrap());
        let task = Sums(keys()[..1].to_vec());
        let file = |i: usize| folders[i].path().join("sums/fake-7-000.json");
        stores.iter().for_each(|store| store.write_record(&record(0)).unwrap());
        let [from, into] = [[&stores[0], &stores[1]], [&stores[2]; 2]];
        assert_eq!(merge(&task, &from, into[0]).unwrap(), [record(0)]);

        // Another number with a fitting checksum, in either order and in the target; then a careless edit.
        let whole = std::fs::read_to_string(file(0)).unwrap();
        for (i, careless) in [(0, false), (1, false), (2, false), (0, true), (1, true), (2, true)] {
            if careless {
                std::fs::write(file(i), whole.replace("\"sum\": 7", "\"sum\": 8")).unwrap();
            } else {
                stores[i].write_record(&Sum { sum: 8, ..record(0) }).unwrap();
            }
            let before = std::fs::read_to_string(file(2)).unwrap();
            let e = merge(&task, &from, into[0]).unwrap_err().to_string();
            for other in [i, usize::from(i == 0)] {
                assert!(e.contains(&file(other).display().to_string()), "{i}: {e}");
            }
            assert_eq!(e.contains("the second one is damaged or was edited"), careless, "{e}");
            assert_eq!(std::fs::read_to_string(file(2)).unwrap(), before);
            std::fs::write(file(i), &whole).unwrap();
        }
    }
}
