//! Options that several commands share.

mod scenario;

pub use scenario::{IndexArgs, Part, ScenarioArgs, controller};
