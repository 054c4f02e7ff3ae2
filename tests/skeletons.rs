//! Hashes of five grown trees, every bit of them, the same on every processor.
//!
//! `skeleton_hashes.txt` holds them under a version. A change of grammar, pipe model, clearance, leaves or config changes
//! them. After an intended change, raise the version, write the file anew,
//!
//! `cargo test -p orchard-tests --test suite skeletons::write -- --ignored`
//!
//! and say so in `CHANGELOG.md` under "Results".

use orchard_exchange::json;
use orchard_spec::{Preset, Spec};
use orchard_treegen::grow;
use sha2::{Digest, Sha256};

const COMMITTED: &str = include_str!("skeleton_hashes.txt");

/// Version of what grows. Raised with every change of the hashes.
const VERSION: u32 = 1;

const TREES: [(Preset, u64, u32); 5] = [
    (Preset::Paper, 20250704, 0),
    (Preset::Ternary, 0, 0),
    (Preset::Calibrated, 1, 0),
    (Preset::CalibratedMature, 1, 0),
    (Preset::CalibratedYoung, 1, 0),
];

fn computed() -> String {
    let mut lines = format!("version {VERSION}\n");
    for (preset, seed, world) in TREES {
        // The text has every bit of every number.
        let text = json::write(&grow(&Spec::preset(preset), seed, world).unwrap());
        let hash: String = Sha256::digest(text.as_bytes()).iter().map(|byte| format!("{byte:02x}")).collect();
        lines += &format!("{preset}-{seed}-{world} {hash}\n");
    }
    lines
}

#[test]
fn trees_have_the_committed_hashes() {
    let computed = computed();
    let differ: Vec<&str> = computed.lines().filter(|line| !COMMITTED.lines().any(|l| l == *line)).collect();
    assert!(
        differ.is_empty() && computed.lines().count() == COMMITTED.lines().count(),
        "These trees are not the ones of tests/skeleton_hashes.txt:\n  {}\n\
         After a change that is meant to change trees: raise VERSION, write the file anew with\n  \
         cargo test -p orchard-tests --test suite skeletons::write -- --ignored\n\
         and say so in CHANGELOG.md under \"Results\".",
        differ.join("\n  ")
    );
}

#[test]
#[ignore = "overwrites the committed hashes"]
fn write() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/skeleton_hashes.txt");
    std::fs::write(path, computed()).unwrap();
}
