//! Spec of a time-of-flight camera.

use super::{NativeSpec, ViewSpec, at, positive, window_radius};
use orchard_quantity::{Count, Quantity, Span};
use serde::{Deserialize, Serialize};

/// A camera that measures depth by the phase of modulated light (docs/computation/sensor.md). Figures of pixels are of the depth imager's
/// own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TimeOfFlightSpec {
    /// Size, field of view and rate.
    pub view: ViewSpec,
    /// Valid measured depths.
    pub range: Span,
    /// The depth imager, if its images are registered to another view; without it, `view` is its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub native: Option<NativeSpec>,
    /// Standard deviation of the depth of a bright surface.
    pub noise_floor: Quantity,
    /// Standard deviation of the depth at one metre that falls with the returned light, in the shade and in full sun.
    pub noise: Span,
    /// Pixels to each side over which noise is alike.
    #[serde(deserialize_with = "window_radius")]
    pub noise_window: Count,
    /// Standard deviation of the blur of lens and pixel.
    #[serde(deserialize_with = "positive")]
    pub blur: Quantity,
    /// Largest standard deviation of the depths that mix in a valid pixel.
    pub mixing: Quantity,
    /// Distance at which a surface that fills a pixel returns just enough light, in full sun and in the shade.
    pub reach: Span,
    /// Standard deviation of the light needed, as a share of it.
    pub reach_spread: Quantity,
    /// Light dial: 0 is shade, 1 full sun.
    pub sunlight: Quantity,
    /// Time from exposure to delivery of an image, rounded to whole frames of the simulation.
    pub latency: Quantity,
}

impl TimeOfFlightSpec {
    /// Standard deviation of the depth at one metre \[m\] at the light dial.
    pub fn noise_at_metre(&self) -> f64 {
        at(&self.noise, &self.sunlight)
    }

    /// Distance \[m\] at which a surface that fills a pixel returns just enough light, at the light dial.
    pub fn reach(&self) -> f64 {
        let (sun, shade) = self.reach.si();
        shade + self.sunlight.si() * (sun - shade)
    }
}
