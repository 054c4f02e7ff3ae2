//! Steps many trees with their fruit at once.
//!
//! [`TreeWorld`] is one tree with its fruit in f64, by `orchard_multibody`: the reference. [`Batch`] advances many
//! of them in f32, as many in a vector as the processor's registers hold ([`Isa`]), with the same equations,
//! substeps, ruptures and detachments. Trees may differ in dimensions and in topology. There is no robot;
//! loose fruit and broken limbs touch the ground; there are no other contacts. [`Stepper`] is the interface of all batches. Memory layout and the order of the
//! passes: `docs/computation/batch.md`.
//!
//! ```
//! use orchard_batch::{Batch, TreeWorld};
//! use orchard_spec::Spec;
//! use std::sync::Arc;
//!
//! let spec = Arc::new(Spec::paper());
//! let worlds = [TreeWorld::grow(spec.clone(), 1, 0)?, TreeWorld::grow(spec, 1, 1)?];
//! let mut batch = Batch::new(&worlds)?;
//! batch.step(60);
//! let mut data = worlds[1].data().clone();
//! batch.store(1, &mut data);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod batch;
mod breeze;
mod fault;
mod ground;
mod isa;
mod kernel;
mod lane_world;
mod layout;
mod reference;
mod schedule;
mod stem_motion;
mod stepper;
mod tile;
mod tree_world;

pub use batch::{Batch, BatchError};
pub use fault::{Fault, Quarantine, Status};
pub use isa::Isa;
pub use reference::ReferenceBatch;
pub use stem_motion::StemMotion;
pub use stepper::{Stepper, StepperError};
pub use tile::BatchEvent;
pub use tree_world::{Plant, TreeEvent, TreeWorld, TreeWorldError};

/// Compiles and runs the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
