//! Policies that cannot be used.

use orchard_network::NetworkError;
use orchard_policy::SettingError;

/// A policy that cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PolicyError {
    /// The network cannot be read or computed.
    #[error("the network: {0}")]
    Network(#[from] NetworkError),
    /// The spec cannot be read.
    #[error("the spec: {0}")]
    Spec(String),
    /// A setting of the spec does not fit.
    #[error("the spec: {0}")]
    Setting(#[from] SettingError),
    /// The spec is for another robot, camera or encoding.
    #[error("the policy was made for robot {robot}, with another interface than this scenario's: {problem}")]
    Interface {
        /// Robot of the spec.
        robot: String,
        /// The first difference.
        problem: String,
    },
    /// The network's inputs and outputs do not fit the spec.
    #[error("{0}")]
    Wiring(String),
}
