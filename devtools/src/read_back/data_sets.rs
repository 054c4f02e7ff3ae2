//! Data sets read by pycocotools, Pillow and numpy.

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use anyhow::Context;
use orchard_dataset::{DatasetConfig, Folder, Plan, Seeds};
use orchard_scenario::Scenario;
use orchard_spec::Preset;

use crate::python;
use orchard_program::Failure;
use orchard_program::Verdict;

/// Folder of the script and of the last run's output.
const SUITE: &str = "dataset";
/// One tree of each tuning seed but the last.
const SEEDS: Seeds = Seeds { first: 20250704, end: 20250706 };
const VIEWS: u32 = 4;

/// Writes data sets and compares; `Skipped` gives the reason why it cannot.
pub fn read_back() -> Result<Verdict, Failure> {
    let environment = match python::environment(SUITE)? {
        Ok(environment) => environment,
        Err(skipped) => return Ok(skipped),
    };
    let sets = [("paper", Preset::Paper), ("ideal", Preset::Randomised), ("d435i", Preset::Calibrated)];
    let sets = sets.map(|(camera, preset)| write_set(camera, preset));
    let sets = sets.into_iter().collect::<anyhow::Result<Vec<_>>>()?;
    environment.compare("read.py", &sets)?;
    Ok(Verdict::Agreed)
}

fn write_set(camera: &str, preset: Preset) -> anyhow::Result<PathBuf> {
    let folder = python::folder(SUITE).join(format!("{camera}-{}", preset.name()));
    // The files may come from an earlier version of the code.
    if folder.exists() {
        std::fs::remove_dir_all(&folder).with_context(|| folder.display().to_string())?;
    }
    let scenario = Scenario::of(&[("preset", preset.name()), ("camera", camera)])?;
    let plan = Plan::new(&scenario, &DatasetConfig::paper(), None, SEEDS, 1, VIEWS)?;
    orchard_dataset::run(
        &plan,
        &Folder::open(&folder, &plan)?,
        rayon::current_num_threads(),
        &AtomicBool::new(false),
        &orchard_dataset::NoProgress,
    )?;
    Ok(folder)
}
