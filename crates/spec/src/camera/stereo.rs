//! Spec of a stereo camera.

use super::{NativeSpec, ViewSpec, at, positive, window_radius};
use orchard_quantity::{Count, Quantity, Span};
use serde::{Deserialize, Serialize};

/// A stereo camera. Its errors are errors of the disparity f B / z: the shift \[px\] of a point between the two imagers'
/// pictures (docs/computation/sensor.md).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StereoSpec {
    /// Size, field of view and rate.
    pub view: ViewSpec,
    /// Valid measured depths.
    pub range: Span,
    /// The depth imager, if its images are registered to another view; without it, `view` is its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub native: Option<NativeSpec>,
    /// Distance B between the imagers.
    #[serde(deserialize_with = "positive")]
    pub baseline: Quantity,
    /// Pixels by which the matching window extends to each side.
    #[serde(deserialize_with = "window_radius")]
    pub window_radius: Count,
    /// Standard deviation of the disparity, in the shade and in full sun.
    pub disparity_noise: Span,
    /// Smallest step of the disparity.
    #[serde(deserialize_with = "positive")]
    pub disparity_step: Quantity,
    /// Difference of disparity above which two pixels belong to different surfaces.
    pub surface_step: Quantity,
    /// Standard deviation of an edge's displacement, along rows and along columns.
    pub edge_shift: Quantity,
    /// Pixels to each side over which a step of disparity becomes a ramp.
    #[serde(deserialize_with = "window_radius")]
    pub edge_ramp: Count,
    /// Largest standard deviation of the disparities that mix in a valid pixel of such a ramp.
    pub edge_limit: Quantity,
    /// Least share of a window that must show surfaces visible to both imagers.
    pub least_support: Quantity,
    /// Share of pixels without a match, in the shade and in full sun.
    pub dropout: Span,
    /// Light dial: 0 is shade, 1 full sun.
    pub sunlight: Quantity,
    /// Time from exposure to delivery of an image, rounded to whole frames of the simulation.
    pub latency: Quantity,
}

impl StereoSpec {
    /// Standard deviation of the disparity \[px\] at the light dial.
    pub fn disparity_sd(&self) -> f64 {
        at(&self.disparity_noise, &self.sunlight)
    }

    /// Share of pixels without a match at the light dial.
    pub fn dropout_share(&self) -> f64 {
        at(&self.dropout, &self.sunlight)
    }
}
