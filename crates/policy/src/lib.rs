//! Interface of learned policies: a robot's observations as arrays, and arrays as its commands.
//!
//! An [`Encoding`] is made from a robot and the [`Spaces`] that a policy asks for. It reads sensors into arrays ([`Encoding::read`]) and turns
//! an action into the commands of its frames ([`Encoding::motion`]). Its [`Interface`] states every convention: names, units, signs, ranges.
//!
//! This crate knows no world and no truth, so that what runs a policy in it can see neither. The environments of `orchard-env`, in which
//! policies learn, use the same encoding. `docs/python.md` states the spaces and conventions.

mod action;
mod encoding;
mod interface;
mod pilot;
mod rules;
mod sensors;
mod setting;
mod spaces;

pub use action::{Channel, Motion};
pub use encoding::Encoding;
pub use interface::{Conventions, Element, Field, Frames, Interface};
pub use pilot::Pilot;
pub use rules::{PixelRules, Scales, V1_TOML};
pub use sensors::{DepthReading, Reading, Values};
pub use setting::SettingError;
pub use spaces::{Control, Pixels, Spaces, Target};

/// Compiles the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
