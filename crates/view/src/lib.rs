//! The desktop viewer.
//!
//! A [`Stage`] holds any scenario's world with its driver and grows another as the dials are turned; a [`Pace`] says when it steps. An [`Orbit`] looks at
//! it. [`Overlay`]s add marks ([`annotate()`]), pictures of the wrist camera ([`wrist`]) and plots ([`Trace`]).
//!
//! With the feature `recording`, `recorded` shows the episode of a recording.
//!
//! With the feature `window`, `window::open` shows all of it in a window, and `window::Offscreen` draws the same without one.

mod annotate;
mod canopy;
#[cfg(feature = "recording")]
mod episode;
mod marks;
mod orbit;
mod overlay;
mod pace;
mod recorded;
mod stage;
mod trace;
#[cfg(feature = "window")]
pub mod window;
pub mod wrist;

pub use annotate::{Seen, Target, annotate, line, reach, state_name, target};
pub use canopy::Canopy;
#[cfg(feature = "recording")]
pub use episode::recorded;
pub use marks::{Marks, colour};
pub use orbit::{Axes, Orbit};
pub use overlay::{Overlay, Overlays};
pub use pace::{Pace, SCALES};
pub use stage::{Dials, NOBODY, RECORDED, Setup, Stage};
pub use trace::{Sample, Trace, contacts};

/// Compiles and runs the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
