//! Environments whose worlds are stepped one by one: in f64, or in a berth on a graphics device.

use orchard_robot::Command;
use orchard_world::World;

use crate::error::EnvError;

/// Moves a world by a frame at a time.
#[derive(Debug)]
pub(crate) enum Alone {
    /// In f64.
    Here,
    /// In a berth, with the worlds of other threads.
    #[cfg(feature = "gpu")]
    Berth(orchard_lockstep::Berth),
}

impl Alone {
    /// Hands a new world over, before its first step.
    ///
    /// # Errors
    /// The device was lost.
    #[cfg_attr(not(feature = "gpu"), expect(unused_variables, clippy::unnecessary_wraps))]
    pub fn enter(&mut self, world: &World) -> Result<(), EnvError> {
        match self {
            Self::Here => Ok(()),
            #[cfg(feature = "gpu")]
            Self::Berth(berth) => berth.enter(world).map_err(|e| EnvError::Device(e.to_string())),
        }
    }

    /// Advances a world by a frame.
    pub fn step(&self, mut world: Box<World>, command: &Command) -> Box<World> {
        match self {
            Self::Here => {
                world.step(command);
                world
            }
            #[cfg(feature = "gpu")]
            Self::Berth(berth) => berth.step(world, command),
        }
    }
}
