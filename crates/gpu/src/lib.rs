//! Thousands of trees with their fruit, of robots, or of worlds with both, at once, in f32 on any graphics device.
//!
//! A [`GpuBatch`] steps trees with fruit, ruptures and detachments, without a robot, as `orchard_batch::Batch` does on the processor. Every world may have its own
//! dimensions and its own topology. A batch is made of given worlds, or of one base tree ([`BaseTree`]) from which the device draws the dimensions of every world ([`GpuBatch::randomised`]).
//! A [`RobotBatch`] steps robots of one kind, each alone, a [`WorldBatch`] worlds with a tree and such a robot, which pushes it (`docs/computation/gpu-world.md`).
//! An [`ImageBatch`] draws depth images of many scenes, exactly or with the errors of a camera (`docs/computation/gpu-images.md`), a [`PictureBatch`] colour pictures.
//! The kernels are in `kernels/*.wgsl`. Those that step worlds are tested against the f64 worlds; those that draw worlds have twins in Rust (`twin/`) besides.
//! `docs/computation/gpu.md` describes the layout of memory and the distribution of work over threads.
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

// Without devices, what only they use is left over.
#![cfg_attr(not(feature = "device"), allow(dead_code, unused_imports))]

// The included file `testing` refers to the library by name.
#[cfg(test)]
extern crate self as orchard_gpu;

#[cfg(feature = "device")]
mod arrays;
#[cfg(feature = "device")]
mod batch;
#[cfg(test)]
mod batch_tests;
#[cfg(feature = "device")]
mod buffers;
#[cfg(feature = "device")]
mod clock;
#[cfg(feature = "device")]
mod device;
#[cfg(test)]
#[path = "../../camera/tests/suite/common/direction.rs"]
mod direction;
#[cfg(test)]
mod error_tests;
#[cfg(test)]
mod image_tests;
#[cfg(feature = "device")]
mod images;
mod laws;
mod layout;
mod memory;
mod packed;
mod passes;
#[cfg(test)]
mod picture_tests;
#[cfg(feature = "device")]
mod pipelines;
#[cfg(test)]
mod redraw_tests;
#[cfg(test)]
mod robot_tests;
#[cfg(feature = "device")]
mod robots;
mod rules;
mod schedule;
mod shader;
#[cfg(test)]
#[path = "../../camera/tests/suite/common/shapes.rs"]
mod shapes;
mod solver;
#[cfg(test)]
mod stem_tests;
#[cfg(feature = "device")]
mod stepper;
mod table;
#[cfg(test)]
#[path = "../tests/device/mod.rs"]
mod testing;
#[cfg(test)]
#[path = "../../batch/tests/trees/mod.rs"]
mod trees;
#[cfg(test)]
mod trials;
#[cfg(test)]
mod twin;
#[cfg(test)]
mod world_tests;
#[cfg(feature = "device")]
mod worlds;

/// The example of the README as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

#[cfg(feature = "device")]
pub use arrays::DeviceArray;
#[cfg(feature = "device")]
pub use batch::{GpuBatch, Options, Statistics};
#[cfg(feature = "device")]
pub use device::{Choice, Gpu, GpuError, GpuInfo};
#[cfg(feature = "device")]
pub use images::{DepthMask, ImageBatch, Lit, Look, PictureBatch, Subject, View};
pub use memory::Room;
pub use packed::{Contents, Kernel, PackedTrees};
#[cfg(feature = "device")]
pub use robots::RobotBatch;
pub use schedule::{ScheduleError, WARPS};
pub use solver::Solver;
pub use table::{BaseError, BaseTree};
#[cfg(feature = "device")]
pub use worlds::{ContactPoint, Course, Fitted, Meeting, News, Tenant, Wish, WorldBatch, world_colliders};

/// Error: worlds cannot form a batch.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum BatchError {
    /// A tree has no schedule for the kernels.
    #[error("world {world}: {why}")]
    Schedule {
        /// Index of the world.
        world: usize,
        /// Reason.
        why: ScheduleError,
    },
    /// The damping of a joint is not `wood.damping_time` times its stiffness.
    #[error(
        "world {world} has a joint whose damping is not wood.damping_time times its stiffness; a graphics device has no other damping"
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
    /// There are external forces on more links than the batch has room for.
    #[error("world {world} has forces on {pushed} links; there is room for {most}")]
    Pushes {
        /// Index of the world.
        world: usize,
        /// Number of links with a force.
        pushed: usize,
        /// Number of links that can have one.
        most: usize,
    },
    /// The passes that begin a wind are a device's own.
    #[error("world {world} stands in wind, which only a device of this library begins")]
    Wind {
        /// Index of the world.
        world: usize,
    },
    /// The batch has no base tree from which worlds could be drawn.
    #[error(
        "the batch was made of given worlds; GpuBatch::randomised makes one that can draw its worlds again"
    )]
    NoBase,
    /// The kernels cannot step a robot.
    #[error("a graphics device cannot step the robot {robot}: {why}")]
    Robot {
        /// Name of the robot.
        robot: String,
        /// Reason.
        why: String,
    },
    /// A command is for an arm with another number of joints.
    #[error("the command of world {world} has {given} numbers for the joints of the arm, which has {has}")]
    Joints {
        /// Index of the world.
        world: usize,
        /// Number of the command's numbers.
        given: usize,
        /// Number of the arm's joints.
        has: usize,
    },
    /// The kernels cannot step a tree with a robot beside it.
    #[error("world {world} cannot have a robot on a graphics device: {why}")]
    World {
        /// Index of the world.
        world: usize,
        /// Reason.
        why: &'static str,
    },
    /// There is not one start of the robot for each tree.
    #[error(
        "there are {starts} starts of the robot for {worlds} worlds; a batch needs one for each, and a world at least"
    )]
    Starts {
        /// Number of starts.
        starts: usize,
        /// Number of worlds.
        worlds: usize,
    },
    /// The worlds differ in substep, gravity, rules of breaking or mean wind, or in posts and wires.
    #[error(
        "world {world} has another substep, gravity, mean wind or rules of breaking than world 0, or other posts and wires"
    )]
    Rules {
        /// Index of the world.
        world: usize,
    },
}
