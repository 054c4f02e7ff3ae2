//! Neural networks in ONNX format, computed with the same bits on every processor.
//!
//! [`Network::from_bytes`] reads a file, [`Network::run`] computes its outputs. There is one path of computation: the order of every sum is
//! fixed, no product is fused with a sum, nothing asks which processor runs it, and functions such as the exponential are those of
//! `orchard_geometry::math`. So a network gives the same bits on every processor and in WebAssembly. `docs/computation/networks.md` lists the
//! operators and limits; [decision 25](https://github.com/orchardbench/orchardbench/blob/main/docs/decisions/0025-networks-computed-here.md)
//! says why no other runtime is used.
//!
//! The crate takes bytes and gives numbers. It knows no robot and no world.

mod call;
mod error;
mod network;
mod ops;
mod proto;
mod read;
mod spare;
mod tensor;

pub use error::NetworkError;
pub use network::Network;
pub use ops::operators;
pub use read::{OPSETS, Port};
pub use tensor::{ELEMENTS_MAX, Kind, RANK_MAX, Tensor, Values};

/// Compiles the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
