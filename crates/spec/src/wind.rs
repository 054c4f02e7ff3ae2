//! Wind: its mean profile, its gusts, and the drag of wood and leaves in it.

use orchard_quantity::{Count, Quantity};
use serde::{Deserialize, Serialize};

/// Turbulent wind. At speed 0 there is none, and its other figures change nothing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WindSpec {
    /// Mean speed at the height of the canopy: the dial.
    pub speed: Quantity,
    /// Bearing that the wind blows to, from the world's x axis.
    pub bearing: Quantity,
    /// Height of the canopy h.
    pub canopy_height: Quantity,
    /// Attenuation a in the canopy, `u(z) = u(h) exp(a (z / h - 1))`.
    pub attenuation: Quantity,
    /// Displacement height of the logarithmic profile above the canopy, over h.
    pub displacement: Quantity,
    /// Roughness length of that profile, over h.
    pub roughness: Quantity,
    /// Standard deviation of each component of the gusts over the mean speed at their height.
    pub intensity: Quantity,
    /// Longitudinal integral length of the gusts.
    pub length: Quantity,
    /// Number of wave numbers of the gusts; each has six Fourier modes.
    pub wave_numbers: Count,
    /// Distance along which wood and fruit feel the air of one place.
    pub spacing: Quantity,
    /// Drag coefficient of wood, a cylinder across the wind.
    pub wood_drag: Quantity,
    /// Drag coefficient of leaves, by their area, while they stand still.
    pub leaf_drag: Quantity,
    /// Speed above which leaves fold: their drag then grows with the speed, no longer with its square.
    pub folding_speed: Quantity,
}
