//! The paper's figures for sweeps, zones and trees, read from `configs/paper/report.toml`.

use std::collections::BTreeMap;

use orchard_quantity::{ConfigError, Quantity, from_toml};
use serde::Deserialize;

/// The file as text.
pub const REPORT_TOML: &str = include_str!("../configs/paper/report.toml");

/// Figures of the paper, shown beside ours.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PaperFigures {
    /// Sweeps, by name and metric, in the order of the dial.
    pub sweeps: BTreeMap<String, BTreeMap<String, Vec<DialFigure>>>,
    /// Place success by canopy zone.
    pub zones: PaperZones,
    /// Fruit deposited per tree.
    pub trees: PaperTrees,
}

/// A figure at one value of a dial.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DialFigure {
    /// Value of the dial, in the sweep's unit.
    pub at: f64,
    /// The figure.
    pub value: f64,
    /// Unit of the figure.
    pub unit: String,
    /// Key of the source in `docs/references.bib`.
    pub source: String,
}

/// Place success by canopy zone.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PaperZones {
    /// Approximate rate in the middle thirds.
    pub middle: Quantity,
    /// Lower bound in the lower outer and the upper zones.
    pub others_low: Quantity,
    /// Upper bound in the lower outer and the upper zones.
    pub others_high: Quantity,
}

/// Fruit deposited per tree.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PaperTrees {
    /// Mean.
    pub mean: Quantity,
    /// Standard deviation between trees.
    pub deviation: Quantity,
}

impl PaperFigures {
    /// Reads them from TOML text; `file` names it in errors.
    ///
    /// # Errors
    /// Not TOML, a field missing or unknown, a value outside its range.
    pub fn from_toml(file: &str, text: &str) -> Result<Self, ConfigError> {
        from_toml(file, text)
    }

    /// Returns the figures of the paper.
    ///
    /// # Panics
    /// Never: the embedded file is read in this crate's tests.
    pub fn paper() -> Self {
        match Self::from_toml("paper/report.toml", REPORT_TOML) {
            Ok(figures) => figures,
            Err(e) => unreachable!("embedded figures: {e}"),
        }
    }

    /// A metric's figures over a sweep.
    pub fn of_sweep(&self, sweep: &str, metric: &str) -> &[DialFigure] {
        self.sweeps.get(sweep).and_then(|metrics| metrics.get(metric)).map_or(&[], Vec::as_slice)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_embedded_file_reads_and_names_known_metrics() {
        let figures = PaperFigures::from_toml("paper/report.toml", REPORT_TOML).unwrap();
        for (name, metrics) in &figures.sweeps {
            for (metric, at) in metrics {
                let known = orchard_tasks::harvest::metrics::infos().find(|info| info.name == metric);
                assert!(
                    known.is_some_and(|known| at.iter().all(|at| at.unit == known.unit)),
                    "{name}: {metric}"
                );
                assert!(at.windows(2).all(|pair| pair[0].at < pair[1].at), "{name}: {metric}");
            }
        }
        assert_eq!(figures.of_sweep("fruit", "harvest_completeness").len(), 2);
        assert!(figures.of_sweep("fruit", "no_metric").is_empty());
    }
}
