//! One world with its controller for a browser.
//!
//! A [`Session`] is grown from an [`Ask`] and steps frame by frame: the controller observes and commands, the world steps, and a [`Hand`] may
//! pull wood or fruit meanwhile. [`Session::step`] gives a digest of every frame, by which a browser's bits are compared with a processor's.
//! A [`Picture`] lists what is visible as instances of small meshes.
//!
//! On `wasm32-unknown-unknown` the module `abi` exports all of it to JavaScript. The crate opens no files, reads no clock and starts no threads.

#[cfg(target_arch = "wasm32")]
mod abi;
mod ask;
mod digest;
mod driver;
mod hand;
mod mesh;
mod picture;
mod rules;
mod session;
mod told;

pub use ask::{Ask, AskError, menu};
pub use digest::FrameDigest;
pub use driver::Driver;
pub use hand::{Grip, Hand};
pub use mesh::{MESH_FLOATS, Mesh};
pub use picture::{Group, INSTANCE_FLOATS, Picture};
pub use rules::{HandRules, V1_TOML, WebRules};
pub use session::Session;
pub use told::{Pull, Told};

/// Compiles and runs the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
