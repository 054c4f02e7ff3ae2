//! Many worlds of one seed, stepped by commands.

use crate::error::EnvError;
use crate::mover::Mover;
use orchard_robot::{Command, Observation};
use orchard_scenario::Scenario;
use orchard_tasks::plan_file::Backend;
use orchard_world::{Snapshot, World, WorldEvent};
use rayon::prelude::*;
use std::ops::Range;

/// Many worlds of one seed.
#[derive(Debug)]
pub struct Env {
    worlds: Vec<World>,
    mover: Mover,
}

impl Env {
    /// Builds the worlds of a range of indices of one seed of a scenario. On the CPU they move in f64, in parallel on the current rayon pool; that is the reference.
    ///
    /// # Errors
    /// A world cannot be built; the lowest index that fails is named. There is no device, or it cannot step these worlds.
    pub fn new(
        scenario: &Scenario,
        seed: u64,
        worlds: Range<u32>,
        backend: Backend,
    ) -> Result<Self, EnvError> {
        let mut mover = Mover::new(scenario, backend, worlds.len(), 1)?;
        let built: Vec<Result<World, EnvError>> = worlds
            .into_par_iter()
            .map(|world| scenario.world(seed, world, 0).map_err(|source| EnvError::World { world, source }))
            .collect();
        let worlds: Vec<World> = built.into_iter().collect::<Result<_, _>>()?;
        mover.enter(&worlds.iter().enumerate().collect::<Vec<_>>(), false)?;
        Ok(Self { worlds, mover })
    }

    /// Counts of frames by the place where they were computed; `None` on the CPU.
    #[cfg(feature = "gpu")]
    pub fn tally(&self) -> Option<orchard_lockstep::Tally> {
        self.mover.tally()
    }

    /// The worlds, for truth and scoring.
    pub fn worlds(&self) -> &[World] {
        &self.worlds
    }

    /// Starts the next episode: every world is back at its start, with new dimensions where the spec's randomisation
    /// samples them anew at every reset.
    ///
    /// # Errors
    /// A world cannot be built in its new dimensions; then no world has changed. The lowest index that fails is named.
    pub fn reset(&mut self) -> Result<(), EnvError> {
        let next: Vec<Result<Option<World>, EnvError>> = self
            .worlds
            .par_iter()
            .map(|world| world.resampled().map_err(|source| EnvError::World { world: world.index(), source }))
            .collect();
        let next: Vec<Option<World>> = next.into_iter().collect::<Result<_, _>>()?;
        let mut entering = Vec::new();
        for (lane, (world, next)) in self.worlds.iter_mut().zip(next).enumerate() {
            match next {
                Some(next) => {
                    *world = next;
                    entering.push((lane, &*world));
                }
                None => {
                    world.reset();
                    self.mover.renew(lane);
                }
            }
        }
        self.mover.enter(&entering, false)
    }

    /// A snapshot of every world. On a device the worlds go on from it as they do after [`Self::restore`].
    pub fn snapshot(&mut self) -> Vec<Snapshot> {
        (0..self.worlds.len()).for_each(|lane| self.mover.renew(lane));
        self.worlds.par_iter().map(World::snapshot).collect()
    }

    /// Goes back to snapshots, one a world.
    ///
    /// # Errors
    /// There is not one snapshot a world, or one belongs to another world; then no world has changed. The
    /// first that does not fit is named.
    pub fn restore(&mut self, snapshots: &[Snapshot]) -> Result<(), EnvError> {
        if snapshots.len() != self.worlds.len() {
            return Err(EnvError::SnapshotCount { given: snapshots.len(), worlds: self.worlds.len() });
        }
        let at = |index| move |source| EnvError::Snapshot { index, source };
        for (index, (world, snapshot)) in self.worlds.iter().zip(snapshots).enumerate() {
            world.check(snapshot).map_err(at(index))?;
        }
        let restored: Vec<Result<(), EnvError>> = self
            .worlds
            .par_iter_mut()
            .zip(snapshots)
            .enumerate()
            .map(|(index, (world, snapshot))| world.restore(snapshot).map_err(at(index)))
            .collect();
        (0..self.worlds.len()).for_each(|lane| self.mover.renew(lane));
        restored.into_iter().collect()
    }

    /// Returns the observation of every world, in the order of [`Env::worlds`].
    ///
    /// # Errors
    /// The device that draws the images has no room, or was lost.
    pub fn observe(&mut self) -> Result<Vec<Observation>, EnvError> {
        self.mover.observe(&mut self.worlds.iter_mut().enumerate().collect::<Vec<_>>())
    }

    /// Advances every world one frame under its command; returns each world's events.
    ///
    /// # Errors
    /// The number of commands differs from the number of worlds, or the device was lost.
    pub fn step(&mut self, commands: &[Command]) -> Result<Vec<Vec<WorldEvent>>, EnvError> {
        if commands.len() != self.worlds.len() {
            return Err(EnvError::CommandCount { given: commands.len(), worlds: self.worlds.len() });
        }
        self.mover.step(&mut self.worlds, commands)?;
        Ok(self.worlds.par_iter_mut().map(World::drain_events).collect())
    }
}
