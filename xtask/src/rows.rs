//! The result file of `perf` and `validate`: measured rows, each with its target.

use std::path::Path;

use orchard_bench::compute::Machine;
use orchard_bench::store::write_json;
use serde::Serialize;

use crate::failure::Failure;

/// Version of the row layout.
const SCHEMA_VERSION: u32 = 1;

/// One measured figure. What does not apply is null.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// What was measured.
    pub name: String,
    /// The figure.
    pub value: Option<f64>,
    /// Its unit.
    pub unit: String,
    /// What it is compared with.
    pub peer: Option<String>,
    /// The peer's figure in the same unit.
    pub peer_value: Option<f64>,
    /// Figure over peer's figure.
    pub ratio: Option<f64>,
    /// What is asked of the figure.
    pub target: Option<f64>,
    /// Whether it meets the target.
    pub pass: Option<bool>,
}

impl Row {
    /// A figure alone.
    pub fn measured(name: &str, value: f64, unit: &str) -> Self {
        Self {
            name: name.to_owned(),
            value: value.is_finite().then_some(value),
            unit: unit.to_owned(),
            peer: None,
            peer_value: None,
            ratio: None,
            target: None,
            pass: None,
        }
    }

    /// The same figure beside a peer's, in the same unit.
    pub fn beside(self, peer: &str, peer_value: f64) -> Self {
        let ratio = self.value.map(|value| value / peer_value);
        Self { peer: Some(peer.to_owned()), peer_value: Some(peer_value), ratio, ..self }
    }
}

#[derive(Serialize)]
struct Report<'a> {
    schema_version: u32,
    machine: Machine,
    rows: &'a [Row],
}

/// A named group of measurements.
pub struct Suite {
    /// Name on the command line.
    pub name: &'static str,
    /// What it measures, in a few words.
    pub about: &'static str,
    /// Measures it.
    pub measure: fn() -> anyhow::Result<Vec<Row>>,
}

/// Measures a suite, prints its rows and writes them to a file. A missed target is a failure.
pub fn run_suite(kind: &str, suites: &[Suite], name: &str, json: &Path) -> Result<(), Failure> {
    let Some(suite) = suites.iter().find(|s| s.name == name) else {
        let known: Vec<&str> = suites.iter().map(|s| s.name).collect();
        let known = if known.is_empty() { "none yet".to_owned() } else { known.join(", ") };
        return Err(Failure::BadInput(format!("no {kind} suite '{name}'; the suites are: {known}")));
    };
    // Told before the measurement, not after it.
    let folder = json.parent().filter(|folder| !folder.as_os_str().is_empty());
    if json.file_name().is_none() || folder.is_some_and(|folder| !folder.is_dir()) {
        return Err(Failure::BadInput(format!("--json {}: no such folder", json.display())));
    }
    eprintln!("{}: {}", suite.name, suite.about);
    let rows = (suite.measure)()?;
    let report = Report { schema_version: SCHEMA_VERSION, machine: Machine::detect(), rows: &rows };
    write_json(json, &report).map_err(|e| Failure::Failed(e.to_string()))?;
    for row in &rows {
        println!("{}", line(row));
    }
    let missed: Vec<&str> = rows.iter().filter(|r| r.pass == Some(false)).map(|r| r.name.as_str()).collect();
    if missed.is_empty() {
        Ok(())
    } else {
        Err(Failure::Failed(format!("target missed: {}", missed.join(", "))))
    }
}

fn line(row: &Row) -> String {
    let number = |x: Option<f64>| x.map_or_else(|| "-".to_owned(), |x| format!("{x:.4}"));
    let mut line = format!("{:<28} {:>14} {}", row.name, number(row.value), row.unit);
    if let Some(peer) = &row.peer {
        line += &format!("  {peer}: {} (ratio {})", number(row.peer_value), number(row.ratio));
    }
    if row.target.is_some() {
        let verdict = if row.pass == Some(true) { "pass" } else { "FAIL" };
        line += &format!("  target {}: {verdict}", number(row.target));
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    const SUITES: &[Suite] = &[
        Suite { name: "good", about: "", measure: || Ok(vec![Row::measured("a.b", 2.0, "m")]) },
        Suite {
            name: "bad",
            about: "",
            measure: || {
                Ok(vec![Row { target: Some(3.0), pass: Some(false), ..Row::measured("a.c", 2.0, "m") }])
            },
        },
    ];

    #[test]
    fn rows_have_the_promised_layout() {
        let folder = tempfile::tempdir().unwrap();
        let json = folder.path().join("rows.json");
        run_suite("perf", SUITES, "good", &json).unwrap();
        let text = std::fs::read_to_string(&json).unwrap();
        let report: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(report["schema_version"], 1);
        assert!(report["machine"].is_object());
        let expected = serde_json::json!({
            "name": "a.b", "value": 2.0, "unit": "m", "peer": null, "peer_value": null,
            "ratio": null, "target": null, "pass": null
        });
        assert_eq!(report["rows"][0], expected);
    }

    #[test]
    fn a_missed_target_fails_after_the_file_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let json = folder.path().join("rows.json");
        let failure = run_suite("perf", SUITES, "bad", &json).unwrap_err();
        assert!(matches!(&failure, Failure::Failed(line) if line == "target missed: a.c"), "{failure}");
        assert!(json.exists());
    }

    #[test]
    fn a_file_in_no_folder_is_bad_input() {
        let failure = run_suite("perf", SUITES, "good", Path::new("no/such/folder/x.json")).unwrap_err();
        assert!(matches!(failure, Failure::BadInput(_)), "{failure}");
    }

    #[test]
    fn unknown_suites_are_bad_input() {
        let failure = run_suite("perf", SUITES, "worse", Path::new("never-written.json")).unwrap_err();
        assert!(matches!(failure, Failure::BadInput(_)));
        assert_eq!(failure.to_string(), "no perf suite 'worse'; the suites are: good, bad");
    }
}
