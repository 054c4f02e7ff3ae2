//! Saved states of environments.

use orchard_robot::Pictures;
use orchard_world::Snapshot;
use serde::{Deserialize, Serialize};

use super::{Episode, Shared, Slot};
use crate::error::EnvError;
use crate::report::Report;

/// Saved state of an environment.
#[derive(Serialize, Deserialize)]
struct Saved {
    identity: String,
    first: u32,
    episode: Episode,
    report: Report,
    world: Vec<u8>,
}

impl Slot {
    /// The state as bytes; `pictures` are those that lie elsewhere.
    pub fn save(&self, pictures: Option<Pictures>, shared: &Shared) -> Result<Vec<u8>, EnvError> {
        let Some((world, episode)) = &self.running else {
            return Err(EnvError::NotStarted { env: self.env });
        };
        let pictures = pictures.or_else(|| episode.pictures.clone());
        let saved = Saved {
            identity: shared.identity.clone(),
            first: self.first,
            episode: Episode { pictures, ..episode.clone() },
            report: self.report.clone(),
            world: world.snapshot().to_bytes(),
        };
        Ok(postcard::to_stdvec(&saved).unwrap_or_else(|e| unreachable!("lists of numbers serialise: {e}")))
    }

    /// The environment of a saved state; this one does not change.
    pub fn restored(&self, bytes: &[u8], shared: &Shared) -> Result<Self, EnvError> {
        let refused = |problem: String| EnvError::State { env: self.env, problem };
        let (saved, rest): (Saved, _) = postcard::take_from_bytes(bytes)
            .map_err(|_| refused("it is not a state, or it is damaged".to_owned()))?;
        let Saved { identity, first, episode, report, world: bytes } = saved;
        if identity != shared.identity || first != self.first || !rest.is_empty() {
            return Err(refused("it belongs to another scenario, setting or world".to_owned()));
        }
        let snapshot = Snapshot::from_bytes(&bytes).map_err(|e| refused(e.to_string()))?;
        let (seed, index) = shared.starts.world_of(episode.seed, first, episode.number);
        let mut world = shared.build(seed, index)?;
        world.restore(&snapshot).map_err(|e| refused(e.to_string()))?;
        let fit =
            |pictures: &Pictures| shared.encoding.pictures().is_some_and(|request| request.fits(pictures));
        let pictures = episode.pictures.as_ref().is_none_or(fit);
        if !(episode.task.fits(&world) && pictures) || episode.set.len() != shared.encoding.start().len() {
            return Err(refused("its episode does not fit its world".to_owned()));
        }
        let mut slot =
            Self { report, running: Some((Box::new(world), episode)), ..Self::new(self.env, first) };
        slot.look(shared);
        Ok(slot)
    }
}
