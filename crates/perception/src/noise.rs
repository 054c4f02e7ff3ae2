//! Depth noise: the error that a measured depth may have.

use crate::DetectorConfig;

/// Number of standard deviations in `fit.band` and `fit.noise`.
pub(crate) const DEVIATIONS: f64 = 2.5;

/// Lengths below which a difference may be noise \[m\].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Noise {
    band: f64,
    /// Band at a depth of one metre.
    at_metre: f64,
    depth_jump: f64,
}

impl Noise {
    pub(crate) fn new(config: &DetectorConfig) -> Self {
        Self {
            band: config.fit.band.si(),
            at_metre: config.fit.noise.si(),
            depth_jump: config.segmentation.depth_jump.si(),
        }
    }

    /// Returns the distance from a sphere \[m\] within which a pixel at depth `z` \[m\] belongs to it: max(band, k z^2).
    pub(crate) fn band(&self, z: f64) -> f64 {
        self.band.max(self.growing(z))
    }

    /// Returns the standard deviation of a depth \[m\] at depth `z` \[m\].
    pub(crate) fn deviation(&self, z: f64) -> f64 {
        self.band(z) / DEVIATIONS
    }

    /// Returns the difference of depth \[m\] beyond which a surface ends, at depth `z` \[m\].
    pub(crate) fn jump(&self, z: f64) -> f64 {
        self.depth_jump.max(self.growing(z))
    }

    /// Returns the part of the band that grows with depth, k z^2 \[m\].
    pub(crate) fn growing(&self, z: f64) -> f64 {
        self.at_metre * z * z
    }
}
