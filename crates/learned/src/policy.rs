//! A policy that is ready to act.

use std::sync::Arc;

use orchard_network::Network;
use orchard_policy::Encoding;

use crate::spec::Spec;
use crate::wiring::Wiring;

/// Parts that all controllers of a policy share.
pub(crate) struct Policy {
    pub network: Network,
    pub wiring: Wiring,
    pub encoding: Arc<Encoding>,
    pub spec: Spec,
}
