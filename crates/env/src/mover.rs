//! Movers of worlds: the processor, or a graphics device.

use orchard_robot::Command;
use orchard_scenario::Scenario;
use orchard_tasks::plan_file::Backend;
use orchard_world::World;
use rayon::prelude::*;

use crate::error::EnvError;

/// A world's frame: its lane, the world, its command.
pub(crate) type Turn<'a> = (usize, &'a mut World, Command);

/// Moves the worlds of some lanes.
#[derive(Debug)]
pub(crate) enum Mover {
    /// In f64, in parallel on the current rayon pool.
    Cpu,
    /// On a graphics device.
    #[cfg(feature = "gpu")]
    Gpu(Box<orchard_lockstep::Lockstep>),
}

impl Mover {
    /// Makes the mover of a scenario's worlds in some lanes.
    ///
    /// # Errors
    /// There is no device, or it cannot step these worlds.
    pub fn new(scenario: &Scenario, backend: Backend, lanes: usize) -> Result<Self, EnvError> {
        match backend {
            Backend::Cpu => Ok(Self::Cpu),
            #[cfg(not(feature = "gpu"))]
            Backend::Gpu => {
                let _ = (scenario, lanes);
                Err(EnvError::Device("this program was built without the feature `gpu`".to_owned()))
            }
            #[cfg(feature = "gpu")]
            Backend::Gpu => {
                let device = |e: &dyn std::error::Error| EnvError::Device(e.to_string());
                let gpu = orchard_gpu::Gpu::open(orchard_gpu::Choice::Any).map_err(|e| device(&e))?;
                let samples = orchard_lockstep::samples(std::slice::from_ref(scenario));
                let lockstep = orchard_lockstep::Lockstep::new(&gpu, &samples, lanes);
                Ok(Self::Gpu(Box::new(lockstep.map_err(|e| device(&e))?)))
            }
        }
    }

    /// Lets a world enter a lane.
    ///
    /// # Errors
    /// The device cannot step it.
    #[cfg_attr(not(feature = "gpu"), expect(unused_variables, clippy::unnecessary_wraps))]
    pub fn enter(&mut self, lane: usize, world: &World) -> Result<(), EnvError> {
        match self {
            Self::Cpu => Ok(()),
            #[cfg(feature = "gpu")]
            Self::Gpu(lockstep) => lockstep.enter(lane, world).map_err(|e| EnvError::Device(e.to_string())),
        }
    }

    /// Tells that the state of a lane's world has changed.
    #[cfg_attr(not(feature = "gpu"), expect(unused_variables))]
    pub fn renew(&mut self, lane: usize) {
        match self {
            Self::Cpu => {}
            #[cfg(feature = "gpu")]
            Self::Gpu(lockstep) => lockstep.renew(lane),
        }
    }

    /// Advances worlds by a frame.
    ///
    /// # Errors
    /// The device was lost.
    pub fn step(&mut self, turns: Vec<Turn<'_>>) -> Result<(), EnvError> {
        match self {
            Self::Cpu => {
                turns.into_par_iter().for_each(|(_, world, command)| world.step(&command));
                Ok(())
            }
            #[cfg(feature = "gpu")]
            Self::Gpu(lockstep) => {
                let turns = turns.into_iter();
                let turns =
                    turns.map(|(lane, world, command)| orchard_lockstep::Turn { lane, world, command });
                lockstep.step(&mut turns.collect::<Vec<_>>()).map_err(|e| EnvError::Device(e.to_string()))
            }
        }
    }

    /// True if the worlds move in f64, each on its own.
    pub fn is_cpu(&self) -> bool {
        matches!(self, Self::Cpu)
    }

    /// Counts of frames by the place where they were computed; `None` on the CPU.
    #[cfg(feature = "gpu")]
    pub fn tally(&self) -> Option<&orchard_lockstep::Tally> {
        match self {
            Self::Cpu => None,
            Self::Gpu(lockstep) => Some(lockstep.tally()),
        }
    }
}
