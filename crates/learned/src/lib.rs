//! Learned controllers: a network in ONNX format that sees and acts through the encoding of `orchard-policy`.
//!
//! A policy is two files: the network and its spec ([`Spec`]), JSON with the interface in which it learned. [`LearnedKind::new`] fits them to a robot
//! and makes controllers of them. The crate takes bytes and text, and it reaches no truth: what a policy sees is what any controller sees.
//! `docs/controllers.md` describes the files.

mod controller;
mod error;
mod kind;
mod policy;
mod spec;
mod wiring;

pub use error::PolicyError;
pub use kind::{LearnedKind, Setting};
pub use spec::Spec;

/// Largest file of a network \[bytes\]. Results store it: a policy that ships has at most 10 MB.
pub const NETWORK_MAX: u64 = 10_000_000;

/// Compiles the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
