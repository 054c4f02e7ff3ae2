//! Worlds that advance together: a graphics device computes their motion in f32, this crate's worlds apply their rules in f64.
//!
//! A [`Lockstep`] has lanes. A world enters a lane, advances there with the others by one or more frames at a time ([`Lockstep::step`]), and leaves it. A frame on the device is every substep's motion of wood, fruit and robot, with the contacts of the robot
//! with wood and hanging fruit, and of the fruit of clusters; sensors, ruptures, stems, grips, loads and events follow in [`World`], by the code of [`World::step`]. What the device does not know yet (suction, links that turn fast, the robot near uneven
//! ground) is computed in f64: the world leaves the device for these frames and comes back after them. [`Tally`] counts which frames were computed where.
//!
//! Threads that run one world after the other take [`Berths`], which have lanes for worlds of several kinds.
//!
//! The result of a world depends on its own commands alone, not on the other lanes or on their number. It differs from that of [`World::step`] by the rounding of f32, which contacts amplify.
//!
//! ```no_run
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! use orchard_gpu::{Choice, Gpu};
//! use orchard_lockstep::{Lockstep, Turn};
//! use orchard_scenario::Scenario;
//! let scenario = Scenario::of(&[])?;
//! let mut worlds = (0..8).map(|index| scenario.world(1, index, 0)).collect::<Result<Vec<_>, _>>()?;
//! let mut together = Lockstep::new(&Gpu::open(Choice::default())?, &worlds, worlds.len(), 1)?;
//! for (lane, world) in worlds.iter().enumerate() {
//!     together.enter(&[(lane, world)])?;
//! }
//! let command = scenario.robot().start_command();
//! let turns = worlds.iter_mut().enumerate().map(|(lane, world)| Turn { lane, world, command, is_whole: true });
//! together.step(&mut turns.collect::<Vec<_>>())?;
//! # Ok(())
//! # }
//! ```

mod berthed;
mod berths;
mod eyes;
mod fitting;
mod harvest;
mod lane;
mod pictures;
mod profile;
mod seats;
mod step;
mod tally;

pub use berthed::Berthed;
pub use berths::{Berth, Berths, BerthsError, Share, samples};
pub use eyes::Eyes;
pub use fitting::Fitting;
pub use harvest::Together;
pub use lane::{Lockstep, LockstepError};
pub use orchard_world::{Span, Turn};
pub use profile::{Detail, Profile};
pub use seats::{Seat, Seats};
pub use step::Begun;
pub use tally::{Tally, Where};

#[cfg(doc)]
use orchard_world::World;

/// Compiles the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
