//! One episode of anybody's controller: what a harness needs, without a result folder.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use orchard_picker::Controller;
use orchard_robot::RobotModel;
use orchard_spec::Spec;
use orchard_world::{World, WorldError};

use crate::adapter::Recorded;
use crate::episode::{CODE_VERSION, EpisodeKey, EpisodeRecord, SCHEMA_VERSION};
use crate::harness::run_episode;
use crate::protocol::Protocol;

/// Lets a controller harvest tree `tree` of `seed` in the nominal condition for `seconds` (at least one frame) and tells what
/// truly happened. `name` goes into the record.
///
/// # Errors
/// The world cannot be built.
pub fn trial<C: Controller>(
    name: &str,
    controller: impl FnOnce(&RobotModel) -> C,
    seed: u64,
    tree: u32,
    seconds: f64,
) -> Result<EpisodeRecord, WorldError> {
    let (spec, robot) = (Arc::new(Spec::paper()), Arc::new(RobotModel::paper()));
    let frame = spec.sim.frame();
    let key = EpisodeKey {
        schema_version: SCHEMA_VERSION,
        code_version: CODE_VERSION.to_owned(),
        config_hash: String::new(),
        preset: spec.preset.clone(),
        controller: name.to_owned(),
        condition: "trial".to_owned(),
        seed,
        world: tree,
        repeat: 0,
        horizon_frames: (seconds / frame).round().max(1.0) as u32,
    };
    let mut controller = Recorded::new(controller(&robot));
    let mut world = World::new(spec, robot, seed, tree)?;
    let (protocol, never) = (Protocol::paper(), AtomicBool::new(false));
    match run_episode(key, &mut world, &mut controller, &protocol, frame, &never, &mut || ()) {
        Some(record) => Ok(record),
        None => unreachable!("nothing raises the flag"),
    }
}
