//! The desktop viewer.
//!
//! A [`Stage`] holds any scenario's world with its driver and grows another as the dials are turned; a [`Pace`] says when it steps. An [`Orbit`] looks at
//! it. Overlays, marks, pictures of the wrist camera and plots are those of `orchard-play`.
//!
//! With the feature `recording`, `recorded` shows the episode of a recording; with `demos`, a `DemoFolder` keeps what a person drives as demonstrations.
//!
//! With the feature `window`, `window::open` shows all of it in a window, and `window::Offscreen` draws the same without one.

mod audience;
mod canopy;
mod demonstration;
#[cfg(feature = "recording")]
mod episode;
#[cfg(feature = "live")]
pub mod live;
mod orbit;
mod pace;
mod pad;
mod recorded;
#[cfg(feature = "demos")]
mod shelf;
mod stage;
mod stand;
#[cfg(feature = "window")]
pub mod window;

pub use audience::Audience;
pub use canopy::Canopy;
pub use demonstration::{DrivenFrame, PERSON, Shelf, Start};
#[cfg(feature = "recording")]
pub use episode::recorded;
pub use orbit::{Axes, Orbit};
pub use orchard_play::{Overlay, Overlays};
pub use pace::{Pace, SCALES};
pub use pad::{PAD, Pad, PadAction, PadAxis, PadButton, PadEvent};
#[cfg(feature = "demos")]
pub use shelf::DemoFolder;
pub use stage::{Dials, NOBODY, RECORDED, Setup, Stage};
pub use stand::Stand;

/// Compiles and runs the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
