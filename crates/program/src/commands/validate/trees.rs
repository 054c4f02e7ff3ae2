//! Suite `trees`: populations of the calibrated presets against measured apple trees.

mod crop;

use indicatif::{ProgressBar, ProgressStyle};
use orchard_spec::{Preset, Spec};
use orchard_treegen::calibration::{Check, Evidence as Part, Measured as MeasuredTrees, Population};
use orchard_treegen::{Growth, grow_with_units};
use rayon::prelude::*;

use crate::rows::{Effort, Evidence, Measured, Role, Row};

/// Trees of a preset.
const TREES: u32 = 200;

/// Seed of the populations; tree i is its world i.
const SEED: u64 = 1;

/// Reason of the intervals.
const TOLERANCE: &str = "sampling interval of the measured trees, or 10 % where none is published";

/// Grows the populations, loads the dwarf trees with their crop, and compares.
pub fn measure(_: Effort) -> anyhow::Result<Measured> {
    let measured = MeasuredTrees::embedded();
    let style = ProgressStyle::with_template("{msg:18} [{bar:30}] {pos}/{len} trees")?;
    let bar = ProgressBar::new(4 * u64::from(TREES)).with_style(style);
    let mut populations = Vec::new();
    for preset in [Preset::CalibratedYoung, Preset::CalibratedMature, Preset::Calibrated] {
        bar.set_message(preset.name());
        populations.push(grow(&measured, preset, &bar)?);
    }
    let [young, mature, dwarf] = &populations[..] else { unreachable!("three presets") };
    let mut checks = measured.young_checks(young);
    checks.extend(measured.mature_checks(mature));
    checks.extend(measured.dwarf_checks(dwarf));
    bar.set_message("crop");
    checks.extend(crop::checks(&measured, dwarf, SEED, &bar)?);
    bar.finish_and_clear();
    let pictures = orchard_report::populations(&measured, young, mature, dwarf)?;
    Ok(Measured { rows: checks.into_iter().map(row).collect(), pictures, ..Measured::default() })
}

fn grow(measured: &MeasuredTrees, preset: Preset, bar: &ProgressBar) -> anyhow::Result<Population> {
    let spec = Spec::preset(preset);
    let grown = |world| -> anyhow::Result<Growth> {
        let tree = grow_with_units(&spec, SEED, world)?;
        bar.inc(1);
        Ok(tree)
    };
    let trees: Vec<Growth> = (0..TREES).into_par_iter().map(grown).collect::<anyhow::Result<_>>()?;
    Ok(measured.population(spec, trees))
}

fn row(check: Check) -> Row {
    let passes = check.passes();
    let target = check.target;
    let row = Row::measured(&check.name, check.value, target.unit.symbol())
        .within(target.value, [target.low, target.high]);
    let why_missed = target.why_missed.filter(|_| !passes);
    let role = match target.evidence {
        Part::Input => Role::Input,
        Part::Prediction => Role::Prediction,
    };
    let evidence = Evidence { source: target.source, tolerance: TOLERANCE.to_owned(), role };
    Row { evidence: Some(evidence), note: check.note, why_missed, ..row }
}
