//! Compares the figures of a population of grown trees with the targets of `configs/measured/trees.toml`.

use orchard_quantity::{Quantity, Unit, from_toml};
use orchard_spec::Spec;
use serde::{Deserialize, Serialize};

use crate::Growth;
use crate::morphometry::branches::{Survey, survey};
use crate::morphometry::shoots::ClassLimits;

pub mod dwarf;
pub mod mature;
pub mod young;

const MEASURED_TOML: &str = include_str!("../configs/measured/trees.toml");

/// Measurements of real trees.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Measured {
    /// Rules of the survey.
    pub survey: SurveyRules,
    /// Unpruned trees of four seasons.
    pub young: young::Young,
    /// Trees of eight seasons on rootstocks of all vigours.
    pub mature: mature::Mature,
    /// The dwarf trees among them.
    pub dwarf: dwarf::Dwarf,
}

/// Rules of the survey.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SurveyRules {
    /// Branches with a thinner base are twigs.
    pub branch_diameter: Quantity,
    /// Dry mass of wood over its fresh volume.
    pub dry_density: Quantity,
    /// Growth units below this length are short.
    pub short_shoot: Quantity,
    /// Growth units above this length are long.
    pub medium_shoot: Quantity,
    /// Bandwidth of the kernel that finds the mode of divergences.
    pub mode_bandwidth: Quantity,
}

/// A measured figure, and the interval that the figure of a grown population must meet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Target {
    /// The measured figure.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Unit of the three figures.
    pub unit: Unit,
    /// Key of the source in `docs/references.bib`.
    pub source: String,
    /// Reason why grown trees miss the target, if they do.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why_missed: Option<String>,
}

/// A measured sample by its quantiles at equal steps of probability, from 0 to 1.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sample {
    /// Size of the sample.
    pub n: u32,
    /// The quantiles.
    pub quantiles: Vec<f64>,
    /// Unit of the quantiles.
    pub unit: Unit,
    /// Key of the source in `docs/references.bib`.
    pub source: String,
}

/// Published moments of a sample.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Moments {
    /// Mean.
    pub mean: f64,
    /// Standard deviation.
    pub sd: f64,
    /// Unit of both.
    pub unit: Unit,
    /// Key of the source in `docs/references.bib`.
    pub source: String,
}

/// One figure of a grown population beside its target.
#[derive(Debug, Clone, PartialEq)]
pub struct Check {
    /// Name of the figure.
    pub name: String,
    /// The population's figure, in the target's unit.
    pub value: f64,
    /// The target.
    pub target: Target,
    /// Method of the figure, and the reason of a miss.
    pub note: Option<String>,
}

/// A population of trees with its survey.
#[derive(Debug, Clone)]
pub struct Population {
    /// Config from which they grew.
    pub spec: Spec,
    /// The trees.
    pub trees: Vec<Growth>,
    surveys: Vec<Survey>,
    limits: ClassLimits,
}

impl Measured {
    /// Returns the measurements that come with the crate.
    ///
    /// # Panics
    /// Never: the embedded file is read in this crate's tests.
    pub fn embedded() -> Self {
        match from_toml("measured/trees.toml", MEASURED_TOML) {
            Ok(measured) => measured,
            Err(e) => unreachable!("embedded file: {e}"),
        }
    }

    /// Surveys a population of trees.
    pub fn population(&self, spec: Spec, trees: Vec<Growth>) -> Population {
        let least = self.survey.branch_diameter.si();
        let surveys = trees.iter().map(|tree| survey(&tree.skeleton, least)).collect();
        let limits =
            ClassLimits { short: self.survey.short_shoot.si(), medium: self.survey.medium_shoot.si() };
        Population { spec, trees, surveys, limits }
    }
}

impl Target {
    /// True if a figure, in the target's unit, meets the target.
    pub fn holds(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }

    /// Compares a figure in SI units with this target.
    pub fn check(&self, name: &str, value_si: f64) -> Check {
        Check { name: name.to_owned(), value: value_si / self.unit.to_si(), target: self.clone(), note: None }
    }
}

impl Check {
    /// True if the target is met.
    pub fn passes(&self) -> bool {
        self.target.holds(self.value)
    }

    /// Adds a note.
    #[must_use]
    pub fn noted(self, note: impl Into<String>) -> Self {
        Self { note: Some(note.into()), ..self }
    }
}

impl Population {
    /// Surveys of the trees.
    pub fn surveys(&self) -> &[Survey] {
        &self.surveys
    }

    /// Values of a figure, one a tree.
    pub fn each(&self, figure: impl Fn(&Growth) -> f64) -> Vec<f64> {
        self.trees.iter().map(figure).collect()
    }

    /// Values of a figure of the survey, one a tree.
    pub fn each_survey(&self, figure: impl Fn(&Survey) -> f64) -> Vec<f64> {
        self.surveys.iter().map(figure).collect()
    }

    /// Angles of the limbs from the vertical, base to tip, as [`crate::morphometry::branches`] finds them \[rad\].
    pub fn limb_angles(&self) -> Vec<f64> {
        self.surveys.iter().flat_map(|survey| survey.limbs().map(|limb| limb.angle)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_embedded_file_reads_and_its_intervals_contain_the_measurements() {
        let measured = Measured::embedded();
        for target in [
            &measured.young.targets.growth_units_mean,
            &measured.mature.targets.mass_diameter,
            &measured.dwarf.targets.stem_mass,
        ] {
            assert!(target.holds(target.value), "{target:?}");
        }
        assert!(!measured.dwarf.targets.height.holds(2.4));
    }
}
