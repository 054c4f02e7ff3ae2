//! The grammars. A new one is a new file that implements [`crate::lsystem::Grammar`].

pub mod central_leader;
pub mod ternary;
