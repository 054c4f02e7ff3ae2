//! Check of a result folder before a run: its records must be of the plan that is to be run.
//!
//! Two plans in one folder would overwrite each other's summary, so the second is refused. A record belongs to a plan if the
//! fields of its key are those of a key of the plan; a larger plan reuses the records of a smaller one. For a record of another
//! code version neither the version nor the config hash is compared: such records are computed again.

use std::collections::BTreeSet;

use serde_json::{Map, Value};

use crate::checksum::{Damage, checked};
use crate::record::Record;
use crate::store::Store;

/// A result folder that holds records of another plan.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "{folder} holds results of another plan: {file} has {differences}; choose another --out or delete that folder"
)]
pub struct OtherPlan {
    folder: String,
    file: String,
    differences: String,
}

/// Fields of a key that identify the code that wrote a record.
const CODE: [&str; 2] = ["schema_version", "code_version"];
/// The field that covers all config texts.
const CONFIG: &str = "config_hash";

impl Store {
    /// Checks that the folder holds no records of the plan's task other than the plan's. Files that cannot be parsed are ignored.
    ///
    /// # Errors
    /// The first record, by file name, that is not in the plan, with the fields in which it differs from all records of the plan.
    pub fn check_plan<R: Record>(&self, keys: &[R::Key]) -> Result<(), OtherPlan> {
        let keys: Vec<Map<String, Value>> = keys.iter().map(|key| completed::<R>(fields(key))).collect();
        let Some(first) = keys.first() else { return Ok(()) };
        let planned = |left_out: &[&str]| -> BTreeSet<String> {
            keys.iter().map(|key| text(key, first, left_out)).collect()
        };
        let (by_this_code, by_another) = (planned(&CODE), planned(&[CODE[0], CODE[1], CONFIG]));
        for file in self.files(R::FOLDER) {
            let Ok(bytes) = orchard_input::bytes(&self.path().join(&file), orchard_input::RESULT) else {
                continue;
            };
            // An edited record does not show its plan: it is computed again, or ignored if it has another name.
            if checked(&bytes) == Err(Damage::WrongChecksum) {
                continue;
            }
            let Ok(Value::Object(record)) = serde_json::from_slice(&bytes) else { continue };
            let record = completed::<R>(record);
            let same_code = CODE.iter().all(|field| record.get(*field) == first.get(*field));
            let is_planned = if same_code {
                by_this_code.contains(&text(&record, first, &CODE))
            } else {
                by_another.contains(&text(&record, first, &[CODE[0], CODE[1], CONFIG]))
            };
            if !is_planned {
                let folder = self.path().display().to_string();
                return Err(OtherPlan { folder, file, differences: differences(&record, &keys, same_code) });
            }
        }
        Ok(())
    }
}

fn fields<K: serde::Serialize>(key: &K) -> Map<String, Value> {
    match serde_json::to_value(key) {
        Ok(Value::Object(fields)) => fields,
        other => unreachable!("a key is a list of texts and numbers: {other:?}"),
    }
}

/// Fields with those that a record leaves out, which are null.
fn completed<R: Record>(mut fields: Map<String, Value>) -> Map<String, Value> {
    for name in R::OPTIONAL {
        fields.entry(*name).or_insert(Value::Null);
    }
    fields
}

/// The fields of a key as one text, without the fields in `left_out`.
fn text(record: &Map<String, Value>, key: &Map<String, Value>, left_out: &[&str]) -> String {
    let counts = |name: &&String| !left_out.contains(&name.as_str());
    key.keys().filter(counts).map(|name| format!("{name} {:?}\n", record.get(name))).collect()
}

/// The fields of a record whose value no key has, with the values that the keys have.
fn differences(record: &Map<String, Value>, keys: &[Map<String, Value>], same_code: bool) -> String {
    let mut texts = Vec::new();
    for name in keys[0].keys().filter(|name| !CODE.contains(&name.as_str())) {
        let found = record.get(name).unwrap_or(&Value::Null);
        let mut planned: Vec<&Value> = Vec::new();
        for value in keys.iter().filter_map(|key| key.get(name)) {
            if !planned.contains(&value) {
                planned.push(value);
            }
        }
        if !planned.contains(&found) {
            texts.push((name, format!("{name} {found}, not {}", listed(&planned))));
        }
    }
    // The hash differs if any field that it covers does: it is reported only if no other field is.
    let alone = texts.len() == 1;
    let texts: Vec<String> = texts
        .into_iter()
        .filter(|(name, _)| name.as_str() != CONFIG || (alone && same_code))
        .map(|(_, text)| text)
        .collect();
    if texts.is_empty() {
        "a combination of values that is not in the plan".to_owned()
    } else {
        texts.join(", ")
    }
}

/// Some values in words.
fn listed(values: &[&Value]) -> String {
    match values {
        [first, _, .., last] if values.len() > 3 => {
            format!("one of the {} from {first} to {last}", values.len())
        }
        _ => values.iter().map(ToString::to_string).collect::<Vec<_>>().join(" or "),
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::fake::{Sum, SumKey, keys, record};

    /// Checks a plan against a folder that holds one record.
    fn said(held: impl FnOnce(&mut SumKey), asked: &[SumKey]) -> Result<(), String> {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path()).unwrap();
        let mut record = record(0);
        held(&mut record.key);
        store.write_record(&record).unwrap();
        let here = folder.path().display().to_string();
        let says = store.check_plan::<Sum>(asked);
        says.map_err(|e| e.to_string().strip_prefix(&here).unwrap().to_owned())
    }

    #[test]
    fn a_plans_own_records_and_part_of_them_are_taken() {
        assert_eq!(said(|_| (), &keys()), Ok(()));
        let empty = tempfile::tempdir().unwrap();
        let store = Store::open(empty.path()).unwrap();
        assert_eq!(store.check_plan::<Sum>(&keys()), Ok(()));
        // Files that cannot be read belong to no plan.
        fs::create_dir(empty.path().join("sums")).unwrap();
        for text in ["", "{", "[]", "no"] {
            fs::write(empty.path().join("sums/x.json"), text).unwrap();
            assert_eq!(store.check_plan::<Sum>(&keys()), Ok(()), "{text}");
        }
        // So do records that do not match their checksum.
        let mut other = record(0);
        other.key.seed = 5;
        store.write_record(&other).unwrap();
        assert!(store.check_plan::<Sum>(&keys()).is_err());
        let file = empty.path().join(Sum::path(&other.key));
        let text = fs::read_to_string(&file).unwrap();
        fs::write(&file, text.replace("\"sum\": 7", "\"sum\": 8")).unwrap();
        assert_eq!(store.check_plan::<Sum>(&keys()), Ok(()));
        // Another object does not.
        fs::write(empty.path().join("sums/x.json"), "{}").unwrap();
        assert!(store.check_plan::<Sum>(&keys()).is_err());
    }

    #[test]
    fn another_plan_is_told_by_what_differs() {
        let other = said(|key| key.controller = "gardener".into(), &keys());
        assert_eq!(
            other.unwrap_err(),
            " holds results of another plan: sums/gardener-7-000.json has controller \"gardener\", not \
             \"fake\"; choose another --out or delete that folder"
        );
        let seed = said(|key| key.seed = 5, &keys()).unwrap_err();
        assert!(seed.contains("has seed 5, not 7 or 8;"), "{seed}");
        let world = said(|key| key.world = 9, &keys()).unwrap_err();
        assert!(world.contains("has world 9, not one of the 4 from 0 to 3;"), "{world}");
        let horizon = said(|key| key.horizon_frames += 1, &keys()).unwrap_err();
        assert!(horizon.contains("has horizon_frames "), "{horizon}");
        let hash = said(|key| key.config_hash = "0123".into(), &keys()).unwrap_err();
        assert!(hash.contains("has config_hash \"0123\", not "), "{hash}");
    }

    #[test]
    fn records_of_other_code_count_by_what_was_asked() {
        let older = |key: &mut SumKey| {
            key.code_version = "0.0.1".into();
            key.config_hash = "0123".into();
        };
        assert_eq!(said(older, &keys()), Ok(()));
        let both = |key: &mut SumKey| {
            older(key);
            key.controller = "gardener".into();
        };
        let line = said(both, &keys()).unwrap_err();
        assert!(line.contains("has controller \"gardener\", not \"fake\";"), "{line}");
    }
}
