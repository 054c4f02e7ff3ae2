//! Stages compute the worlds of tasks: the processor in f64, or what another crate adds, such as a graphics device.

use orchard_world::World;

use crate::harvest::adapter::Simulated;

/// A stage computes worlds. Each world takes a place, is stepped there, and gives the place back when it is dropped.
pub trait Stage: Sync {
    /// A place of one world.
    type Place;
    /// A world in its place.
    type World: Simulated;
    /// Takes a place for a world of a condition, and waits for one if none is free.
    fn take(&self, condition: &str) -> Self::Place;
    /// Lets a world take its place.
    ///
    /// # Errors
    /// Worlds are not computed any more (reason in one line).
    fn enter(&self, place: Self::Place, world: World) -> Result<Self::World, String>;
    /// Tells that the state of a world was changed by others.
    ///
    /// # Errors
    /// As [`Self::enter`].
    fn renew(&self, world: &mut Self::World) -> Result<(), String>;
    /// Worlds that are computed at once in a session of some threads.
    fn at_once(&self, threads: usize) -> usize {
        threads
    }
    /// Reason for which worlds have stopped moving, if they have.
    fn failed(&self) -> Option<String> {
        None
    }
}

/// The processor, in f64.
#[derive(Debug, Clone, Copy, Default)]
pub struct Processor;

impl Stage for Processor {
    type Place = ();
    type World = World;

    fn take(&self, _: &str) {}

    fn enter(&self, (): (), world: World) -> Result<World, String> {
        Ok(world)
    }

    fn renew(&self, _: &mut World) -> Result<(), String> {
        Ok(())
    }
}
