//! Recordings read by mcap and mcap-protobuf-support.

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use anyhow::Context;
use orchard_bench::store::{Store, write_json};
use orchard_bench::{NoProgress, Session, run_task};
use orchard_camera::Sensor;
use orchard_geometry::Intrinsics;
use orchard_recording::{Channel, RecordingConfig, Recordings, name_of};
use orchard_scenario::Scenario;
use orchard_spec::Spec;
use orchard_tasks::harvest::Episodes;
use orchard_tasks::harvest::Harvest;
use serde::Serialize;

use crate::python;
use crate::workspace;
use orchard_program::Failure;
use orchard_program::Verdict;

/// Folder of the script and of the last run's output.
const SUITE: &str = "recording";
/// The tree, and how long it is harvested \[s\]: the first fruit is in the bucket by then.
const SEED: u64 = 20250704;
const SECONDS: f64 = 12.0;

/// Input of the Python script.
#[derive(Serialize)]
struct Case {
    file: PathBuf,
    layout: PathBuf,
    topics: Vec<&'static str>,
    frames: u32,
    /// Step between points of a cloud \[pixels\], in columns and rows.
    stride: u32,
    /// Largest motion that keeps an item's recorded pose \[m\].
    still: f64,
    #[serde(flatten)]
    camera: Intrinsics,
}

/// Records an episode and compares; `Skipped` gives the reason why it cannot.
pub fn read_back() -> Result<Verdict, Failure> {
    let environment = match python::environment(SUITE)? {
        Ok(environment) => environment,
        Err(skipped) => return Ok(skipped),
    };
    let case = write_case()?;
    environment.compare("read.py", &[case])?;
    Ok(Verdict::Agreed)
}

fn write_case() -> anyhow::Result<PathBuf> {
    let folder = python::folder(SUITE).join("result");
    // The files may come from an earlier version of the code.
    if folder.exists() {
        std::fs::remove_dir_all(&folder).with_context(|| folder.display().to_string())?;
    }
    let harvest = Harvest::new(Scenario::of(&[("controller", "expert")])?)?;
    let plan = harvest.plan("quick", vec![SEED], 1, SECONDS);
    let (store, config) = (Store::open(&folder)?, RecordingConfig::paper());
    let recordings = Recordings::new(&folder, config.clone(), harvest.scenario());
    let stop = AtomicBool::new(false);
    let task = Episodes { plan: &plan, factory: &harvest, watch: &recordings };
    let result = run_task(&task, &Session::whole(&store, 1, &stop), &NoProgress)?;
    let episode = result.records.first().context("an episode of one tree")?;
    let case = Case {
        file: folder.join(name_of(&episode.key)),
        layout: workspace::root().join("assets/foxglove/orchardbench.json"),
        topics: Channel::ALL.iter().map(|channel| channel.topic()).collect(),
        frames: episode.frames,
        stride: config.points.stride.get(),
        still: config.transforms.distance.si(),
        camera: *Sensor::new(&Spec::paper().camera).intrinsics(),
    };
    let path = folder.join("case.json");
    write_json(&path, &case)?;
    Ok(path)
}
