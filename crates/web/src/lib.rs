//! One world with its controller for a browser.
//!
//! [`grow`] makes a [`Tab`] from an [`Ask`], the options as a page gives them, and the [`Files`] that its visitor opened: a session with overlays and the wrist camera's pictures. On `wasm32-unknown-unknown` the module `abi` exports it to
//! JavaScript. The crate opens no files, reads no clock and starts no threads.

#[cfg(target_arch = "wasm32")]
mod abi;
mod ask;
mod driver;
mod parts;
mod policy;
mod tab;
mod tree;

pub use ask::{Ask, Files, grow, menu};
pub use driver::Driver;
pub use parts::AskError;
pub use policy::PolicyFiles;
pub use tab::{Found, Instances, Tab, TabTold, WristView};
pub use tree::TreeBytes;

/// Compiles and runs the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
