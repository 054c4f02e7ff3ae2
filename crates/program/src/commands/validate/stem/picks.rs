//! Real picks, predicted one by one: did the stem give way, or did the apple slip out of the hand?
//!
//! A pick ends as the first of two strengths is reached, that of the stem S or that of the grip G. Given the load at which it ended, the stem was the one that
//! gave way with the chance `s / (s + g)`, where s and g are the hazards of the two laws per logarithm of the load, both of which grow together (competing
//! risks: Kalbfleisch and Prentice 2002, chapter 8).

use std::path::Path;

use orchard_geometry::math;
use orchard_quantity::{Quantity, Unit};
use orchard_spec::fruit::Strength;
use orchard_spec::{Preset, Spec};
use orchard_statistics::{Design, Resamples};
use orchard_tasks::protocol::Protocol;
use serde::{Deserialize, Serialize};

use super::super::target::Target;
use crate::failure::Failure;
use crate::rows::Row;

/// Columns of a file of picks.
const COLUMNS: [&str; 3] = ["along_n", "across_n", "success"];

/// Largest file of picks \[bytes\]: a million picks.
const LARGEST: u64 = 32 << 20;

/// Measured picks, and the grip of the hand that made them.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sample {
    sample: Vec<[f64; 3]>,
    unit: Unit,
    source: String,
    grip: Grip,
}

/// Grip of a hand that pulls along its axis and across it.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Grip {
    median: Quantity,
    spread: Quantity,
    /// Strength across the axis over that along it.
    across: Quantity,
}

/// One pick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pick {
    /// Largest force along the axis of the hand and across it \[N\].
    pub force: [f64; 2],
    /// True if the apple came off.
    pub success: bool,
}

impl Pick {
    fn total(&self) -> f64 {
        math::hypot(self.force[0], self.force[1])
    }
}

impl Sample {
    /// The measured picks.
    pub fn list(&self) -> Vec<Pick> {
        let si = self.unit.to_si();
        let pick = |&[along, across, success]: &[f64; 3]| Pick {
            force: [along * si, across * si],
            success: success > 0.5,
        };
        self.sample.iter().map(pick).collect()
    }

    /// Chance that a pick that ended at its load ended with the apple off.
    fn chance(&self, pull_strength: &Strength, pick: &Pick) -> f64 {
        let [along, across] = pick.force;
        let load = math::hypot(along, across / self.grip.across.si());
        let grip = Strength::Lognormal { median: self.grip.median.clone(), spread: self.grip.spread.clone() };
        let (stem, grip) = (pull_strength.hazard(pick.total()), grip.hazard(load));
        stem / (stem + grip)
    }

    /// Rows of the Brier scores of picks, of the stem law of `calibrated` and of the threshold of `paper`, against that of the picks' own base rate;
    /// `given`: the user gave them, and no parameter was fitted to them.
    pub fn rows(
        &self,
        name: &str,
        picks: &[Pick],
        [ours, paper]: [&Target; 2],
        given: bool,
    ) -> anyhow::Result<Vec<Row>> {
        let Some(stem) = Spec::preset(Preset::Calibrated).fruit.stem else {
            anyhow::bail!("calibrated has no stems")
        };
        let (low, high) = Spec::paper().fruit.detach_force.si();
        let chances: Vec<f64> =
            picks.iter().map(|pick| self.chance(&stem.release.pull_strength, pick)).collect();
        let over: Vec<f64> =
            picks.iter().map(|pick| ((pick.total() - low) / (high - low)).clamp(0.0, 1.0)).collect();
        let resamples =
            Resamples::of(Design::of((0..picks.len() as u32).map(|i| (0, i))), &Protocol::paper().bootstrap);
        let all: Vec<usize> = (0..picks.len()).collect();
        let successes = picks.iter().filter(|pick| pick.success).count();
        let base = brier_of_base_rate(picks, &all);
        let note = format!("{successes} of {} picks succeeded; base rate's score {base:.4}", picks.len());
        let row = |name: String, target: &Target, chances: &[f64], ends: [f64; 2]| {
            let worse = |of: &[usize]| Some(brier(picks, chances, of) - brier_of_base_rate(picks, of));
            let interval = resamples.interval_of(worse).ok();
            let by = interval.map_or_else(String::new, |[low, high]| {
                format!("; score less that of the base rate: {low:+.4} to {high:+.4} (95 %)")
            });
            let target = if given { target.of_sample(base, ends) } else { target.clone() };
            let score = brier(picks, chances, &all);
            Row {
                ci95: resamples.interval_of(|of| Some(brier(picks, chances, of))).ok(),
                ..target.row(&name, score, &format!("{note}{by}"))
            }
        };
        Ok(vec![
            row(format!("{name}_brier"), ours, &chances, [0.0, base]),
            row(format!("{name}_brier_paper"), paper, &over, [base, 1.0]),
        ])
    }
}

/// Mean squared error of the chances of some picks (Brier 1950).
fn brier(picks: &[Pick], chances: &[f64], of: &[usize]) -> f64 {
    let error = |&i: &usize| chances[i] - f64::from(u8::from(picks[i].success));
    of.iter().map(|i| error(i) * error(i)).sum::<f64>() / of.len() as f64
}

/// The score of a forecast that knows the share of successes among these picks, and nothing else.
fn brier_of_base_rate(picks: &[Pick], of: &[usize]) -> f64 {
    let share = of.iter().filter(|&&i| picks[i].success).count() as f64 / of.len() as f64;
    share * (1.0 - share)
}

/// Reads picks from a CSV file with the columns `along_n`, `across_n` (largest force along the hand's axis and across it \[N\]) and `success` (1 or 0);
/// other columns are ignored.
///
/// # Errors
/// The file cannot be read, lacks a column, has no pick, or a value that is none.
pub fn from_file(path: &Path) -> Result<Vec<Pick>, Failure> {
    let name = path.display();
    let text =
        orchard_input::text(path, LARGEST).map_err(|e| Failure::BadInput(format!("--picks {name}: {e}")))?;
    from_text(&text).map_err(|problem| Failure::BadInput(format!("--picks {name}: {problem}")))
}

fn from_text(text: &str) -> Result<Vec<Pick>, String> {
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text.as_bytes());
    let header = reader.headers().map_err(|e| e.to_string())?.clone();
    let column = |name: &str| {
        let found = header.iter().position(|column| column == name);
        found.ok_or_else(|| format!("no column '{name}'; the columns are {}", COLUMNS.join(", ")))
    };
    let [along, across, success] = COLUMNS.map(column);
    let (along, across, success) = (along?, across?, success?);
    let mut picks = Vec::new();
    for (index, record) in reader.records().enumerate() {
        let record = record.map_err(|e| e.to_string())?;
        let line = index + 2;
        let force = |column: usize, name: &str| {
            let text = &record[column];
            let value: Option<f64> = text.parse().ok().filter(|force| (0.0..=1e6).contains(force));
            value.ok_or_else(|| format!("line {line}, {name}: '{text}' is no force of 0 to 1e6 N"))
        };
        let force = [force(along, COLUMNS[0])?, force(across, COLUMNS[1])?];
        if force == [0.0; 2] {
            return Err(format!("line {line}: a pick without force"));
        }
        let success = match &record[success] {
            "1" => true,
            "0" => false,
            other => return Err(format!("line {line}, {}: '{other}' is neither 1 nor 0", COLUMNS[2])),
        };
        picks.push(Pick { force, success });
    }
    if picks.is_empty() { Err("no picks".to_owned()) } else { Ok(picks) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn picks_are_read_by_their_columns() {
        let text = "pick, across_n, along_n, success\n1, 2.5, 10, 1\n2, 0, 4e0, 0\n";
        let picks = [Pick { force: [10.0, 2.5], success: true }, Pick { force: [4.0, 0.0], success: false }];
        assert_eq!(from_text(text).unwrap(), picks);
        for (text, problem) in [
            ("along_n,success\n1,1\n", "no column 'across_n'"),
            ("along_n,across_n,success\n", "no picks"),
            ("along_n,across_n,success\n1,1,1\n-1,1,1\n", "line 3, along_n: '-1'"),
            ("along_n,across_n,success\n1,nan,1\n", "line 2, across_n: 'nan'"),
            ("along_n,across_n,success\n1,1,yes\n", "line 2, success: 'yes'"),
            ("along_n,across_n,success\n0,0,1\n", "line 2: a pick without force"),
            ("along_n,across_n,success\n1,1\n", "line: 2"),
        ] {
            let error = from_text(text).unwrap_err();
            assert!(error.contains(problem), "{error}");
        }
    }

    fn config() -> super::super::Picks {
        super::super::read().unwrap()
    }

    #[test]
    fn the_stated_target_is_the_base_rate_of_the_picks() {
        let config = config();
        let picks = config.picks.list();
        let t = &config.targets;
        let targets = [&t.picks_brier, &t.picks_brier_paper];
        let rows = config.picks.rows("a", &picks, targets, false).unwrap();
        let all: Vec<usize> = (0..picks.len()).collect();
        assert!((rows[0].target.unwrap() - brier_of_base_rate(&picks, &all)).abs() < 5e-5);
        assert_eq!(rows.iter().map(|row| row.pass).collect::<Vec<_>>(), [Some(true); 2], "{rows:?}");
        // The same picks from a file are judged by their own base rate.
        let given = config.picks.rows("b", &picks, targets, true).unwrap();
        assert_eq!((given[0].value, given[0].pass), (rows[0].value, Some(true)));
    }

    /// No pick says anything of its outcome when stem and grip are one law, and pulls along the axis.
    #[test]
    fn equal_laws_give_even_chances() {
        let mut config = config();
        let stem = Spec::preset(Preset::Calibrated).fruit.stem.unwrap().release.pull_strength;
        let Strength::Lognormal { median, spread } = stem.clone() else { panic!("the preset's law") };
        (config.picks.grip.median, config.picks.grip.spread) = (median, spread);
        for force in [1.0, 10.0, 100.0] {
            let even = config.picks.chance(&stem, &Pick { force: [force, 0.0], success: true });
            assert!((even - 0.5).abs() < 1e-12);
            // A pull across the hand is harder to hold on to.
            let across = config.picks.chance(&stem, &Pick { force: [0.0, force], success: true });
            assert!(across < 0.5, "{across}");
        }
    }
}
