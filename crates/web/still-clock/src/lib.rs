//! A clock that stands still, with the names of the crate `web-time`.
//!
//! The solver of inverse kinematics, `clarabel`, times itself. In WebAssembly it does so by the browser's clock, through `wasm-bindgen`, whose
//! program would have to rewrite every build. Here no time passes: no result depends on it, since the solver has no time limit, and nothing
//! in WebAssembly can read a clock.

pub use std::time::Duration;

/// A moment of a clock that stands still: all moments are the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Instant;

impl Instant {
    /// The present moment.
    pub fn now() -> Self {
        Self
    }

    /// The time since then: none.
    pub fn elapsed(&self) -> Duration {
        Duration::ZERO
    }
}
