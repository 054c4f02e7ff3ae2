//! Light of colour images.

use orchard_quantity::Quantity;
use serde::{Deserialize, Serialize};

/// Sun and cloud of colour images; no photometric model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LightSpec {
    /// Azimuth of the sun from the world's x axis, counter-clockwise seen from above.
    pub sun_azimuth: Quantity,
    /// Elevation of the sun over the horizon.
    pub sun_elevation: Quantity,
    /// Strength of the sun relative to the sky's.
    pub sun_strength: Quantity,
    /// Part of the sky that cloud covers.
    pub overcast: Quantity,
}
