//! The harvest's episodes, many at once.

use std::sync::Arc;

use orchard_picker::Controller;
use orchard_tasks::harvest::adapter::Recorded;
use orchard_tasks::harvest::episode::EpisodeKey;
use orchard_tasks::harvest::{Harvest, WorldFactory};
use orchard_tasks::stage::Stage;

use crate::berthed::Berthed;
use crate::berths::Berths;

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

impl WorldFactory for Together {
    type World = Berthed;
    type Controller = Recorded<Box<dyn Controller>>;

    fn build(&self, key: &EpisodeKey) -> Result<(Berthed, Self::Controller), String> {
        // The others wait while it grows, so that all start together.
        let berth = self.berths.take(&key.condition);
        let (world, controller) = self.harvest.build(key)?;
        Ok((Stage::enter(&*self.berths, berth, world)?, controller))
    }

    fn at_once(&self, _: usize) -> usize {
        self.berths.lanes()
    }

    fn failed(&self) -> Option<String> {
        self.berths.lost()
    }
}
