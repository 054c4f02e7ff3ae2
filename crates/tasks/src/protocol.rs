//! The benchmark's protocol constants, read from `configs/bench/v1.toml`.

use std::collections::BTreeMap;

use orchard_quantity::{ConfigError, Count, CountLimits, Quantity, from_table, overlay, parse};
use orchard_scenario::Scenario;
use orchard_statistics::{BootstrapRules, PairedRules};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::component::rules::ComponentRules;
use crate::detect::rules::DetectRules;
use crate::harvest::matrix::Sweeps;
use crate::seeds::{SeedSetLabel, SeedSetName, SeedSets, v1_seed};
use crate::verify::rules::VerifyRules;
use crate::zones::ZoneRules;

/// The protocol as TOML text.
pub const PAPER_TOML: &str = include_str!("../configs/bench/v1.toml");

/// Seeds, horizons and rules of the benchmark.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Protocol {
    /// Version of the protocol and of the configs that belong to it; it is raised when a constant that affects results changes.
    pub version: String,
    /// Name of the preset.
    pub preset: String,
    /// Seeds for tuning.
    pub tuning_seeds: Vec<u64>,
    /// The other seed sets.
    pub seed_sets: SeedSets,
    /// The short profile.
    pub quick: Profile,
    /// The official profile.
    pub full: Profile,
    /// The matrix of conditions.
    pub sweeps: Sweeps,
    /// The condition `exhaustion`.
    pub exhaustion: ExhaustionRules,
    /// Thresholds of an episode.
    pub rules: Rules,
    /// The detection task.
    pub detect: DetectRules,
    /// The component tasks.
    pub component: ComponentRules,
    /// Open-loop verification.
    pub verify: VerifyRules,
    /// Section of the scaling task as a raw table, parsed by [`Protocol::section`].
    scaling: toml::Table,
    /// Section of the leaderboard as a raw table.
    leaderboard: toml::Table,
    /// Percentiles of the zone frame.
    pub zones: ZoneRules,
    /// Confidence intervals.
    pub bootstrap: BootstrapRules,
    /// Paired tests.
    pub paired: PairedRules,
    /// Figures of the paper's nominal baseline, by metric name.
    pub published: BTreeMap<String, Published>,
    /// Requirements on each controller over the tuning seeds, by controller, condition and metric name.
    pub required: BTreeMap<String, BTreeMap<String, BTreeMap<String, Requirement>>>,
    /// Name of the protocol's file, for errors in the raw sections.
    #[serde(skip)]
    file: String,
}

/// Profile: the size of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Profile {
    /// Number of tuning seeds, from the first.
    pub seeds: Count,
    /// Trees per seed.
    pub trees: Count,
    /// Length of an episode under all conditions but `exhaustion`.
    pub horizon: Quantity,
    /// Names of the conditions and sweeps that are run.
    pub conditions: Vec<String>,
}

/// The condition `exhaustion`: the nominal one until nothing reachable is left.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExhaustionRules {
    /// Longest episode.
    pub horizon: Quantity,
}

/// Thresholds by which an episode is judged.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rules {
    /// Time without motion after which the robot counts as stalled.
    pub stall_time: Quantity,
    /// Longest time that moving fruit gets to come to rest after the budget is spent.
    pub settle_time: Quantity,
    /// Base displacement that counts as motion.
    pub stall_base: Quantity,
    /// Turn of an arm joint or of the base that counts as motion.
    pub stall_joint: Quantity,
    /// Fewest valid pixels of a visible fruit.
    pub visible_pixels: Count,
    /// Stem tension at detachment above which a fruit counts as torn off.
    pub stem_pull: Quantity,
    /// Largest energy of an impact that leaves no bruise.
    pub bruise_energy: Quantity,
    /// Time without a finger on a hanging fruit that closes a contact attempt.
    pub contact_gap: Quantity,
}

/// A published result, for comparison only.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Published {
    /// The figure as published.
    pub value: f64,
    /// Unit.
    pub unit: String,
    /// Key of the source in `docs/references.bib`.
    pub source: String,
}

/// Requirement on a metric's mean: one of the two bounds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Requirement {
    /// Smallest mean that meets it.
    #[serde(default)]
    pub at_least: Option<f64>,
    /// Largest mean that meets it.
    #[serde(default)]
    pub at_most: Option<f64>,
    /// Unit.
    pub unit: String,
    /// Key of the source in `docs/references.bib`.
    pub source: String,
}

impl Requirement {
    /// True if a mean meets the requirement; without a mean it is not met.
    pub fn is_met(&self, mean: Option<f64>) -> bool {
        mean.is_some_and(|mean| {
            self.at_least.is_none_or(|least| mean >= least) && self.at_most.is_none_or(|most| mean <= most)
        })
    }

    /// Returns the bound as text.
    pub fn bound(&self) -> String {
        let least = self.at_least.map(|bound| format!(">= {bound}"));
        let most = self.at_most.map(|bound| format!("<= {bound}"));
        least.or(most).unwrap_or_default()
    }
}

impl Protocol {
    /// Reads a protocol from TOML text; `file` names it in errors.
    ///
    /// # Errors
    /// Not TOML, a field missing or unknown, a value outside its range, a tuning seed of an official set, fewer tuning seeds than a
    /// profile needs, a profile without conditions or with unknown ones, a requirement without exactly one bound, values of a sweep that do
    /// not ascend, foliage densities that lack that of the ablation.
    pub fn from_toml(file: &str, text: &str) -> Result<Self, ConfigError> {
        Self::of_table(file, parse(file, text)?)
    }

    fn of_table(file: &str, table: toml::Table) -> Result<Self, ConfigError> {
        Self { file: file.to_owned(), ..from_table(file, table)? }.checked()
    }

    /// The protocol, if its values agree with each other.
    fn checked(self) -> Result<Self, ConfigError> {
        let (protocol, file) = (&self, &self.file);
        let densities = protocol.sweeps.densities();
        if let Some((field, problem)) =
            protocol.sweeps.problem().or_else(|| protocol.detect.problem(&densities))
        {
            return Err(ConfigError { file: file.clone(), field: field.to_owned(), problem });
        }
        let official = protocol.v1_seeds();
        if let Some(seed) = protocol.tuning_seeds.iter().find(|seed| official.contains(seed)) {
            let (file, field) = (file.clone(), "tuning_seeds".to_owned());
            return Err(ConfigError {
                file,
                field,
                problem: format!("{seed} is a seed of the official set v1"),
            });
        }
        for (name, profile) in [("quick", &protocol.quick), ("full", &protocol.full)] {
            let count = profile.seeds.get() as usize;
            if count > protocol.tuning_seeds.len() {
                return Err(ConfigError {
                    file: file.clone(),
                    field: format!("{name}.seeds"),
                    problem: format!(
                        "value {count} exceeds the {} tuning seeds",
                        protocol.tuning_seeds.len()
                    ),
                });
            }
            protocol.check_names(&format!("{name}.conditions"), &profile.conditions)?;
        }
        for (controller, conditions) in &protocol.required {
            for (condition, metrics) in conditions {
                let name = std::slice::from_ref(condition);
                protocol.check_names(&format!("required.{controller}"), name)?;
                let unclear = metrics.iter().find(|(_, a)| a.at_least.is_some() == a.at_most.is_some());
                if let Some((metric, _)) = unclear {
                    return Err(ConfigError {
                        file: file.clone(),
                        field: format!("required.{controller}.{condition}.{metric}"),
                        problem: "needs exactly one of at_least and at_most".to_owned(),
                    });
                }
            }
        }
        Ok(self)
    }

    /// The protocol with the figures of a scenario's rules replaced.
    ///
    /// # Errors
    /// Rules that the protocol does not have, or a value outside its range.
    pub fn of_scenario(scenario: &Scenario) -> Result<Self, ConfigError> {
        if scenario.rules().is_empty() {
            return Ok(Self::paper());
        }
        let mut table = parse("bench/v1.toml", PAPER_TOML)?;
        overlay(&mut table, scenario.rules().clone(), &[]);
        let file = "rules".to_owned();
        let protocol = Self { file: file.clone(), ..from_table(&file, table)? };
        // The other checks take time in proportion to the counts.
        match CountLimits::of(&[Self::paper()]).problem(&protocol) {
            Some((field, problem)) => Err(ConfigError { file, field, problem }),
            None => protocol.checked(),
        }
    }

    /// Reads the section of a task that has its rules in a crate of its own: `scaling` or `leaderboard`.
    ///
    /// # Errors
    /// No such section, a field missing or unknown, or a value outside its range; file and field are named.
    pub fn section<T: DeserializeOwned>(&self, name: &str) -> Result<T, ConfigError> {
        let table = match name {
            "scaling" => &self.scaling,
            "leaderboard" => &self.leaderboard,
            _ => return Err(self.error(name, "no such section".to_owned())),
        };
        from_table(&self.file, table.clone()).map_err(|e: ConfigError| {
            let field = if e.field == "." { name.to_owned() } else { format!("{name}.{}", e.field) };
            ConfigError { field, ..e }
        })
    }

    /// The seeds of the official set v1.
    pub fn v1_seeds(&self) -> Vec<u64> {
        (0..self.seed_sets.v1.seeds.get()).map(v1_seed).collect()
    }

    /// Returns the set that seeds belong to.
    pub fn label(&self, seeds: &[u64], trees: u32) -> SeedSetLabel {
        let sets = [
            (SeedSetName::Tuning, self.tuning_seeds.clone(), self.full.trees.get()),
            (SeedSetName::V1, self.v1_seeds(), self.seed_sets.v1.trees.get()),
        ];
        let within = |all: &[u64]| !seeds.is_empty() && seeds.iter().all(|seed| all.contains(seed));
        sets.into_iter().find(|(_, all, _)| within(all)).map_or_else(
            SeedSetLabel::custom,
            |(name, all, of_seed)| SeedSetLabel { name, whole: seeds == all && trees == of_seed },
        )
    }

    /// Checks names of conditions and sweeps; `field` names their list.
    fn check_names(&self, field: &str, names: &[String]) -> Result<(), ConfigError> {
        self.sweeps.check_names(names).map_err(|problem| self.error(field, problem))
    }

    fn error(&self, field: &str, problem: String) -> ConfigError {
        ConfigError { file: self.file.clone(), field: field.to_owned(), problem }
    }

    /// The protocol of preset `paper`.
    ///
    /// # Panics
    /// Never: the embedded file is read in this crate's tests.
    pub fn paper() -> Self {
        match Self::from_toml("bench/v1.toml", PAPER_TOML) {
            Ok(protocol) => protocol,
            Err(e) => unreachable!("embedded preset: {e}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn embedded_preset_reads_and_publishes_known_metrics() {
        let protocol = Protocol::from_toml("bench/v1.toml", PAPER_TOML).unwrap();
        assert_eq!(protocol.tuning_seeds, [20250704, 20250705, 20250706]);
        for name in protocol.published.keys() {
            assert!(crate::harvest::metrics::METRICS.iter().any(|m| m.info.name == name), "{name}");
        }
        for conditions in protocol.required.values() {
            for name in conditions.values().flat_map(BTreeMap::keys) {
                assert!(crate::harvest::metrics::METRICS.iter().any(|m| m.info.name == name), "{name}");
            }
        }
        for controller in protocol.required.keys() {
            assert!(["baseline", "expert"].contains(&controller.as_str()), "{controller}");
        }
        let detect = &protocol.detect;
        for (name, at) in detect.published.iter().chain(&detect.required) {
            let known = crate::detect::METRICS.iter().any(|m| m.info.name == name)
                || crate::detect::ERRORS.iter().any(|e| e.name == name);
            assert!(known, "{name}");
            for at in at {
                assert!(protocol.sweeps.densities().contains(&at.foliage), "{name} at {}", at.foliage);
            }
        }
        let variants = crate::detect::variants(&orchard_perception::DetectorConfig::paper());
        for name in detect.ablation.published.keys() {
            assert!(variants.iter().any(|v| v.name == name), "{name}");
        }
    }

    #[test]
    fn more_seeds_than_listed_are_refused() {
        let text = PAPER_TOML.replacen("seeds = { value = 3", "seeds = { value = 4", 1);
        let e = Protocol::from_toml("x.toml", &text).unwrap_err().to_string();
        assert_eq!(e, "x.toml: full.seeds: value 4 exceeds the 3 tuning seeds");
    }

    #[test]
    fn requirements_have_one_bound() {
        let requirement = |at_least, at_most| Requirement {
            at_least,
            at_most,
            unit: "1".into(),
            source: "protocol".into(),
        };
        assert!(
            requirement(Some(0.5), None).is_met(Some(0.5)) && !requirement(Some(0.5), None).is_met(Some(0.4))
        );
        assert!(
            requirement(None, Some(0.5)).is_met(Some(0.5)) && !requirement(None, Some(0.5)).is_met(Some(0.6))
        );
        assert!(!requirement(Some(0.5), None).is_met(None));
        assert_eq!(
            (requirement(Some(0.5), None).bound(), requirement(None, Some(6.0)).bound()),
            (">= 0.5".into(), "<= 6".into())
        );
        let text = PAPER_TOML.replacen("{ at_least = 0.45,", "{ at_least = 0.45, at_most = 1.0,", 1);
        let e = Protocol::from_toml("x.toml", &text).unwrap_err().to_string();
        assert_eq!(
            e,
            "x.toml: required.baseline.nominal.place_success_per_attempt: needs exactly one of at_least and at_most"
        );
    }

    #[test]
    fn densities_that_make_no_sweep_are_refused() {
        let refused = |from: &str, to: &str| {
            let text = PAPER_TOML.replacen(from, to, 1);
            assert_ne!(text, PAPER_TOML);
            Protocol::from_toml("x.toml", &text).unwrap_err().to_string()
        };
        let e = refused("{ value = 0.3, range = [0.0, 3.0]", "{ value = 0.0, range = [0.0, 3.0]");
        assert_eq!(e, "x.toml: sweeps.foliage: values must ascend without duplicates");
        let e = refused("foliage = { value = 0.6", "foliage = { value = 0.7");
        assert_eq!(e, "x.toml: detect.ablation.foliage: value 0.7 is not in sweeps.foliage");
    }
}
