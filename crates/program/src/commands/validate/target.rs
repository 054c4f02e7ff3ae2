//! Targets of figures, as the files of `configs/measured` hold them.

use std::collections::BTreeMap;

use orchard_quantity::{Unit, from_toml};
use serde::{Deserialize, Serialize};

use crate::rows::{Evidence, Role, Row};

/// A measured figure, the interval for the simulator's, and why it is that.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Target {
    value: f64,
    low: f64,
    high: f64,
    /// Unit of the three.
    unit: Unit,
    /// Key of the source.
    source: String,
    role: Role,
    /// Reason of the interval.
    tolerance: String,
    /// Reason why the simulator has no such figure.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    not_testable: Option<String>,
    /// Reason why the simulator's figure lies outside, if it does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    why_missed: Option<String>,
}

impl Target {
    /// True if the simulator has a figure to compare.
    pub fn is_testable(&self) -> bool {
        self.not_testable.is_none()
    }

    /// The target with another measured figure and interval, in its unit: for figures of a sample that the user gives.
    pub fn of_sample(&self, value: f64, [low, high]: [f64; 2]) -> Self {
        Self { value, low, high, role: Role::Prediction, ..self.clone() }
    }

    /// The row of a figure in SI units; `note` says how it was found.
    pub fn row(&self, name: &str, figure: f64, note: &str) -> Row {
        let row = Row::measured(name, figure / self.unit.to_si(), self.unit.symbol())
            .within(self.value, [self.low, self.high]);
        let (source, tolerance) = (self.source.clone(), self.tolerance.clone());
        let note = self.not_testable.as_ref().map_or(note.to_owned(), |why| format!("not testable: {why}"));
        let is_missed = self.is_testable() && row.pass == Some(false);
        Row {
            why_missed: self.why_missed.clone().filter(|_| is_missed),
            pass: row.pass.filter(|_| self.is_testable()),
            note: (!note.is_empty()).then_some(note),
            evidence: Some(Evidence { source, tolerance, role: self.role }),
            ..row
        }
    }
}

/// Rows of a file of targets, each with its figure in SI units by its name; `suite` begins the rows' names.
///
/// # Errors
/// The file is not one of targets, or a figure cannot be found.
pub fn rows(
    suite: &str,
    text: &str,
    figure: impl Fn(&str) -> anyhow::Result<f64>,
) -> anyhow::Result<Vec<Row>> {
    compare(suite, from_toml(&format!("measured/{suite}.toml"), text)?, figure)
}

/// Rows of targets, each with its figure in SI units by its name; `suite` begins the rows' names.
///
/// # Errors
/// A figure cannot be found.
pub fn compare(
    suite: &str,
    targets: BTreeMap<String, Target>,
    figure: impl Fn(&str) -> anyhow::Result<f64>,
) -> anyhow::Result<Vec<Row>> {
    let judged = targets.into_iter().map(|(name, target)| {
        let figure = if target.is_testable() { figure(&name)? } else { f64::NAN };
        Ok(target.row(&format!("{suite}.{name}"), figure, ""))
    });
    judged.collect()
}

#[cfg(test)]
pub mod tests {
    use super::*;

    /// Every row of a suite has a figure that meets its target, or says why not.
    pub fn assert_all_meet(rows: Vec<Row>) {
        for row in rows {
            assert_eq!(row.value.is_some(), row.pass.is_some(), "{}", row.name);
            assert_ne!(row.pass, Some(false), "{}: {:?} {:?}", row.name, row.value, row.target_interval);
        }
    }

    #[test]
    fn a_figure_outside_fails_and_one_without_simulation_has_no_verdict() {
        let text =
            "value = 1.0\nlow = 0.9\nhigh = 1.1\nunit = 'GPa'\nsource = 'x'\nrole = 'input'\ntolerance = 'x'";
        let target: Target = from_toml("x.toml", text).unwrap();
        let pass = |figure| target.row("a", figure, "").pass;
        assert_eq!([1.0e9, 1.2e9, f64::NAN].map(pass), [true, false, false].map(Some));
        let text = format!("{text}\nnot_testable = 'no bark'");
        let target: Target = from_toml("x.toml", &text).unwrap();
        let row = target.row("a", f64::NAN, "");
        assert_eq!((row.pass, row.note.as_deref()), (None, Some("not testable: no bark")));
    }
}
