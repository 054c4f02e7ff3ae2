//! Thousands of trees with their fruit at once, in f32 on any graphics device.
//!
//! A [`GpuBatch`] is what `orchard_batch::Batch` is on the processor: trees with fruit, ruptures and detachments, without a robot. Every world may have its own
//! dimensions and its own topology. Each kernel (`kernels/*.wgsl`) has a twin of the same names in Rust (`twin/`), which explains it and to which tests hold it.
//! A batch is made of given worlds, or of one base tree ([`BaseTree`]) from which the device draws every world by itself ([`GpuBatch::randomised`]).
//! `docs/computation/gpu.md` tells how worlds lie in memory and are shared out over threads.
//!
//! ```no_run
//! use orchard_batch::TreeWorld;
//! use orchard_gpu::{Choice, Gpu, GpuBatch};
//! use orchard_spec::Spec;
//! use std::sync::Arc;
//!
//! let spec = Arc::new(Spec::paper());
//! let worlds = [TreeWorld::grow(spec.clone(), 1, 0)?, TreeWorld::grow(spec, 1, 1)?];
//! let gpu = Gpu::open(Choice::Any)?;
//! let mut batch = GpuBatch::new(&gpu, &worlds)?;
//! batch.advance(60);
//! let mut data = worlds[1].data().clone();
//! batch.store(1, &mut data)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod batch;
#[cfg(test)]
mod batch_tests;
mod buffers;
mod device;
mod layout;
mod memory;
mod pipelines;
#[cfg(test)]
mod redraw_tests;
mod rules;
mod schedule;
mod shader;
mod stepper;
mod table;
pub mod testing;
#[cfg(test)]
mod trials;
#[cfg(test)]
mod twin;

pub use batch::{GpuBatch, Options, Solver, Statistics};
pub use device::{Choice, Gpu, GpuError, GpuInfo};
pub use schedule::{ScheduleError, WARPS};
pub use table::{BaseError, BaseTree};

/// Worlds that make no batch.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum BatchError {
    /// A tree has no schedule.
    #[error("world {world}: {why}")]
    Schedule {
        /// Index of the world.
        world: usize,
        /// Why.
        why: ScheduleError,
    },
    /// A joint's damping is not its wood's.
    #[error(
        "world {world} has a joint whose damping is not wood.damping_time times its stiffness; a graphics device knows no other"
    )]
    Damping {
        /// Index of the world.
        world: usize,
    },
    /// A tree has broken limbs.
    #[error("world {world} has broken limbs; a batch on a graphics device starts with whole trees")]
    Broken {
        /// Index of the world.
        world: usize,
    },
    /// More links are pushed than there is room for.
    #[error("world {world} has forces on {pushed} links, there is room for {most}")]
    Pushes {
        /// Index of the world.
        world: usize,
        /// Links with a force.
        pushed: usize,
        /// Links that can have one.
        most: usize,
    },
    /// There is nothing to draw worlds from.
    #[error("the batch was made of given worlds; GpuBatch::randomised makes one that draws its worlds anew")]
    NoBase,
    /// The worlds do not step alike.
    #[error("world {world} has another substep, gravity or rules of breaking than world 0")]
    Rules {
        /// Index of the world.
        world: usize,
    },
}
