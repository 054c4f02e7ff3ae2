//! One world played live.
//!
//! A [`Session`] steps a world frame by frame: a controller observes and commands, or a person drives the robot ([`Jog`]), the world steps, and a
//! [`Hand`] may pull wood, fruit or the robot meanwhile. [`Session::step_watched`] gives a digest of every frame, by which the bits of two processors
//! are compared. A [`Picture`] lists what is visible as instances of small meshes. [`Overlay`]s add marks ([`annotate()`]), pictures of the wrist camera
//! ([`wrist`]) and plots ([`Trace`]); they change no bit of the world.
//!
//! The crate opens no files, reads no clock and starts no threads, so that it runs in a browser as well.

mod annotate;
mod digest;
mod grip;
mod hand;
mod jog;
mod marks;
mod mesh;
mod overlay;
mod paint;
mod picture;
mod rules;
mod session;
mod told;
mod trace;
pub mod wrist;

pub use annotate::{Seen, Target, annotate, goal_sentence, line, mark_goal, reach, state_name, target};
pub use digest::FrameDigest;
pub use grip::{Grip, Reach};
pub use hand::Hand;
pub use jog::{Jog, Wish};
pub use marks::{Marks, colour};
pub use mesh::{Fineness, MESH_FLOATS, Mesh};
pub use overlay::{Overlay, Overlays};
pub use paint::{Colour, Paint, WoodPaint, load_colour};
pub use picture::{Coarse, Drawing, Group, INSTANCE_FLOATS, Picture};
pub use rules::{GroundRules, HandRules, JogRules, PlayRules, StandRules, V1_TOML};
pub use session::{Make, Session, Sight};
pub use told::{Pull, Told};
pub use trace::{Sample, Trace, contacts};

/// Compiles and runs the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
