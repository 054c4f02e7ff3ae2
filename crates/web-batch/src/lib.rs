//! A batch of trees for a page: grown and packed here, stepped by the page's WebGPU, drawn as lines.
//!
//! A [`Stand`] grows its trees one by one, so that a page can tell how far it is. On `wasm32-unknown-unknown` the module `abi` exports it to JavaScript.
//! The crate opens no files, reads no clock and starts no threads.

#[cfg(target_arch = "wasm32")]
mod abi;
mod stand;

pub use stand::{Asked, Figures, Picture, Stand};

/// Compiles and runs the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
