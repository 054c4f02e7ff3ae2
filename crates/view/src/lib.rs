//! The desktop viewer.
//!
//! A [`Stage`] holds any scenario's world with its driver and grows another as the dials are turned; a [`Pace`] says when it steps. An [`Orbit`] looks at
//! it. Overlays, marks, pictures of the wrist camera and plots are those of `orchard-play`.
//!
//! With the feature `window`, `window::open` shows all of it in a window, and `window::Offscreen` draws the same without one.

mod orbit;
mod pace;
mod recorded;
mod stage;
#[cfg(feature = "window")]
pub mod window;

pub use orbit::{Axes, Orbit};
pub use orchard_play::{Overlay, Overlays};
pub use pace::{Pace, SCALES};
pub use stage::{Dials, NOBODY, RECORDED, Setup, Stage};

/// Compiles and runs the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
