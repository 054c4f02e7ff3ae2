//! Named seed sets. The name of a set is its version: a changed set gets another name.

use orchard_quantity::Count;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

/// A seed set by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SeedSetName {
    /// Seeds for tuning.
    Tuning,
    /// The official, held-out set of OrchardBench-v1; it must not be used for tuning.
    V1,
    /// The official, held-out set of the benchmark in the field; it must not be used for tuning.
    #[serde(rename = "field-v1")]
    FieldV1,
    /// Any other seeds.
    Custom,
}

impl SeedSetName {
    /// All sets.
    pub const ALL: [Self; 4] = [Self::Tuning, Self::V1, Self::FieldV1, Self::Custom];

    /// Name in results and on command lines.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tuning => "tuning",
            Self::V1 => "v1",
            Self::FieldV1 => "field-v1",
            Self::Custom => "custom",
        }
    }

    /// True for the set of a benchmark's scores.
    pub fn is_official(self) -> bool {
        matches!(self, Self::V1 | Self::FieldV1)
    }
}

impl std::fmt::Display for SeedSetName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

/// The seed set of a result.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SeedSetLabel {
    /// Name.
    pub name: SeedSetName,
    /// True if the result has all seeds of the set, in its order, with the set's number of trees per seed.
    pub whole: bool,
}

impl SeedSetLabel {
    /// Custom seeds.
    pub fn custom() -> Self {
        Self { name: SeedSetName::Custom, whole: false }
    }
}

/// An official set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OfficialSet {
    /// Seeds.
    pub seeds: Count,
    /// Trees per seed.
    pub trees: Count,
    /// Episodes per tree under the nominal condition, each with another start pose.
    pub repeats: Count,
}

/// Bytes of the hash used for a seed: 48 bits, which every JSON reader represents exactly.
const SEED_BYTES: usize = 6;

/// Seed number `k`, from 0, of an official set: the first 12 hexadecimal digits of SHA-256 of "orchardbench/SET/seed/K" in ASCII, with the
/// name of the set and K in decimal.
pub fn official_seed(set: SeedSetName, k: u32) -> u64 {
    let hash = Sha256::digest(format!("orchardbench/{set}/seed/{k}"));
    hash.iter().take(SEED_BYTES).fold(0, |seed, &byte| seed << 8 | u64::from(byte))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::Protocol;

    /// The set is published: these numbers never change. By hand, in Python:
    /// `from hashlib import sha256`
    /// `[int(sha256(b"orchardbench/v1/seed/%d" % k).hexdigest()[:12], 16) for k in range(5)]`
    #[test]
    fn v1_is_what_its_rule_says() {
        let seeds = Protocol::paper().official_seeds();
        assert_eq!(
            seeds,
            [59313826611509, 153838308915378, 260660316164482, 161178412302031, 163597065037352]
        );
        assert!(seeds.iter().all(|&seed| seed < 1 << 53), "a reader of JSON would round it");
    }

    /// By hand, in Python, as above with `b"orchardbench/field-v1/seed/%d"`.
    #[test]
    fn field_v1_is_what_its_rule_says() {
        let seeds = Protocol::field().official_seeds();
        assert_eq!(seeds, [82366113853635, 155886100722858, 5241075887876, 243015818109777, 245504369813078]);
    }

    #[test]
    fn names_are_those_of_results() {
        for name in SeedSetName::ALL {
            assert_eq!(serde_json::to_value(name).unwrap(), name.name());
        }
    }

    #[test]
    fn sets_share_no_seed() {
        let protocol = Protocol::paper();
        let all = [&*Protocol::field().held_out_seeds(), &protocol.tuning_seeds].concat();
        assert_eq!(all.len(), 13);
        assert!((0..all.len()).all(|i| !all[..i].contains(&all[i])));
        let v1 = protocol.official_seeds();
        // A config that tunes on an official seed is refused.
        let text = crate::protocol::PAPER_TOML.replacen("20250705", &v1[1].to_string(), 1);
        let e = Protocol::from_toml("x.toml", &text).unwrap_err().to_string();
        assert_eq!(e, "x.toml: tuning_seeds: 153838308915378 is a seed of the official set v1");
    }

    #[test]
    fn seeds_are_told_by_their_set() {
        let protocol = Protocol::paper();
        let (v1, tuning) = (protocol.official_seeds(), protocol.tuning_seeds.clone());
        let label = |seeds: &[u64], trees| {
            let label = protocol.label(seeds, trees);
            (label.name, label.whole)
        };
        assert_eq!(label(&v1, 6), (SeedSetName::V1, true));
        assert_eq!(label(&v1, 5), (SeedSetName::V1, false));
        assert_eq!(label(&v1[..4], 6), (SeedSetName::V1, false));
        assert_eq!(label(&tuning, 6), (SeedSetName::Tuning, true));
        assert_eq!(label(&tuning[..1], 6), (SeedSetName::Tuning, false));
        assert_eq!(label(&[v1[0], tuning[0]], 6), (SeedSetName::Custom, false));
        assert_eq!(label(&[], 6), (SeedSetName::Custom, false));
        let field = Protocol::field();
        let label = field.label(&field.official_seeds(), 24);
        assert_eq!((label.name, label.whole), (SeedSetName::FieldV1, true));
        assert_eq!(field.label(&v1, 6).name, SeedSetName::V1);
    }
}
