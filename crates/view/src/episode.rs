//! A recorded episode from its file.

use std::sync::Arc;

use orchard_picker::ControllerKind;
use orchard_recording::Recording;
use orchard_scenario::Options;
use orchard_tasks::harvest::Harvest;

use crate::stage::{Setup, Stage};

/// Shows the episode of a recording, whose worlds `harvest` builds ([`Recording::check`] says whether it does). Options that are `given` lead to
/// the dials; without any, the recording's own parts do, if all are built in.
///
/// # Errors
/// The commands cannot be read, or the world cannot be built; the message names the file.
pub fn recorded(
    recording: &Recording,
    harvest: &Harvest,
    given: Options,
    controllers: &[Arc<dyn ControllerKind>],
) -> Result<Stage, String> {
    let commands = recording.commands().map_err(|e| e.to_string())?;
    let at = |e: &dyn std::fmt::Display| format!("{}: {e}", recording.path().display());
    let key = &recording.header().key;
    let scenario = harvest.scenario_of(&key.condition).map_err(|e| at(&e))?;
    let options = if given.is_empty() { Options::of_names(scenario.names()).ok() } else { Some(given) };
    let setup = Setup { options, controllers: controllers.to_vec(), seed: key.seed, index: key.world };
    Stage::of_recording(setup, scenario, key.repeat, commands).map_err(|e| at(&e))
}
