//! A grown tree as a compliant, breakable articulation.
//!
//! [`TreeBody`] turns a [`Skeleton`](orchard_treegen::Skeleton) into links of a multibody model: every
//! segment a capsule link, every joint a bending spring-damper whose stiffness follows beam theory.
//! [`Rupture`] tests the bending moments, breaks joints in place and lets the sub-tree fall. [`rails`] limit
//! forces that a hand or a test applies.

mod body;
pub mod rails;
mod rupture;
pub mod section;
mod settings;
mod stiffness;
mod subtree;
pub mod sway;
mod timber;
pub mod trials;
pub mod wind;

pub use body::{TreeBody, TreeGroups};
pub use rupture::{Break, Rupture};
pub use settings::step_settings;
pub use timber::Timber;

/// Compiles and runs the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
