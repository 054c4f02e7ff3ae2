//! Many worlds of one seed, stepped by commands.

use crate::error::EnvError;
use orchard_robot::{Command, Observation};
use orchard_scenario::Scenario;
use orchard_world::{Snapshot, World, WorldEvent};
use rayon::prelude::*;
use std::ops::Range;

/// Backend that computes the physics.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Backend {
    /// f64 on the CPU, worlds in parallel on the current rayon pool. The reference.
    #[default]
    Cpu,
}

/// Many worlds of one seed.
#[derive(Debug, Clone)]
pub struct Env {
    worlds: Vec<World>,
}

impl Env {
    /// Builds the worlds of a range of indices of one seed of a scenario.
    ///
    /// # Errors
    /// A world cannot be built; the lowest index that fails is named.
    pub fn new(
        scenario: &Scenario,
        seed: u64,
        worlds: Range<u32>,
        backend: Backend,
    ) -> Result<Self, EnvError> {
        let Backend::Cpu = backend;
        let built: Vec<Result<World, EnvError>> = worlds
            .into_par_iter()
            .map(|world| scenario.world(seed, world, 0).map_err(|source| EnvError::World { world, source }))
            .collect();
        Ok(Self { worlds: built.into_iter().collect::<Result<_, _>>()? })
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
        for (world, next) in self.worlds.iter_mut().zip(next) {
            match next {
                Some(next) => *world = next,
                None => world.reset(),
            }
        }
        Ok(())
    }

    /// A snapshot of every world.
    pub fn snapshot(&self) -> Vec<Snapshot> {
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
        restored.into_iter().collect()
    }

    /// Returns the observation of every world, in the order of [`Env::worlds`].
    pub fn observe(&mut self) -> Vec<Observation> {
        self.worlds.par_iter_mut().map(World::observe).collect()
    }

    /// Advances every world one frame under its command; returns each world's events.
    ///
    /// # Errors
    /// The number of commands differs from the number of worlds.
    pub fn step(&mut self, commands: &[Command]) -> Result<Vec<Vec<WorldEvent>>, EnvError> {
        if commands.len() != self.worlds.len() {
            return Err(EnvError::CommandCount { given: commands.len(), worlds: self.worlds.len() });
        }
        Ok(self
            .worlds
            .par_iter_mut()
            .zip(commands)
            .map(|(world, command)| {
                world.step(command);
                world.drain_events()
            })
            .collect())
    }
}
