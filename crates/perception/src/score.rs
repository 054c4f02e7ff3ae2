//! Score: the probability that a sphere is a fruit, from the evidence.

use crate::config::{Prior, Weights};
use crate::evidence::Evidence;
use orchard_geometry::math;

impl Evidence {
    /// Terms of the score by name: logarithms of ratios, shares as they are, and the deviation of the radius from the mean of the prior in
    /// its standard deviations.
    pub fn terms(&self, prior: &Prior) -> [(&'static str, f64); Weights::TERMS] {
        let size = (self.radius - prior.mean.si()) / prior.deviation.si();
        let log = |ratio: f64| math::ln(ratio.max(SMALLEST_RATIO));
        [
            ("always", 1.0),
            ("cover", self.cover),
            ("through", self.through),
            ("visible", self.visible),
            ("rim", self.rim),
            ("beyond", self.beyond),
            ("misfit", log(self.misfit)),
            ("flatness", log(self.flatness)),
            ("roundness", log(self.roundness)),
            ("outline", self.outline),
            ("outline_misfit", self.outline_misfit),
            ("size", size),
            ("size_squared", size * size),
        ]
    }

    /// Probability that the sphere is a fruit: the logistic function of the weighted sum of the terms.
    pub fn score(&self, weights: &Weights, prior: &Prior) -> f64 {
        let sum: f64 =
            self.terms(prior).iter().zip(weights.si()).map(|((_, term), weight)| term * weight).sum();
        1.0 / (1.0 + math::exp(-sum))
    }
}

/// Ratios of residuals below this are as good as it: the residual of an exact image is zero.
const SMALLEST_RATIO: f64 = 0.02;
