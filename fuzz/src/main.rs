//! Fuzz targets: readers of input files, and the detector. `ORCHARD_FUZZ_TARGET` names the target; `cargo xtask fuzz` runs them all.
//!
//! One program holds all targets, since each program would be linked with the whole simulator.
#![no_main]

mod detect;
mod edit;
mod image_files;
mod readers;

use std::sync::OnceLock;

use libfuzzer_sys::fuzz_target;

/// A target: its name and one case.
type Target = (&'static str, fn(&[u8]));

const TARGETS: [Target; 12] = [
    ("detect", detect::run),
    ("image_files", image_files::run),
    ("plan", readers::plan),
    ("record", readers::record),
    ("board", readers::board),
    ("snapshot", readers::snapshot),
    ("mcap", readers::mcap),
    ("trajectory", readers::trajectory),
    ("tree", readers::tree),
    ("urdf", readers::urdf),
    ("onnx", readers::onnx),
    ("toml", readers::toml),
];

fn chosen() -> fn(&[u8]) {
    static CHOSEN: OnceLock<fn(&[u8])> = OnceLock::new();
    *CHOSEN.get_or_init(|| {
        let name = std::env::var("ORCHARD_FUZZ_TARGET").unwrap_or_default();
        let found = TARGETS.iter().find(|(known, _)| *known == name);
        found.unwrap_or_else(|| panic!("ORCHARD_FUZZ_TARGET={name}: no such target")).1
    })
}

fuzz_target!(|bytes: &[u8]| chosen()(bytes));
