//! The protocol constants of the benchmarks, read from `configs/bench/v1.toml` and what `configs/bench/field.toml` changes of it.

use std::collections::BTreeMap;

use orchard_quantity::{ConfigError, Count, CountLimits, Quantity, from_table, parse, with_base};
use orchard_scenario::{Changes, Scenario};
use orchard_statistics::{BootstrapRules, PairedRules};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::component::rules::ComponentRules;
use crate::detect::rules::DetectRules;
use crate::harvest::matrix::{ExhaustionRules, MatrixRules, SweepRules};
use crate::harvest::metrics;
use crate::seeds::{OfficialSet, SeedSetLabel, SeedSetName, official_seed};
use crate::verify::rules::VerifyRules;
use crate::zones::ZoneRules;

/// The protocol as TOML text.
pub const PAPER_TOML: &str = include_str!("../configs/bench/v1.toml");

/// Differences of the protocol of the benchmark in the field from that of benchmark v1, as TOML text.
pub const FIELD_TOML: &str = include_str!("../configs/bench/field.toml");

/// Names and texts of the protocols, of which the first is the one without a name.
const PROTOCOLS: [(&str, &str); 2] = [("v1", PAPER_TOML), ("field", FIELD_TOML)];

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
    /// Metrics for the paired tests of a sweep's conditions.
    pub tested: Vec<String>,
    /// The set of official scores.
    pub official: SeedSetName,
    /// The other seed sets.
    pub seed_sets: BTreeMap<SeedSetName, OfficialSet>,
    /// The short profile.
    pub quick: Profile,
    /// The official profile.
    pub full: Profile,
    /// The sweeps of the matrix, by name.
    pub sweeps: BTreeMap<String, SweepRules>,
    /// The other conditions of the matrix, by group and name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub conditions: BTreeMap<String, BTreeMap<String, Changes>>,
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
    /// Largest bruised volume of a fruit that is free of bruises.
    pub bruise_volume: Quantity,
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
        Self::of_table(file, parse(file, text)?)?.checked()
    }

    /// Reads a protocol, given as a whole or by what it changes of the one that it names; nothing is checked but single values.
    fn of_table(file: &str, table: toml::Table) -> Result<Self, ConfigError> {
        let text_of = |name: &str| {
            let text = PROTOCOLS.iter().find(|(known, _)| *known == name).map(|(_, text)| *text);
            let known = PROTOCOLS.map(|(name, _)| name).join(", ");
            text.ok_or_else(|| format!("no protocol '{name}'; the protocols are: {known}"))
        };
        let table = with_base(file, table, &text_of, &[])?;
        Ok(Self { file: file.to_owned(), ..from_table(file, table)? })
    }

    /// The protocol, if its values agree with each other.
    fn checked(self) -> Result<Self, ConfigError> {
        let (protocol, file) = (&self, &self.file);
        let densities = protocol.densities();
        let of_detect =
            || protocol.detect.problem(&densities).map(|(field, problem)| (field.to_owned(), problem));
        if let Some((field, problem)) = protocol.matrix_rules().problem().or_else(of_detect) {
            return Err(protocol.error(&field, problem));
        }
        if let Some(name) = protocol.tested.iter().find(|name| metrics::harvest_metric(name).is_none()) {
            return Err(protocol.error("tested", format!("{name} is not a metric of the harvest")));
        }
        if !protocol.seed_sets.contains_key(&protocol.official) {
            return Err(protocol.error("official", format!("there is no seed set {}", protocol.official)));
        }
        for &set in protocol.seed_sets.keys() {
            if !set.is_official() {
                return Err(protocol.error("seed_sets", format!("{set} is not the name of an official set")));
            }
            let official = protocol.seeds_of(set);
            if let Some(seed) = protocol.tuning_seeds.iter().find(|seed| official.contains(seed)) {
                return Err(
                    protocol.error("tuning_seeds", format!("{seed} is a seed of the official set {set}"))
                );
            }
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
        let mut table = scenario.rules().clone();
        table.entry(Scenario::PROTOCOL).or_insert_with(|| "v1".into());
        let protocol = Self::of_table("rules", table)?;
        // The other checks take time in proportion to the counts.
        match CountLimits::of(&[Self::paper(), Self::field()]).problem(&protocol) {
            Some((field, problem)) => Err(protocol.error(&field, problem)),
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

    /// The conditions of the matrix.
    pub fn matrix_rules(&self) -> MatrixRules<'_> {
        MatrixRules { sweeps: &self.sweeps, groups: &self.conditions, exhaustion: &self.exhaustion }
    }

    /// Foliage densities: those of the sweep, and of the detection task.
    pub fn densities(&self) -> Vec<f64> {
        self.sweeps.get("foliage").map(SweepRules::dial).unwrap_or_default()
    }

    /// The set of official scores.
    ///
    /// # Panics
    /// Never: a protocol without it is refused.
    pub fn official_set(&self) -> &OfficialSet {
        self.seed_sets.get(&self.official).unwrap_or_else(|| unreachable!("checked when it was read"))
    }

    /// The seeds of official scores.
    pub fn official_seeds(&self) -> Vec<u64> {
        self.seeds_of(self.official)
    }

    fn seeds_of(&self, set: SeedSetName) -> Vec<u64> {
        let count = self.seed_sets.get(&set).map_or(0, |set| set.seeds.get());
        (0..count).map(|k| official_seed(set, k)).collect()
    }

    /// The seeds of all official sets, on which nobody tunes.
    pub fn held_out_seeds(&self) -> Vec<u64> {
        self.seed_sets.keys().flat_map(|set| self.seeds_of(*set)).collect()
    }

    /// Returns the set that seeds belong to.
    pub fn label(&self, seeds: &[u64], trees: u32) -> SeedSetLabel {
        let tuning = (SeedSetName::Tuning, self.tuning_seeds.clone(), self.full.trees.get());
        let official =
            self.seed_sets.iter().map(|(name, set)| (*name, self.seeds_of(*name), set.trees.get()));
        let within = |all: &[u64]| !seeds.is_empty() && seeds.iter().all(|seed| all.contains(seed));
        [tuning].into_iter().chain(official).find(|(_, all, _)| within(all)).map_or_else(
            SeedSetLabel::custom,
            |(name, all, of_seed)| SeedSetLabel { name, whole: seeds == all && trees == of_seed },
        )
    }

    /// Checks names of conditions, groups and sweeps; `field` names their list.
    fn check_names(&self, field: &str, names: &[String]) -> Result<(), ConfigError> {
        self.matrix_rules().check_names(names).map_err(|problem| self.error(field, problem))
    }

    fn error(&self, field: &str, problem: String) -> ConfigError {
        ConfigError { file: self.file.clone(), field: field.to_owned(), problem }
    }

    /// The protocol of benchmark v1.
    ///
    /// # Panics
    /// Never: the embedded file is read in this crate's tests.
    pub fn paper() -> Self {
        Self::embedded("bench/v1.toml", PAPER_TOML)
    }

    /// The protocol of the benchmark in the field.
    ///
    /// # Panics
    /// Never: the embedded file is read in this crate's tests.
    pub fn field() -> Self {
        Self::embedded("bench/field.toml", FIELD_TOML)
    }

    fn embedded(file: &str, text: &str) -> Self {
        match Self::from_toml(file, text) {
            Ok(protocol) => protocol,
            Err(e) => unreachable!("embedded protocol: {e}"),
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
            assert!(metrics::infos().any(|info| info.name == name), "{name}");
        }
        for conditions in protocol.required.values() {
            for name in conditions.values().flat_map(BTreeMap::keys) {
                assert!(metrics::infos().any(|info| info.name == name), "{name}");
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
                assert!(protocol.densities().contains(&at.foliage), "{name} at {}", at.foliage);
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
