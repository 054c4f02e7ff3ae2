//! The result file of `perf` and `validate`: measured rows, each with its target.

use std::collections::BTreeMap;
use std::path::Path;

use orchard_bench::compute::Machine;
use orchard_bench::store::write_json;
use orchard_report::Figure;
use orchard_scaling::Scaling;
use serde::{Deserialize, Serialize};

use crate::failure::Failure;
use crate::out_folder::open_folder;

mod rounds;
mod table;

pub use rounds::Rounds;
pub use table::number;

/// Version of the row layout.
const SCHEMA_VERSION: u32 = 1;

/// One measured figure. Fields without a value are null.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// Name of the measured quantity.
    pub name: String,
    /// The figure.
    pub value: Option<f64>,
    /// Unit of the figure.
    pub unit: String,
    /// Peer that the figure is compared with.
    pub peer: Option<String>,
    /// The peer's figure in the same unit.
    pub peer_value: Option<f64>,
    /// Figure over peer's figure.
    pub ratio: Option<f64>,
    /// Target of the figure.
    pub target: Option<f64>,
    /// True if the figure meets the target.
    pub pass: Option<bool>,
    /// Smallest and largest figure of the rounds; `value` is their median. Null with a single round.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spread: Option<[f64; 2]>,
    /// Smallest and largest figure of the peer's rounds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub peer_spread: Option<[f64; 2]>,
    /// 95 % bootstrap interval of the figure.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ci95: Option<[f64; 2]>,
    /// 95 % bootstrap interval of the peer's figure.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub peer_ci95: Option<[f64; 2]>,
    /// Target ratio to the peer's figure.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target_ratio: Option<f64>,
    /// Target interval of the figure.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target_interval: Option<[f64; 2]>,
    /// Comparison with the machine's peak rate.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limit: Option<Limit>,
    /// Description of the measurement, in words.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
    /// Known reason why the target cannot be met.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why_missed: Option<String>,
    /// Measurement behind the target.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub evidence: Option<Evidence>,
    /// True if a validation must have this row; null outside validations.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub demanded: Option<bool>,
}

/// Measurement that a row is judged by.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Evidence {
    /// Key of the source in `docs/references.bib`.
    pub source: String,
    /// Reason of the target interval.
    pub tolerance: String,
    /// Kind of evidence that the figure is.
    pub role: Role,
}

/// Kind of evidence that a measured figure is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// A config holds it, or was fitted to it: the row shows that the parts fit together, and is no evidence.
    Input,
    /// It follows from others.
    Prediction,
}

impl Role {
    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Input => "input",
            Self::Prediction => "prediction",
        }
    }
}

/// A rate compared with the arithmetic peak of one core.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Limit {
    /// Floating-point operations per unit of work.
    pub operations: f64,
    /// Achieved rate \[operations/s\].
    pub achieved: f64,
    /// Measured peak of the instruction set in use \[operations/s\].
    pub peak: f64,
    /// Achieved rate over this peak.
    pub share: f64,
    /// Measured peak of the widest vectors of the same precision \[operations/s\].
    pub widest_peak: f64,
    /// Achieved rate over the widest peak.
    pub widest_share: f64,
    /// Cause of the limit.
    pub why: String,
}

impl Limit {
    /// Makes a limit from the rate of operations and the two peaks \[operations/s\].
    pub fn new(achieved: f64, peak: f64, widest_peak: f64, operations: f64, why: &str) -> Self {
        Self {
            operations,
            achieved,
            peak,
            share: achieved / peak,
            widest_peak,
            widest_share: achieved / widest_peak,
            why: why.to_owned(),
        }
    }
}

impl Row {
    /// Makes a row of a figure, without peer and target.
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
            spread: None,
            peer_spread: None,
            ci95: None,
            peer_ci95: None,
            target_ratio: None,
            target_interval: None,
            limit: None,
            note: None,
            why_missed: None,
            evidence: None,
            demanded: None,
        }
    }

    /// A row of the median of some rounds, with their spread.
    pub fn of_rounds(name: &str, rounds: Vec<f64>, unit: &str, note: &str) -> Self {
        let rounds = Rounds::new(rounds);
        let row = Self::measured(name, rounds.median(), unit);
        Self { spread: Some(rounds.spread()), note: Some(note.to_owned()), ..row }
    }

    /// Returns the row with a peer's figure, in the same unit, and the ratio to it; none to 0.
    pub fn beside(self, peer: &str, peer_value: f64) -> Self {
        let ratio = self.value.map(|value| value / peer_value).filter(|ratio| ratio.is_finite());
        Self { peer: Some(peer.to_owned()), peer_value: Some(peer_value), ratio, ..self }
    }

    /// Sets the target: at least `target_ratio` times the peer's figure. Without a peer there is no target.
    pub fn at_least_times(self, target_ratio: f64) -> Self {
        let target = self.peer_value.map(|peer| target_ratio * peer);
        let pass = self.ratio.map(|ratio| ratio >= target_ratio);
        Self { target, pass, target_ratio: Some(target_ratio), ..self }
    }

    /// Sets the target: a figure inside `interval`, which contains `target`.
    pub fn within(self, target: f64, interval: [f64; 2]) -> Self {
        let pass = Some(self.value.is_some_and(|value| (interval[0]..=interval[1]).contains(&value)));
        Self { target: Some(target), target_interval: Some(interval), pass, ..self }
    }

    /// Sets the target: at least this figure.
    pub fn at_least(self, target: f64) -> Self {
        let pass = Some(self.value.is_some_and(|value| value >= target));
        Self { target: Some(target), pass, ..self }
    }

    /// Sets the target: at most this figure.
    pub fn at_most(self, target: f64) -> Self {
        let pass = Some(self.value.is_some_and(|value| value <= target));
        Self { target: Some(target), pass, ..self }
    }
}

/// Results of a suite.
#[derive(Debug, Default)]
pub struct Measured {
    /// The figures.
    pub rows: Vec<Row>,
    /// Versions and instruction sets that affect the figures.
    pub context: BTreeMap<&'static str, Option<String>>,
    /// Pictures of the results, written to the folder `NAME-pictures` beside the file `NAME.json`.
    pub pictures: Vec<Figure>,
    /// The scaling run behind the rows, for `orchard report`.
    pub scaling: Option<Box<Scaling>>,
}

impl From<Vec<Row>> for Measured {
    fn from(rows: Vec<Row>) -> Self {
        Self { rows, ..Self::default() }
    }
}

/// Effort of a measurement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effort {
    /// Figures that can be quoted.
    Full,
    /// A short check that everything works.
    Quick,
}

#[derive(Serialize)]
struct Report<'a> {
    schema_version: u32,
    machine: Machine,
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    context: &'a BTreeMap<&'static str, Option<String>>,
    rows: &'a [Row],
    #[serde(skip_serializing_if = "Option::is_none")]
    scaling: Option<&'a Scaling>,
}

/// A named group of measurements.
pub struct Suite {
    /// Name on the command line.
    pub name: &'static str,
    /// Short description of the measurement.
    pub about: &'static str,
    /// Measures it.
    pub measure: fn(Effort) -> anyhow::Result<Measured>,
}

/// Measures a suite, prints its rows and writes them to a file. A missed target is a failure unless its row gives a reason
/// (`why_missed`).
pub fn run_suite(
    kind: &str,
    suites: &[Suite],
    name: &str,
    json: &Path,
    effort: Effort,
) -> Result<(), Failure> {
    judge(&measure_suite(kind, suites, name, json, effort, |_| ())?)
}

/// Measures a suite, completes its rows with `complete`, prints them and writes them to a file.
pub fn measure_suite(
    kind: &str,
    suites: &[Suite],
    name: &str,
    json: &Path,
    effort: Effort,
    complete: impl FnOnce(&mut Vec<Row>),
) -> Result<Vec<Row>, Failure> {
    let Some(suite) = suites.iter().find(|s| s.name == name) else {
        let known: Vec<&str> = suites.iter().map(|s| s.name).collect();
        let known = if known.is_empty() { "none yet".to_owned() } else { known.join(", ") };
        return Err(Failure::BadInput(format!("no {kind} suite '{name}'; the suites are: {known}")));
    };
    // Checked before the measurement starts.
    let folder = json.parent().filter(|folder| !folder.as_os_str().is_empty());
    if json.file_name().is_none() || folder.is_some_and(|folder| !folder.is_dir()) {
        return Err(Failure::BadInput(format!("--json {}: no such folder", json.display())));
    }
    note!("{}: {}", suite.name, suite.about);
    let Measured { mut rows, context, pictures, scaling } = (suite.measure)(effort)?;
    complete(&mut rows);
    let report = Report {
        schema_version: SCHEMA_VERSION,
        machine: Machine::detect(),
        context: &context,
        rows: &rows,
        scaling: scaling.as_deref(),
    };
    write_json(json, &report).map_err(|e| Failure::Failed(e.to_string()))?;
    write_pictures(json, &pictures)?;
    say!("{}", table::markdown(&rows).trim_end());
    Ok(rows)
}

/// Fails if a target was missed without a reason.
pub fn judge(rows: &[Row]) -> Result<(), Failure> {
    let missed = rows.iter().filter(|r| r.pass == Some(false) && r.why_missed.is_none());
    let missed: Vec<&str> = missed.map(|r| r.name.as_str()).collect();
    if missed.is_empty() {
        Ok(())
    } else {
        Err(Failure::Failed(format!("target missed: {}", missed.join(", "))))
    }
}

/// Writes pictures into the folder `NAME-pictures` beside the file `NAME.json`.
fn write_pictures(json: &Path, pictures: &[Figure]) -> Result<(), Failure> {
    if pictures.is_empty() {
        return Ok(());
    }
    let mut name = json.file_stem().unwrap_or_default().to_owned();
    name.push("-pictures");
    let folder = json.with_file_name(name);
    let (store, _lock) = open_folder("--json", &folder)?;
    for picture in pictures {
        let written = store.write_bytes(&format!("{}.svg", picture.stem), picture.svg.as_bytes());
        written.map_err(|e| Failure::Failed(e.to_string()))?;
    }
    note!("pictures: {}", folder.display());
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const SUITES: &[Suite] = &[
        Suite { name: "good", about: "", measure: |_| Ok(vec![Row::measured("a.b", 2.0, "m")].into()) },
        Suite {
            name: "bad",
            about: "",
            measure: |_| Ok(vec![Row::measured("a.c", 2.0, "m").at_least(3.0)].into()),
        },
    ];

    #[test]
    fn rows_have_the_promised_layout() {
        let folder = tempfile::tempdir().unwrap();
        let json = folder.path().join("rows.json");
        run_suite("perf", SUITES, "good", &json, Effort::Quick).unwrap();
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
        let failure = run_suite("perf", SUITES, "bad", &json, Effort::Quick).unwrap_err();
        assert!(matches!(&failure, Failure::Failed(line) if line == "target missed: a.c"), "{failure}");
        assert!(json.exists());
    }

    #[test]
    fn a_file_in_no_folder_is_bad_input() {
        let failure =
            run_suite("perf", SUITES, "good", Path::new("no/such/folder/x.json"), Effort::Quick).unwrap_err();
        assert!(matches!(failure, Failure::BadInput(_)), "{failure}");
    }

    #[test]
    fn a_ratio_is_asked_for_only_beside_a_peer() {
        let alone = Row::measured("a", 10.0, "1/s").at_least_times(6.0);
        assert_eq!((alone.target, alone.pass), (None, None));
        let slower = Row::measured("a", 10.0, "1/s").beside("b", 2.0).at_least_times(6.0);
        assert_eq!((slower.target, slower.pass), (Some(12.0), Some(false)));
        let faster = Row::measured("a", 12.0, "1/s").beside("b", 2.0).at_least_times(6.0);
        assert_eq!(faster.pass, Some(true));
    }

    #[test]
    fn an_interval_holds_its_ends() {
        let row = |value| Row::measured("a", value, "m").within(1.0, [0.9, 1.2]);
        assert_eq!([0.9, 1.2, 1.3, f64::NAN].map(|v| row(v).pass), [true, true, false, false].map(Some));
        assert_eq!((row(1.0).target, row(1.0).target_interval), (Some(1.0), Some([0.9, 1.2])));
    }

    #[test]
    fn pictures_go_into_a_folder_beside_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let words = String::new;
        let picture = Figure { stem: "a".into(), title: words(), description: words(), svg: "<svg/>".into() };
        write_pictures(&folder.path().join("rows.json"), &[picture]).unwrap();
        let text = std::fs::read_to_string(folder.path().join("rows-pictures/a.svg")).unwrap();
        assert_eq!(text, "<svg/>");
    }

    #[test]
    fn unknown_suites_are_bad_input() {
        let failure =
            run_suite("perf", SUITES, "worse", Path::new("never-written.json"), Effort::Quick).unwrap_err();
        assert!(matches!(failure, Failure::BadInput(_)));
        assert_eq!(failure.to_string(), "no perf suite 'worse'; the suites are: good, bad");
    }
}
