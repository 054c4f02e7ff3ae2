//! The harvest's episodes, many at once.

use std::sync::Arc;

use orchard_picker::Controller;
use orchard_robot::Command;
use orchard_tasks::harvest::adapter::{Recorded, Simulated};
use orchard_tasks::harvest::episode::EpisodeKey;
use orchard_tasks::harvest::{Harvest, WorldFactory};
use orchard_world::World;

use crate::berths::{Berth, Berths};

/// Makes the worlds of a harvest, which advance together on a device.
#[derive(Debug)]
pub struct Together {
    harvest: Harvest,
    berths: Arc<Berths>,
}

impl Together {
    /// Lets the episodes of a harvest take berths, by their conditions.
    pub fn new(harvest: Harvest, berths: Arc<Berths>) -> Self {
        Self { harvest, berths }
    }
}

/// A world of an episode.
#[derive(Debug)]
pub struct Berthed {
    /// `None` only while its frame is computed.
    world: Option<Box<World>>,
    berth: Berth,
}

impl Simulated for Berthed {
    fn world(&self) -> &World {
        self.world.as_deref().unwrap_or_else(|| unreachable!("it is here between frames"))
    }

    fn world_mut(&mut self) -> &mut World {
        self.world.as_deref_mut().unwrap_or_else(|| unreachable!("it is here between frames"))
    }

    /// Advances it with all others.
    fn advance(&mut self, command: &Command) {
        self.world = self.world.take().map(|world| self.berth.step(world, command));
    }
}

impl WorldFactory for Together {
    type World = Berthed;
    type Controller = Recorded<Box<dyn Controller>>;

    fn build(&self, key: &EpisodeKey) -> Result<(Berthed, Self::Controller), String> {
        // The others wait while it grows, so that all start together.
        let mut berth = self.berths.take(&key.condition);
        let (world, controller) = self.harvest.build(key)?;
        berth.enter(&world).map_err(|e| e.to_string())?;
        Ok((Berthed { world: Some(Box::new(world)), berth }, controller))
    }

    fn at_once(&self, _: usize) -> usize {
        self.berths.lanes()
    }

    fn failed(&self) -> Option<String> {
        self.berths.lost()
    }
}
