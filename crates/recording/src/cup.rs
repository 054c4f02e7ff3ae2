//! Readings of the suction cup's sensor.

use orchard_robot::Observation;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::exact::Exact;

/// Reading of the pressure sensor in the suction cup.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CupMessage {
    /// Pressure in the cup above that of the air (Pa), so negative under vacuum.
    #[schemars(with = "f64")]
    pressure: Exact,
}

impl From<&Observation> for CupMessage {
    fn from(seen: &Observation) -> Self {
        Self { pressure: Exact(seen.cup_pressure) }
    }
}
