//! Runs one episode with any controller, without a result folder.

use std::sync::atomic::AtomicBool;

use orchard_bench::{CODE_VERSION, SCHEMA_VERSION};
use orchard_scenario::Scenario;
use orchard_world::WorldError;

use crate::backend::Backend;
use crate::harvest::adapter::Recorded;
use crate::harvest::episode::{EpisodeKey, EpisodeRecord};
use crate::harvest::harness::run_episode;
use crate::protocol::Protocol;

/// Runs a scenario's controller on tree `tree` of `seed` for `seconds` (at least one frame) and returns the record of true events.
///
/// # Errors
/// The world cannot be built.
pub fn trial(scenario: &Scenario, seed: u64, tree: u32, seconds: f64) -> Result<EpisodeRecord, WorldError> {
    let frame = scenario.spec().sim.frame();
    let key = EpisodeKey {
        schema_version: SCHEMA_VERSION,
        code_version: CODE_VERSION.to_owned(),
        config_hash: scenario.hash(),
        scenario: scenario.names().clone(),
        condition: "trial".to_owned(),
        seed,
        world: tree,
        repeat: 0,
        backend: Backend::Cpu,
        horizon_frames: (seconds / frame).round().max(1.0) as u32,
    };
    let mut controller = Recorded::new(scenario.controller());
    let mut world = scenario.world(seed, tree, 0)?;
    let (protocol, never) = (Protocol::paper(), AtomicBool::new(false));
    match run_episode(key, &mut world, &mut controller, &protocol, frame, &never, &mut || ()) {
        Some(record) => Ok(record),
        None => unreachable!("nothing raises the flag"),
    }
}
