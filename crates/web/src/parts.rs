//! Parts of a session, resolved, and the problem of options that give none.

use std::sync::Arc;

use orchard_perception::DetectorConfig;
use orchard_robot::RobotModel;
use orchard_spec::Spec;

/// An option that cannot be used; the message names it, its value and what is allowed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct AskError(pub String);

/// Parts of a session.
#[derive(Debug)]
pub(crate) struct Parts {
    pub spec: Arc<Spec>,
    pub robot: Arc<RobotModel>,
    pub detector: DetectorConfig,
}

/// The beginning of a text from a link, for a message.
pub(crate) fn shown(text: &str) -> String {
    const MOST: usize = 40;
    text.chars().take(MOST).collect()
}
