//! Lanes, and the worlds in them.

use std::sync::Arc;

use orchard_batch::TreeWorld;
use orchard_gpu::{BatchError, Gpu, GpuError, Room, WorldBatch};
use orchard_world::World;
use rayon::prelude::*;

use crate::fitting::{Fitting, tree_of};
use crate::profile::{Detail, Profile};
use crate::tally::Tally;

/// Room of the lanes for trees larger than the samples: by so much of each size, our own choice.
const MORE_ROOM: f64 = 0.4;

/// Error: worlds cannot advance together on a device.
#[derive(Debug, Clone, thiserror::Error)]
pub enum LockstepError {
    /// There is no sample world, or no lane.
    #[error("there are {samples} sample worlds and {lanes} lanes; at least one of each is needed")]
    Empty {
        /// Number of sample worlds.
        samples: usize,
        /// Number of lanes.
        lanes: usize,
    },
    /// The device refused the worlds, or was lost.
    #[error(transparent)]
    Device(#[from] GpuError),
}

impl LockstepError {
    /// True if it is about the worlds: others may advance on the device.
    pub fn is_of_worlds(&self) -> bool {
        matches!(self, Self::Device(GpuError::Batch(_)))
    }
}

impl From<BatchError> for LockstepError {
    fn from(error: BatchError) -> Self {
        Self::Device(error.into())
    }
}

/// Worlds that advance together.
#[derive(Debug)]
pub struct Lockstep {
    pub(crate) batch: WorldBatch,
    pub(crate) lanes: Vec<Option<Occupant>>,
    /// Most frames that a world takes at once.
    pub(crate) frames: usize,
    pub(crate) tally: Tally,
    pub(crate) profile: Option<Profile>,
}

/// A world in a lane.
#[derive(Debug)]
pub(crate) struct Occupant {
    /// Constants of the world.
    pub fitting: Arc<Fitting>,
    /// True while the device has its present state.
    pub is_on_device: bool,
    /// True once the tree stands in the lane.
    pub is_planted: bool,
    /// Impulse of the robot on wood since the world came to the device [N s].
    pub impulse: f64,
    /// Contacts lost, and solves that did not converge, since then.
    pub faults: [u32; 2],
}

impl Lockstep {
    /// Makes lanes, all empty, with room for trees like those of some sample worlds; all worlds to come have the samples' robot and rules. The worlds take at most `frames` of a span at once, for which there must be memory.
    ///
    /// # Errors
    /// There is no sample or no lane; the device cannot step such a world, or has no room for so many lanes.
    pub fn new(gpu: &Gpu, samples: &[World], lanes: usize, frames: usize) -> Result<Self, LockstepError> {
        let (Some(first), false) = (samples.first(), lanes == 0) else {
            return Err(LockstepError::Empty { samples: samples.len(), lanes });
        };
        let trees: Vec<TreeWorld> = samples.iter().map(tree_of).collect();
        let room = Room::for_trees(&trees, MORE_ROOM)?;
        let batch = WorldBatch::with_lanes(gpu, room, &trees[0], first.robot(), lanes, frames)?;
        let profile = None;
        Ok(Self {
            batch,
            lanes: (0..lanes).map(|_| None).collect(),
            tally: Tally::default(),
            profile,
            frames,
        })
    }

    /// Makes lanes of several locksteps of about the same size, so that the device computes a frame of one while the processor is busy with others; the lanes of the first come first. At most one crew a lane.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn crews(
        gpu: &Gpu,
        samples: &[World],
        lanes: usize,
        crews: usize,
        frames: usize,
    ) -> Result<Vec<Self>, LockstepError> {
        let each = lanes.div_ceil(crews.max(1));
        let firsts = (0..lanes.max(1)).step_by(each.max(1));
        firsts.map(|first| Self::new(gpu, samples, each.min(lanes - first), frames)).collect()
    }

    /// Number of lanes.
    pub fn len(&self) -> usize {
        self.lanes.len()
    }

    /// True if there is no lane.
    pub fn is_empty(&self) -> bool {
        self.lanes.is_empty()
    }

    /// Memory on the device \[bytes\].
    pub fn bytes(&self) -> usize {
        self.batch.bytes()
    }

    /// Counts of all frames so far.
    pub fn tally(&self) -> &Tally {
        &self.tally
    }

    /// Keeps the times of a frame's parts from now on, or no more.
    pub fn keep_profile(&mut self, detail: Option<Detail>) {
        self.profile = detail.map(|_| Profile::default());
        self.batch.keep_times(detail == Some(Detail::Kernels));
    }

    /// The times since [`Self::keep_profile`]; `None` if none are kept.
    pub fn profile(&self) -> Option<Profile> {
        let profile = self.profile.clone()?;
        // The next frame tells that a device was lost.
        let solves = self.batch.solves().unwrap_or_default();
        Some(Profile { device: self.batch.times(), solves, ..profile })
    }

    /// Lets worlds enter lanes, each in the place of the one that is there.
    ///
    /// # Errors
    /// The kernels cannot step one of them; the first such world is named. The others have entered.
    ///
    /// # Panics
    /// There is no such lane.
    pub fn enter(&mut self, entering: &[(usize, &World)]) -> Result<(), LockstepError> {
        let fittings: Vec<Result<Fitting, LockstepError>> =
            entering.par_iter().map(|(_, world)| self.fit(world)).collect();
        let mut entered = Ok(());
        for (&(lane, _), fitting) in entering.iter().zip(fittings) {
            match fitting {
                Ok(fitting) => self.enter_fitted(lane, Arc::new(fitting)),
                Err(e) => {
                    self.leave(lane);
                    entered = entered.and(Err(e));
                }
            }
        }
        entered
    }

    /// Finds what lanes need to know of a world's constants.
    ///
    /// # Errors
    /// The kernels cannot step it.
    pub fn fit(&self, world: &World) -> Result<Fitting, LockstepError> {
        Ok(Fitting::new(&self.batch, world)?)
    }

    /// Lets the world of a [`Self::fit`], in whatever state it is, enter a lane in the place of the one that is there.
    ///
    /// # Panics
    /// There is no such lane.
    pub fn enter_fitted(&mut self, lane: usize, fitting: Arc<Fitting>) {
        self.leave(lane);
        let (is_on_device, is_planted, impulse, faults) = (false, false, 0.0, [0; 2]);
        self.lanes[lane] = Some(Occupant { fitting, is_on_device, is_planted, impulse, faults });
    }

    /// True if the tree of the world in a lane is not too large for the device.
    ///
    /// # Panics
    /// There is no such lane.
    pub fn has_room(&self, lane: usize) -> bool {
        self.lanes[lane].as_ref().is_none_or(|occupant| occupant.fitting.fitted.is_some())
    }

    /// Empties a lane.
    ///
    /// # Panics
    /// There is no such lane.
    pub fn leave(&mut self, lane: usize) {
        if self.lanes[lane].take().is_some_and(|occupant| occupant.is_on_device) {
            self.batch.retire(lane);
        }
    }

    /// Tells that the state of a lane's world was changed by others: the device takes it anew.
    ///
    /// # Panics
    /// There is no such lane.
    pub fn renew(&mut self, lane: usize) {
        if let Some(occupant) = &mut self.lanes[lane] {
            occupant.is_on_device = false;
        }
    }
}
