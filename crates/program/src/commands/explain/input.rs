//! Reads an episode's record and checks that it can be explained.

use std::path::Path;

use orchard_bench::checksum::checked;
use orchard_bench::store::Store;
use orchard_bench::{CODE_VERSION, SCHEMA_VERSION};
use orchard_scenario::{Options, Scenario, ScenarioError};
use orchard_tasks::harvest::episode::EpisodeRecord;
use orchard_tasks::harvest::{Harvest, command_log};
use orchard_tasks::plan_file::PlanFile;
use serde::Deserialize;

use crate::args::ScenarioArgs;
use crate::failure::Failure;
use crate::program::Program;

/// A record of this code version, with the worlds and controller that made it.
pub struct Input {
    /// The record.
    pub record: EpisodeRecord,
    /// Worlds and controller of the record.
    pub harvest: Harvest,
}

/// Fields that every version of a record has.
#[derive(Deserialize)]
struct Head {
    schema_version: u32,
    code_version: String,
}

/// Reads the record of an episode of this code version. The scenario is that of the options; without options, that stored in the result
/// folder; without one there, that named in the record.
pub fn read(file: &Path, scenario: &ScenarioArgs, program: &Program) -> Result<Input, Failure> {
    let bad = |problem: String| Failure::BadInput(format!("{}: {problem}", file.display()));
    let text = orchard_input::text(file, orchard_input::RESULT).map_err(|e| bad(e.to_string()))?;
    let record = of_text(&text, CODE_VERSION).map_err(bad)?;
    if let Some(folder) = file.parent().and_then(Path::parent) {
        command_log::check(folder, &record).map_err(|e| Failure::BadInput(e.to_string()))?;
    }
    let options = scenario.options()?;
    let guessed = options.is_empty() && plan_of(file).is_none();
    let scenario = if options.is_empty() {
        of_result(file, &record, program)
    } else {
        Scenario::resolve(&options, program.controllers())
    };
    let harvest = Harvest::new(scenario.map_err(|e| bad(e.to_string()))?)?;
    let (own, key) = (harvest.config_hash(), &record.key);
    if own != key.config_hash {
        let hint = if guessed {
            ": there is no plan.json in the folder above it, so it was taken for a record of bench-v1. Put the plan.json of its result there, or give the scenario's options"
        } else {
            ""
        };
        return Err(bad(format!(
            "config_hash {} differs from that of this scenario and code, {own}{hint}",
            key.config_hash
        )));
    }
    Ok(Input { record, harvest })
}

/// The scenario of a record: stored in the plan of its result folder, or found by its names.
fn of_result(file: &Path, record: &EpisodeRecord, program: &Program) -> Result<Scenario, ScenarioError> {
    let stored = plan_of(file)
        .and_then(|folder| Store::open(folder).ok())
        .and_then(|store| PlanFile::scenario_of(&store, "harvest").ok());
    match stored {
        Some(stored) if stored.names == record.key.scenario => {
            Scenario::from_stored(&stored, program.controllers(), PlanFile::FILE)
        }
        _ => Scenario::resolve(&Options::of_names(&record.key.scenario)?, program.controllers()),
    }
}

/// The result folder of a record, if it has a plan.
fn plan_of(file: &Path) -> Option<&Path> {
    file.parent().and_then(Path::parent).filter(|folder| folder.join(PlanFile::FILE).is_file())
}

fn of_text(text: &str, code_version: &str) -> Result<EpisodeRecord, String> {
    let head: Head =
        serde_json::from_str(text).map_err(|e| format!("not a record of a bench-v1 episode: {e}"))?;
    if head.schema_version != SCHEMA_VERSION {
        return Err(format!(
            "schema_version {}, but this code reads {SCHEMA_VERSION}: run bench-v1 again",
            head.schema_version
        ));
    }
    if head.code_version != code_version {
        return Err(format!(
            "written by code version {}, but this is {code_version}, whose results may differ: run bench-v1 again",
            head.code_version
        ));
    }
    let content = checked(text.as_bytes()).map_err(|damage| damage.to_string())?;
    serde_json::from_slice(&content).map_err(|e| format!("not a record of a bench-v1 episode: {e}"))
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use orchard_bench::checksum::with_checksum;

    /// Returns the error for a text.
    pub fn refused(text: &str) -> String {
        match of_text(text, CODE_VERSION) {
            Ok(_) => panic!("accepted"),
            Err(problem) => problem,
        }
    }

    #[test]
    fn what_is_no_record_is_refused() {
        for text in ["", "{}", "[1, 2]", "{\"schema_version\": 2}", "PNG"] {
            assert!(refused(text).starts_with("not a record of a bench-v1 episode"), "{text}");
        }
        let head =
            |schema: u32, code: &str| format!(r#"{{"schema_version": {schema}, "code_version": "{code}"}}"#);
        assert!(refused(&head(1, "x")).starts_with("schema_version 1, but this code reads"));
        assert!(refused(&head(SCHEMA_VERSION, "x")).starts_with("written by code version x, but this is"));
        assert_eq!(refused(&head(SCHEMA_VERSION, CODE_VERSION)), "has no checksum");
        let content = format!(
            "{{\n  \"schema_version\": {SCHEMA_VERSION},\n  \"code_version\": \"{CODE_VERSION}\"\n}}\n"
        );
        let text = String::from_utf8(with_checksum(content.as_bytes()).unwrap()).unwrap();
        assert!(refused(&text).starts_with("not a record of a bench-v1 episode"));
        assert!(refused(&text.replace("\n}", "\n }")).starts_with("does not match its checksum"));
    }
}
