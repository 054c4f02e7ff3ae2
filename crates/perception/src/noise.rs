//! How far a measured depth may be off.

use crate::DetectorConfig;

/// Lengths below which a difference may be noise.
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

    /// Distance from a sphere within which a pixel at a depth [m] belongs to it: max(band, k z^2).
    pub(crate) fn band(&self, z: f64) -> f64 {
        self.band.max(self.growing(z))
    }

    /// Difference of depth beyond which a surface ends.
    pub(crate) fn jump(&self, z: f64) -> f64 {
        self.depth_jump.max(self.growing(z))
    }

    /// The part of the band that grows with depth.
    pub(crate) fn growing(&self, z: f64) -> f64 {
        self.at_metre * z * z
    }
}
