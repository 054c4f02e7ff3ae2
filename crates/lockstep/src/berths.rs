//! Berths: places for worlds of several kinds, on a device or beside it, which threads take for one world after the other.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use orchard_gpu::{Gpu, WorldBatch};
use orchard_robot::Command;
use orchard_scenario::Scenario;
use orchard_world::World;
use rayon::ThreadPoolBuilder;
use rayon::prelude::*;

use crate::fitting::tree_of;
use crate::lane::{Lockstep, LockstepError};
use crate::seats::{Seat, Seats};
use crate::tally::Tally;

/// Seed of the sample worlds, and their number for each scenario: our own choice. They are no worlds of any seed set.
const SAMPLE_SEED: u64 = 0x006c_616e_6573;
const SAMPLES: u32 = 16;
/// Number of them for each of several conditions, of which most share lanes.
const SAMPLES_OF_MANY: u32 = 8;

/// Largest crew, our own choice: a frame of a crew waits for its slowest controller, and one that looks at an image takes many times as long as one that does not
/// (docs/computation/gpu-world.md has the times of 1,000 worlds in two crews and in eight).
const CREW: usize = 128;

/// Sample worlds of a scenario, by which lanes are made ([`Lockstep::new`]). Worlds that cannot be built are left out.
pub fn samples(scenario: &Scenario) -> Vec<World> {
    sampled(scenario, SAMPLES)
}

fn sampled(scenario: &Scenario, count: u32) -> Vec<World> {
    (0..count).into_par_iter().filter_map(|index| scenario.world(SAMPLE_SEED, index, 0).ok()).collect()
}

/// A condition with its episodes, which share the lanes of a device with those of other conditions.
#[derive(Debug, Clone, Copy)]
pub struct Share<'a> {
    /// Name of the condition, by which a thread asks for a berth.
    pub condition: &'a str,
    /// Scenario from which the worlds of the condition are drawn.
    pub scenario: &'a Scenario,
    /// Number of episodes under the condition; there are no more lanes than that.
    pub episodes: usize,
}

/// Conditions whose worlds share lanes.
struct Kind<'a> {
    shares: Vec<Share<'a>>,
    samples: Vec<World>,
}

/// Berths on a device: worlds of conditions with the same robot and rules advance together in the same lanes.
#[derive(Debug)]
pub struct Berths {
    lanes: usize,
    /// By condition; none where the device cannot step its worlds.
    seats: BTreeMap<String, Option<Arc<Seats>>>,
    refused: Vec<(String, LockstepError)>,
    /// Frames of worlds without a seat.
    beside: Arc<AtomicU64>,
}

/// Error: there are no berths on a device.
#[derive(Debug, thiserror::Error)]
pub enum BerthsError {
    /// The device has no room for so many lanes, or was lost.
    #[error(transparent)]
    Lockstep(#[from] LockstepError),
    /// The threads cannot be started.
    #[error("cannot start threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

impl Berths {
    /// Shares lanes of a device among the episodes of some conditions, up to `lanes` for each kind of world; `threads` compute beside it.
    ///
    /// # Errors
    /// The device has no room for so many lanes, or was lost.
    pub fn new(gpu: &Gpu, shares: &[Share<'_>], lanes: usize, threads: usize) -> Result<Self, BerthsError> {
        let pool = Arc::new(ThreadPoolBuilder::new().num_threads(threads).build()?);
        let (mut seats, mut refused) = (BTreeMap::new(), Vec::new());
        for Kind { shares, samples } in kinds(shares) {
            let episodes = shares.iter().map(|share| share.episodes).sum::<usize>();
            let lanes = episodes.min(lanes);
            let crews = Lockstep::crews(gpu, &samples, lanes, lanes.div_ceil(CREW).max(2), 1);
            let own = match crews {
                Ok(crews) => Some(Seats::new(gpu, crews, pool.clone())),
                Err(e) if e.is_of_worlds() => {
                    refused.extend(shares.iter().map(|share| (share.condition.to_owned(), e.clone())));
                    None
                }
                Err(e) => return Err(e.into()),
            };
            seats.extend(shares.iter().map(|share| (share.condition.to_owned(), own.clone())));
        }
        Ok(Self { seats, refused, lanes, beside: Arc::default() })
    }

    /// Takes a berth for a world of a condition, and waits for one if none is free. The others of its crew wait from now on until its world is stepped, or it is dropped.
    pub fn take(&self, condition: &str) -> Berth {
        let seat = self.seats.get(condition).and_then(Option::as_ref).map(Seats::take);
        Berth { seat, beside: self.beside.clone() }
    }

    /// Most worlds of a kind that advance together.
    pub fn lanes(&self) -> usize {
        self.lanes
    }

    /// Conditions whose worlds the device cannot step, with the reasons: they are computed in f64.
    pub fn refused(&self) -> &[(String, LockstepError)] {
        &self.refused
    }

    /// The seats, those of each kind once.
    fn kinds(&self) -> impl Iterator<Item = &Arc<Seats>> {
        let mut seen: Vec<&Arc<Seats>> = Vec::new();
        for own in self.seats.values().flatten() {
            if !seen.iter().any(|other| Arc::ptr_eq(own, other)) {
                seen.push(own);
            }
        }
        seen.into_iter()
    }

    /// Counts of all frames so far.
    pub fn tally(&self) -> Tally {
        let all = self.kinds().fold(Tally::default(), |tally, seats| tally.with(&seats.tally()));
        all.with_refused(self.beside.load(Ordering::Relaxed))
    }

    /// Reason for which the device does not draw the images of some worlds any more, if there is one: they draw their own.
    pub fn undrawn(&self) -> Option<String> {
        self.kinds().find_map(|seats| seats.undrawn())
    }

    /// Reason for which the device was lost, if it was.
    pub fn lost(&self) -> Option<String> {
        self.kinds().find_map(|seats| seats.lost())
    }
}

/// Gathers conditions whose worlds may share lanes, with samples of each. Conditions none of whose samples can be built have no kind.
fn kinds<'a>(shares: &[Share<'a>]) -> Vec<Kind<'a>> {
    let count = if shares.len() == 1 { SAMPLES } else { SAMPLES_OF_MANY };
    let each: Vec<Vec<World>> = shares.par_iter().map(|share| sampled(share.scenario, count)).collect();
    let mut kinds: Vec<Kind<'a>> = Vec::new();
    for (share, mut samples) in shares.iter().zip(each) {
        let Some(first) = samples.first() else { continue };
        match kinds.iter_mut().find(|kind| may_share(&kind.samples[0], first)) {
            Some(kind) => {
                kind.shares.push(*share);
                kind.samples.append(&mut samples);
            }
            None => kinds.push(Kind { shares: vec![*share], samples }),
        }
    }
    kinds
}

/// True if two worlds may be in lanes of one lockstep.
fn may_share(one: &World, other: &World) -> bool {
    one.robot() == other.robot() && WorldBatch::may_share(&tree_of(one), &tree_of(other))
}

/// A place of one world: in a lane, or beside the device if that cannot step it.
#[derive(Debug)]
pub struct Berth {
    seat: Option<Seat>,
    /// Counts the frames of worlds without a seat.
    beside: Arc<AtomicU64>,
}

impl Berth {
    /// Lets a world come here. One that the device cannot step is computed in f64.
    ///
    /// # Errors
    /// The device was lost.
    pub fn enter(&mut self, world: &World) -> Result<(), LockstepError> {
        match self.seat.as_ref().map_or(Ok(()), |seat| seat.enter(world)) {
            Err(e) if e.is_of_worlds() => {
                self.seat = None;
                Ok(())
            }
            entered => entered,
        }
    }

    /// Advances the world that is here by a frame, together with all others of its crew.
    #[must_use]
    pub fn step(&self, mut world: Box<World>, command: &Command) -> Box<World> {
        if let Some(seat) = &self.seat {
            return seat.step(world, *command);
        }
        self.beside.fetch_add(1, Ordering::Relaxed);
        world.step(command);
        world
    }
}
