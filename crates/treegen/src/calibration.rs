//! Compares the figures of a population of grown trees with the targets of `configs/measured/trees.toml`.

use orchard_quantity::{Quantity, Unit, from_toml};
use orchard_spec::Spec;
use serde::{Deserialize, Serialize};

use crate::morphometry::branches::{Survey, survey};
use crate::morphometry::distribution::{ks_critical, ks_distance, median, quantile_cdf};
use crate::morphometry::shoots::ClassLimits;
use crate::{Growth, Skeleton};

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
    /// Thinnest wood that was not counted as a twig, of each tree.
    pub thinnest: Thinnest,
    /// Dry mass of wood over its fresh volume.
    pub dry_density: Quantity,
    /// Growth units below this length are short.
    pub short_shoot: Quantity,
    /// Growth units above this length are long.
    pub medium_shoot: Quantity,
    /// Bandwidth of the kernel that finds the mode of divergences.
    pub mode_bandwidth: Quantity,
}

/// Thinnest pieces of wood of the surveyed trees; thinner wood was counted as twigs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Thinnest {
    /// Diameter of each tree's trunk, and of its thinnest piece.
    pub trees: Vec<[f64; 2]>,
    /// Unit of the diameters.
    pub unit: Unit,
    /// Key of the source in `docs/references.bib`.
    pub source: String,
}

impl Thinnest {
    /// Limit of the surveyed tree whose trunk is nearest in diameter \[m\]; 0 without trees.
    pub fn like(&self, trunk_diameter: f64) -> f64 {
        let apart = |tree: &&[f64; 2]| (tree[0] * self.unit.to_si() - trunk_diameter).abs();
        let nearest = self.trees.iter().min_by(|a, b| apart(a).total_cmp(&apart(b)));
        nearest.map_or(0.0, |tree| tree[1] * self.unit.to_si())
    }
}

/// Part of a figure in the fit of a preset.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Evidence {
    /// A parameter of the preset was fitted to the figure itself.
    Input,
    /// The figure follows from parameters that were fitted to others.
    #[default]
    Prediction,
}

impl Evidence {
    /// The name in files and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Input => "input",
            Self::Prediction => "prediction",
        }
    }
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
    /// Part of the figure in the fit.
    #[serde(default)]
    pub evidence: Evidence,
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
    /// Part of the distribution in the fit.
    #[serde(default)]
    pub evidence: Evidence,
    /// Reason why grown trees miss the distribution, if they do.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why_missed: Option<String>,
}

impl Sample {
    /// Compares values in SI units with the sample: the Kolmogorov-Smirnov distance must be below the one that two samples of one
    /// distribution and of these sizes exceed with a chance of 5 %.
    pub fn check(&self, name: &str, values_si: &[f64]) -> Check {
        let values: Vec<f64> = values_si.iter().map(|value| value / self.unit.to_si()).collect();
        let distance = ks_distance(&values, |x| quantile_cdf(&self.quantiles, x));
        let target = Target {
            value: 0.0,
            low: 0.0,
            high: ks_critical(self.n as usize, values.len()),
            unit: Unit::One,
            source: self.source.clone(),
            evidence: self.evidence,
            why_missed: self.why_missed.clone(),
        };
        let note = format!(
            "{} values of {} measured; medians {:.3} and {:.3}",
            values.len(),
            self.n,
            median(&values),
            median(&self.quantiles)
        );
        target.check(name, distance).noted(note)
    }
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
        let like_measured =
            |tree: &Growth| survey(&tree.skeleton, self.survey.thinnest.like(trunk_diameter(&tree.skeleton)));
        let surveys = trees.iter().map(like_measured).collect();
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

/// Diameter of the trunk's first link \[m\].
pub(crate) fn trunk_diameter(skeleton: &Skeleton) -> f64 {
    skeleton.segments.first().map_or(0.0, |segment| 2.0 * segment.radius)
}

/// Height of the highest tip \[m\].
fn height(skeleton: &Skeleton) -> f64 {
    skeleton.segments.iter().map(|segment| segment.p_tip_world().z).fold(0.0, f64::max)
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

    #[test]
    fn a_tree_is_surveyed_like_the_measured_one_of_its_size() {
        let thinnest = Measured::embedded().survey.thinnest;
        for (trunk, limit) in [(0.010, 14.6), (0.0574, 16.0), (0.0576, 10.1), (0.400, 23.5)] {
            assert!((thinnest.like(trunk) - 1e-3 * limit).abs() < 1e-12, "{trunk}");
        }
        assert_eq!(Thinnest { trees: Vec::new(), ..thinnest }.like(0.1), 0.0);
    }

    /// The measured values themselves are no distance from their quantiles but that of a step; shifted ones are.
    #[test]
    fn a_sample_holds_for_its_own_values() {
        let sample = Measured::embedded().mature.samples.limb_length;
        let own: Vec<f64> = sample.quantiles.iter().map(|cm| 1e-2 * cm).collect();
        let check = sample.check("own", &own);
        assert!(
            check.passes() && check.value <= 1.0 / 21.0 + 1e-12 && check.target.evidence == Evidence::Input
        );
        let longer: Vec<f64> = own.iter().map(|m| m + 1.0).collect();
        assert!(!sample.check("longer", &longer).passes());
    }
}
