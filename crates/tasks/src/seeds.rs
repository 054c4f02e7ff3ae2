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
    /// Any other seeds.
    Custom,
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

/// The named sets; the tuning seeds are in the field `tuning_seeds` of the protocol.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SeedSets {
    /// The official set.
    pub v1: OfficialSet,
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

/// Text that is hashed, followed by the number of the seed, into a seed of the official set.
const V1_RULE: &str = "orchardbench/v1/seed/";

/// Bytes of the hash used for a seed: 48 bits, which every JSON reader represents exactly.
const SEED_BYTES: usize = 6;

/// Seed number `k`, from 0, of the official set v1: the first 12 hexadecimal digits of SHA-256 of "orchardbench/v1/seed/K" in ASCII,
/// K in decimal.
pub fn v1_seed(k: u32) -> u64 {
    let hash = Sha256::digest(format!("{V1_RULE}{k}").as_bytes());
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
        let seeds = Protocol::paper().v1_seeds();
        assert_eq!(
            seeds,
            [59313826611509, 153838308915378, 260660316164482, 161178412302031, 163597065037352]
        );
        assert!(seeds.iter().all(|&seed| seed < 1 << 53), "a reader of JSON would round it");
    }

    #[test]
    fn sets_share_no_seed() {
        let protocol = Protocol::paper();
        let (v1, tuning) = (protocol.v1_seeds(), &protocol.tuning_seeds);
        assert!(v1.iter().all(|seed| !tuning.contains(seed)));
        assert!((0..v1.len()).all(|i| !v1[..i].contains(&v1[i])));
        // A config that tunes on an official seed is refused.
        let text = crate::protocol::PAPER_TOML.replacen("20250705", &v1[1].to_string(), 1);
        let e = Protocol::from_toml("x.toml", &text).unwrap_err().to_string();
        assert_eq!(e, "x.toml: tuning_seeds: 153838308915378 is a seed of the official set v1");
    }

    #[test]
    fn seeds_are_told_by_their_set() {
        let protocol = Protocol::paper();
        let (v1, tuning) = (protocol.v1_seeds(), protocol.tuning_seeds.clone());
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
    }
}
