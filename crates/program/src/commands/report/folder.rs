//! Reading a result folder.

use std::path::Path;

use orchard_bench::SCHEMA_VERSION;
use orchard_bench::checksum::checked;
use orchard_bench::store::Store;
use orchard_report::Results;
use orchard_scaling::Scaling;
use orchard_scenario::Scenario;
use orchard_tasks::detect::DetectSummary;
use orchard_tasks::plan_file::PlanFile;
use orchard_tasks::protocol::Protocol;
use serde::Deserialize;
use serde::de::DeserializeOwned;

use crate::program::Program;

/// Summaries of the component tasks.
const COMPONENTS: [&str; 2] = ["reach-and-grasp.json", "gentle.json"];

/// Scaling runs, each of any backend.
const SCALINGS: [&str; 2] = ["scaling.json", "scaling-gpu.json"];

/// The part of a `perf scaling` file that is read.
#[derive(Deserialize)]
struct PerfFile {
    scaling: serde_json::Value,
}

/// Fields that every result file has.
#[derive(Deserialize)]
struct Head {
    schema_version: u32,
}

/// Reads all existing summaries. The error names the file and the problem.
pub fn read(dir: &Path) -> Result<Results, String> {
    if !dir.is_dir() {
        return Err(format!("{}: no such folder", dir.display()));
    }
    let mut components = Vec::new();
    for file in COMPONENTS {
        components.extend(file_of(dir, file)?);
    }
    let results = Results {
        harvest: file_of(dir, "summary.json")?,
        detect: file_of(dir, DetectSummary::FILE)?,
        components,
        compute: file_of(dir, "compute.json")?,
        scaling: scalings(dir)?,
    };
    if results.is_empty() {
        let names = "summary.json, detect.json, reach-and-grasp.json, gentle.json, compute.json, scaling.json, \
             scaling-gpu.json";
        return Err(format!("{}: no result of bench-v1; it contains none of {names}", dir.display()));
    }
    Ok(results)
}

/// The protocol of a folder's harvest; benchmark v1's without one that this program can use.
pub fn protocol(dir: &Path, program: &Program) -> Protocol {
    let stored = Store::open(dir).ok().and_then(|store| PlanFile::scenario_of(&store, "harvest").ok());
    let scenario =
        stored.and_then(|stored| Scenario::from_stored(&stored, program.controllers(), PlanFile::FILE).ok());
    scenario.and_then(|scenario| Protocol::of_scenario(&scenario).ok()).unwrap_or_else(Protocol::paper)
}

/// Scaling runs, one per backend.
fn scalings(dir: &Path) -> Result<Vec<Scaling>, String> {
    let mut scalings: Vec<Scaling> = Vec::new();
    for file in SCALINGS {
        let Some(scaling) = scaling_of(dir, file)? else { continue };
        let backend = scaling.backend;
        if scalings.iter().any(|other| other.backend == backend) {
            let [a, b] = SCALINGS;
            return Err(format!(
                "{}: {a} and {b} both have the backend {}; one file per backend is allowed",
                dir.display(),
                backend.name()
            ));
        }
        scalings.push(scaling);
    }
    Ok(scalings)
}

/// A scaling run, by itself or in a file of `perf scaling`.
fn scaling_of(dir: &Path, name: &str) -> Result<Option<Scaling>, String> {
    let path = dir.join(name);
    let Some(text) = text_of(&path)? else { return Ok(None) };
    let scaling = match serde_json::from_str::<PerfFile>(&text) {
        // A file of `perf scaling` has no checksum.
        Ok(perf) => content_of(&path, &perf.scaling.to_string())?,
        Err(_) => result_of(&path, &text)?,
    };
    Ok(Some(scaling))
}

/// A result file's content, if there is one.
fn file_of<T: DeserializeOwned>(dir: &Path, name: &str) -> Result<Option<T>, String> {
    let path = dir.join(name);
    text_of(&path)?.map(|text| result_of(&path, &text)).transpose()
}

fn text_of(path: &Path) -> Result<Option<String>, String> {
    match orchard_input::text(path, orchard_input::RESULT) {
        Ok(text) => Ok(Some(text)),
        Err(e) if e.is_missing() => Ok(None),
        Err(e) => Err(format!("{}: {e}", path.display())),
    }
}

/// Content of a result file whose checksum is right.
fn result_of<T: DeserializeOwned>(path: &Path, text: &str) -> Result<T, String> {
    check_version(path, text)?;
    let content = checked(text.as_bytes()).map_err(|damage| format!("{}: {damage}", path.display()))?;
    content_of(path, &String::from_utf8_lossy(&content))
}

fn content_of<T: DeserializeOwned>(path: &Path, text: &str) -> Result<T, String> {
    check_version(path, text)?;
    serde_json::from_str(text).map_err(|e| format!("{}: cannot be parsed: {e}", path.display()))
}

fn check_version(path: &Path, text: &str) -> Result<(), String> {
    let bad = |problem: String| format!("{}: {problem}", path.display());
    let head: Head = serde_json::from_str(text).map_err(|e| bad(format!("not a result of bench-v1: {e}")))?;
    if head.schema_version == SCHEMA_VERSION {
        return Ok(());
    }
    let found = head.schema_version;
    Err(bad(format!("schema_version {found}, but this code reads {SCHEMA_VERSION}: run bench-v1 again")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use orchard_bench::checksum::{encode, with_checksum as checksum};
    use orchard_bench::compute::Compute;

    fn with_checksum(content: &str) -> String {
        String::from_utf8(checksum(content.as_bytes()).unwrap()).unwrap()
    }

    #[test]
    fn folders_without_results_and_broken_files_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let dir = folder.path();
        let refused = || read(dir).unwrap_err();
        assert!(refused().contains("no result of bench-v1"));
        assert!(read(&dir.join("none")).unwrap_err().contains("no such folder"));
        let compute = Compute { schema_version: SCHEMA_VERSION, tasks: std::collections::BTreeMap::new() };
        let text = encode(&compute).unwrap();
        std::fs::write(dir.join("compute.json"), &text).unwrap();
        assert_eq!(read(dir).unwrap().compute, Some(compute));
        for (name, text, problem) in [
            ("summary.json", "{", "summary.json: not a result of bench-v1: EOF"),
            (
                "summary.json",
                "{\"schema_version\": 1}",
                "summary.json: schema_version 1, but this code reads",
            ),
            (
                "detect.json",
                &with_checksum(&format!("{{\n  \"schema_version\": {SCHEMA_VERSION}\n}}\n")),
                "detect.json: cannot be parsed: missing field",
            ),
            (
                "detect.json",
                &format!("{{\"schema_version\": {SCHEMA_VERSION}}}"),
                "detect.json: has no checksum",
            ),
            (
                "compute.json",
                &String::from_utf8(text.clone()).unwrap().replace("{}", "{ }"),
                "compute.json: does not match its checksum",
            ),
            ("scaling.json", "[]", "scaling.json: not a result"),
        ] {
            std::fs::write(dir.join(name), text).unwrap();
            assert!(refused().contains(problem), "{}", refused());
            std::fs::remove_file(dir.join(name)).unwrap();
        }
    }
}
