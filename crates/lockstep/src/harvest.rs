//! The harvest's episodes, many at once.

use std::sync::Arc;

use orchard_gpu::Gpu;
use orchard_picker::Controller;
use orchard_robot::Command;
use orchard_scenario::Scenario;
use orchard_tasks::harvest::adapter::{Recorded, Simulated};
use orchard_tasks::harvest::episode::EpisodeKey;
use orchard_tasks::harvest::{Harvest, WorldFactory};
use orchard_world::World;
use rayon::prelude::*;

use crate::lane::{Lockstep, LockstepError};
use crate::seats::{Seat, Seats};
use crate::tally::Tally;

/// Seed of the sample worlds, and their number for each scenario: our own choice. They are no worlds of any seed set.
const SAMPLE_SEED: u64 = 0x006c_616e_6573;
const SAMPLES: u32 = 16;

/// Largest crew of a harvest, our own choice: a frame of a crew waits for its slowest controller, and one that looks at an image takes many times as long as one that does not
/// (docs/computation/gpu-world.md has the times of 1,000 worlds in two crews and in eight).
const CREW: usize = 128;

/// Sample worlds of some scenarios, by which lanes are made ([`Lockstep::new`]). Worlds that cannot be built are left out.
pub fn samples(scenarios: &[Scenario]) -> Vec<World> {
    let keys: Vec<_> = scenarios.iter().flat_map(|of| (0..SAMPLES).map(move |index| (of, index))).collect();
    keys.into_par_iter().filter_map(|(of, index)| of.world(SAMPLE_SEED, index, 0).ok()).collect()
}

/// Makes the worlds of a harvest, which advance together on a device.
#[derive(Debug)]
pub struct Together {
    harvest: Harvest,
    seats: Arc<Seats>,
    lanes: usize,
}

/// Error: a harvest cannot run on a device.
#[derive(Debug, thiserror::Error)]
pub enum TogetherError {
    /// The device cannot step the worlds.
    #[error(transparent)]
    Lockstep(#[from] LockstepError),
    /// The threads cannot be started.
    #[error("cannot start threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

impl Together {
    /// Shares `lanes` of a device among the episodes of some conditions; `threads` compute beside it.
    ///
    /// # Errors
    /// The device cannot step the worlds of a condition, or has no room for so many lanes.
    pub fn new(
        gpu: &Gpu,
        harvest: Harvest,
        conditions: &[Scenario],
        lanes: usize,
        threads: usize,
    ) -> Result<Self, TogetherError> {
        let crews = Lockstep::crews(gpu, &samples(conditions), lanes, lanes.div_ceil(CREW).max(2), 1)?;
        Ok(Self { harvest, seats: Seats::new(crews, threads)?, lanes })
    }

    /// Counts of all frames so far.
    pub fn tally(&self) -> Tally {
        self.seats.tally()
    }

    /// Reason for which the device was lost, if it was.
    pub fn lost(&self) -> Option<String> {
        self.seats.lost()
    }
}

/// A world with its seat.
#[derive(Debug)]
pub struct Seated {
    /// `None` only while its frame is computed.
    world: Option<Box<World>>,
    seat: Seat,
}

impl Simulated for Seated {
    fn world(&self) -> &World {
        self.world.as_deref().unwrap_or_else(|| unreachable!("it is here between frames"))
    }

    fn world_mut(&mut self) -> &mut World {
        self.world.as_deref_mut().unwrap_or_else(|| unreachable!("it is here between frames"))
    }

    /// Advances it with all others.
    fn advance(&mut self, command: &Command) {
        self.world = self.world.take().map(|world| self.seat.step(world, *command));
    }
}

impl WorldFactory for Together {
    type World = Seated;
    type Controller = Recorded<Box<dyn Controller>>;

    fn build(&self, key: &EpisodeKey) -> Result<(Seated, Self::Controller), String> {
        // The others wait while it grows, so that all start together.
        let seat = self.seats.take();
        let (world, controller) = self.harvest.build(key)?;
        seat.enter(&world).map_err(|e| e.to_string())?;
        Ok((Seated { world: Some(Box::new(world)), seat }, controller))
    }

    fn at_once(&self, _: usize) -> usize {
        self.lanes
    }

    fn failed(&self) -> Option<String> {
        self.seats.lost()
    }
}
