//! Reading an episode's record, and why it cannot be told.

use std::path::Path;

use orchard_bench::episode::{CODE_VERSION, EpisodeRecord, SCHEMA_VERSION};
use orchard_bench::harvest::Harvest;
use orchard_picker::Kind;
use serde::Deserialize;

use crate::failure::Failure;

/// A record of this code, with what made it.
pub struct Input {
    /// The record.
    pub record: EpisodeRecord,
    /// Its worlds and controller.
    pub harvest: Harvest,
}

/// What every version of a record has.
#[derive(Deserialize)]
struct Head {
    schema_version: u32,
    code_version: String,
}

/// Reads the record of an episode of this very code.
pub fn read(file: &Path) -> Result<Input, Failure> {
    let bad = |problem: String| Failure::BadInput(format!("{}: {problem}", file.display()));
    let text = std::fs::read_to_string(file).map_err(|e| bad(e.to_string()))?;
    of_text(&text, CODE_VERSION).map_err(bad)
}

fn of_text(text: &str, code_version: &str) -> Result<Input, String> {
    let head: Head =
        serde_json::from_str(text).map_err(|e| format!("is no record of an episode of bench-v1: {e}"))?;
    if head.schema_version != SCHEMA_VERSION {
        return Err(format!(
            "has schema version {}, this code reads {SCHEMA_VERSION}: run bench-v1 again",
            head.schema_version
        ));
    }
    if head.code_version != code_version {
        return Err(format!(
            "was written by code version {}, this is {code_version}, which may act otherwise: run bench-v1 again",
            head.code_version
        ));
    }
    let record: EpisodeRecord =
        serde_json::from_str(text).map_err(|e| format!("is no record of an episode of bench-v1: {e}"))?;
    let key = &record.key;
    let Some(kind) = Kind::ALL.into_iter().find(|kind| kind.name() == key.controller) else {
        let known: Vec<&str> = Kind::ALL.iter().map(|kind| kind.name()).collect();
        return Err(format!("controller: {} is unknown; there are {}", key.controller, known.join(", ")));
    };
    let harvest = Harvest::paper(kind);
    if harvest.config_hash() != key.config_hash {
        return Err(format!("config_hash: {} is not that of this code's configuration", key.config_hash));
    }
    Ok(Input { record, harvest })
}

#[cfg(test)]
pub mod tests {
    use super::*;

    /// Why a text is refused.
    pub fn refused(text: &str) -> String {
        match of_text(text, CODE_VERSION) {
            Ok(_) => panic!("accepted"),
            Err(problem) => problem,
        }
    }

    #[test]
    fn what_is_no_record_is_refused() {
        for text in ["", "{}", "[1, 2]", "{\"schema_version\": 2}", "PNG"] {
            assert!(refused(text).starts_with("is no record of an episode"), "{text}");
        }
        let head =
            |schema: u32, code: &str| format!(r#"{{"schema_version": {schema}, "code_version": "{code}"}}"#);
        assert!(refused(&head(1, "x")).starts_with("has schema version 1, this code reads"));
        assert!(refused(&head(SCHEMA_VERSION, "x")).starts_with("was written by code version x, this is"));
        assert!(refused(&head(SCHEMA_VERSION, CODE_VERSION)).starts_with("is no record of an episode"));
    }
}
