//! Config of detector, masks and tracker.

use crate::onnx::Onnx;
use orchard_geometry::math;
use orchard_quantity::{ConfigError, Count, Quantity, Span, from_table, parse, with_base};
use serde::{Deserialize, Serialize};

/// The preset `paper` as TOML text.
pub const PAPER_TOML: &str = include_str!("../configs/paper/perception.toml");
/// Names of the presets with a network in front: one that sees depth only, and one that sees colour as well.
pub const LEARNED: [&str; 2] = ["learned", "learned-colour"];
/// The preset `paper-single` as TOML text.
pub const PAPER_SINGLE_TOML: &str = include_str!("../configs/paper-single/perception.toml");

/// Every threshold of detector, masks and tracker, as read from `perception.toml`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DetectorConfig {
    /// Segmentation into depth-continuous patches.
    pub segmentation: Segmentation,
    /// Sphere search within a patch.
    pub fit: Fit,
    /// Conditions that a sphere must satisfy.
    pub gates: Gates,
    /// Score of a sphere.
    pub score: Score,
    /// Network that says where fruit are; the search of the geometric detector does so without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub network: Option<Network>,
    /// Robot and ground masks.
    pub mask: Mask,
    /// Tracking over several images.
    pub tracking: Tracking,
}

/// Segmentation into depth-continuous patches.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Segmentation {
    /// Working range of the detector, in depth.
    pub range: Span,
    /// Largest depth step between neighbouring pixels of one patch.
    pub depth_jump: Quantity,
    /// Least number of pixels of a patch and of a detection.
    pub min_pixels: Count,
}

/// Sphere search within a patch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fit {
    /// Searches for spheres within patches too (fruit that touches leaves, wood or other fruit) and trims outliers. If false, fits one
    /// sphere to all pixels of each patch, as the paper does.
    pub refine: bool,
    /// Half-width of the window of a local fit over the disc of the smallest radius that the gate allows.
    pub window: Quantity,
    /// Every so many columns and rows of the image are looked at. The other figures in pixels are of what is left.
    pub sampling: Count,
    /// Spacing of the pixels from which local fits start.
    pub stride: Count,
    /// Distance from the sphere within which a pixel belongs to it: about three sigma of the depth noise.
    pub band: Quantity,
    /// Band at a depth of one metre that grows with depth squared, as the noise of a stereo camera does; the wider of the two bands
    /// counts.
    pub noise: Quantity,
    /// Half-width of the ramp that the camera makes of a step in depth.
    pub ramp: Quantity,
    /// Uses the prior in the fit. If false, a sphere follows from its pixels alone.
    pub use_prior: bool,
    /// Prior of a fruit's radius.
    pub prior: Prior,
    /// First, wider band of a fit, as a multiple of its RMS; it is halved every round.
    pub trim: Quantity,
    /// Largest number of rounds of collecting pixels and fitting again.
    pub rounds: Count,
    /// Largest number of pixel accesses of the search, divided by the number of pixels of the image. It bounds the time of an image that
    /// was made to take long.
    pub effort: Count,
}

/// Prior of a fruit's radius.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Prior {
    /// Mean radius.
    pub mean: Quantity,
    /// Standard deviation of the radius.
    pub deviation: Quantity,
    /// Standard deviation of the radii of the fruit of one image about their mean.
    pub within: Quantity,
    /// Standard deviation of the radius that pixels tell, because fruit are no spheres.
    pub shape: Quantity,
    /// Largest number of pixels of a fruit whose errors count as independent: neighbours err alike, and apples are no spheres.
    pub independent: Quantity,
}

/// Score: the probability that a sphere is a fruit, by logistic regression on the evidence ([`crate::Evidence`]).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Score {
    /// True if the score decides: of spheres in one place the one with the largest score stays, and those below `least` are refused. If
    /// false, the gates decide, and the score is only told.
    pub on: bool,
    /// Least score of a detection.
    pub least: Quantity,
    /// Weight of each term.
    pub weights: Weights,
}

/// Figures of the network that says where fruit are. A score is then a logistic function of the weighted log-odds of network and evidence.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Network {
    /// The network; by default that of the preset `learned`.
    #[serde(default, skip_serializing_if = "Onnx::is_default")]
    pub onnx: Onnx,
    /// Least probability of a place at which a sphere is fitted.
    pub least: Quantity,
    /// Constant term of a score.
    pub always: Quantity,
    /// Weight of the log-odds of the network's probability.
    pub network: Quantity,
    /// Weight of the log-odds of the score by the evidence.
    pub evidence: Quantity,
    /// Standard deviation of the depth that the disc of a place tells. Without it a sphere is that of the fit; with it direction and radius are those of the disc, and depth is
    /// the mean of both.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub disc: Option<Quantity>,
    /// Of longer focal lengths so many columns and rows are left out that this one remains: the network has learned sizes in pixels.
    pub focal: Quantity,
}

impl Network {
    /// Score of a sphere from the network's probability and the score by the evidence.
    pub(crate) fn score(&self, network: f64, evidence: f64) -> f64 {
        let odds = |p: f64| {
            let p = p.clamp(LEAST_PROBABILITY, 1.0 - LEAST_PROBABILITY);
            math::ln(p / (1.0 - p))
        };
        let weighted = self.network.si() * odds(network) + self.evidence.si() * odds(evidence);
        1.0 / (1.0 + math::exp(-(self.always.si() + weighted)))
    }
}

/// Probabilities are at least so far from 0 and 1 before their odds are taken: our own choice.
const LEAST_PROBABILITY: f64 = 1e-6;

/// Weights of the terms of [`crate::Evidence::terms`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs, reason = "each is the weight of the term of its name")]
pub struct Weights {
    pub always: Quantity,
    pub cover: Quantity,
    pub through: Quantity,
    pub visible: Quantity,
    pub rim: Quantity,
    pub beyond: Quantity,
    pub misfit: Quantity,
    pub flatness: Quantity,
    pub roundness: Quantity,
    pub outline: Quantity,
    pub outline_misfit: Quantity,
    pub size: Quantity,
    pub size_squared: Quantity,
}

impl Weights {
    /// Number of terms.
    pub const TERMS: usize = 13;

    /// Returns the weights in the order of the terms.
    pub(crate) fn si(&self) -> [f64; Self::TERMS] {
        [
            &self.always,
            &self.cover,
            &self.through,
            &self.visible,
            &self.rim,
            &self.beyond,
            &self.misfit,
            &self.flatness,
            &self.roundness,
            &self.outline,
            &self.outline_misfit,
            &self.size,
            &self.size_squared,
        ]
        .map(Quantity::si)
    }
}

/// Gates. Each has a switch for ablations.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gates {
    /// Radius of the sphere.
    pub radius: IntervalGate,
    /// Largest RMS of the radial residual.
    pub residual: LimitGate,
    /// Least mean cosine between the outward normal and the direction to the camera.
    pub convexity: LimitGate,
    /// Least share of the silhouette's border at which depth jumps or ends.
    pub isolation: LimitGate,
    /// Number of pixels divided by that of the sphere's disc, pi (R f / z)^2.
    pub pixel_ratio: IntervalGate,
    /// Largest ratio of the footprint's second moments (elongation squared).
    pub elongation: LimitGate,
    /// Largest RMS of the sphere divided by that of the best cylinder.
    pub cylinder: LimitGate,
    /// Not a gate of its own: pixels at least this far in front of the sphere hide it. Elongation counts hidden pixels of the disc as
    /// footprint, and isolation leaves them out of the border where depth does not jump.
    pub hidden: LimitGate,
}

/// A gate with one limit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LimitGate {
    /// True if the gate is applied.
    pub on: bool,
    /// Limit of the gate.
    pub limit: Quantity,
}

/// A gate with an allowed interval.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct IntervalGate {
    /// True if the gate is applied.
    pub on: bool,
    /// The allowed interval.
    pub limit: Span,
}

/// Masks from kinematics.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mask {
    /// Margin by which the robot's shapes are grown.
    pub robot_margin: Quantity,
    /// Height above the ground below which a pixel counts as ground.
    pub ground_margin: Quantity,
}

/// Tracker.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tracking {
    /// Largest distance between a track and a sighting that belongs to it.
    pub merge_distance: Quantity,
    /// Number of sightings that confirm a track.
    pub hits: Count,
    /// Number of sightings over which position and radius are averaged.
    pub memory: Count,
    /// Time after which an unconfirmed track that is not seen again is dropped.
    pub tentative_life: Quantity,
    /// Time after which a confirmed track that is not seen again is dropped.
    pub confirmed_life: Quantity,
}

impl LimitGate {
    /// Returns the limit in SI units; `None` if the gate is off.
    pub fn si(&self) -> Option<f64> {
        self.on.then(|| self.limit.si())
    }
}

impl IntervalGate {
    /// Returns the interval in SI units; `None` if the gate is off.
    pub fn si(&self) -> Option<(f64, f64)> {
        self.on.then(|| self.limit.si())
    }
}

impl DetectorConfig {
    /// Reads a config from TOML text; `file` names the config in errors. With `base = "NAME"` the text holds only what differs from that
    /// preset.
    ///
    /// # Errors
    /// The text is not TOML, there is no such base, a field is missing or unknown, or a value lies outside its range.
    pub fn from_toml(file: &str, text: &str) -> Result<Self, ConfigError> {
        from_table(file, with_base(file, parse(file, text)?, &preset_text, &[])?)
    }

    /// Presets that come with the crate: names and TOML texts.
    pub const FILES: &[(&str, &str)] = &[
        ("paper", PAPER_TOML),
        ("paper-single", PAPER_SINGLE_TOML),
        ("scored", include_str!("../configs/scored/perception.toml")),
        ("d435i", include_str!("../configs/d435i/perception.toml")),
        ("d435i-aligned", include_str!("../configs/d435i-aligned/perception.toml")),
        ("zed-mini", include_str!("../configs/zed-mini/perception.toml")),
        ("azure-kinect", include_str!("../configs/azure-kinect/perception.toml")),
        ("azure-kinect-native", include_str!("../configs/azure-kinect-native/perception.toml")),
        ("learned", include_str!("../configs/learned/perception.toml")),
        ("learned-colour", include_str!("../configs/learned-colour/perception.toml")),
    ];

    /// Returns the detector with the network of a preset in front of its fit, and with the least score of that preset. A detector without a score fits as `scored` does.
    ///
    /// # Errors
    /// There is no preset of that name.
    pub fn with_network(self, name: &str) -> Result<Self, String> {
        let learned = Self::named(name)?;
        if !self.score.on {
            return Ok(learned);
        }
        let score = Score { least: learned.score.least, ..self.score };
        Ok(Self { network: learned.network, score, ..self })
    }

    /// True if the detector has a network that looks at colour.
    pub fn sees_colour(&self) -> bool {
        self.network.as_ref().is_some_and(|network| network.onnx.sees_colour())
    }

    /// Returns a preset that comes with the crate.
    ///
    /// # Errors
    /// There is no preset of that name; the message lists all names.
    pub fn named(name: &str) -> Result<Self, String> {
        let text = preset_text(name)?;
        Self::from_toml(&format!("{name}/perception.toml"), text).map_err(|e| e.to_string())
    }

    /// Returns the preset `paper`, for a camera without errors.
    ///
    /// # Panics
    /// Never: the embedded file is read in this crate's tests.
    pub fn paper() -> Self {
        Self::named("paper").unwrap_or_else(|e| unreachable!("embedded preset: {e}"))
    }

    /// Returns the preset `paper-single`: the paper's own detector, one sphere fitted to each whole patch, for a camera without errors.
    ///
    /// # Panics
    /// Never: the embedded file is read in this crate's tests.
    pub fn paper_single() -> Self {
        Self::named("paper-single").unwrap_or_else(|e| unreachable!("embedded preset: {e}"))
    }

    /// Returns the preset `d435i`, for the errors of an Intel RealSense D435i at 848 x 480.
    ///
    /// # Panics
    /// Never: the embedded file is read in this crate's tests.
    pub fn d435i() -> Self {
        Self::named("d435i").unwrap_or_else(|e| unreachable!("embedded preset: {e}"))
    }
}

fn preset_text(name: &str) -> Result<&'static str, String> {
    let known = DetectorConfig::FILES.iter().find(|(known, _)| *known == name);
    known.map(|(_, text)| *text).ok_or_else(|| {
        let names: Vec<&str> = DetectorConfig::FILES.iter().map(|(known, _)| *known).collect();
        format!("no detector '{name}'; the detectors are: {}", names.join(", "))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_preset_reads_and_a_value_out_of_range_is_named() {
        for (name, text) in DetectorConfig::FILES {
            assert_eq!(
                DetectorConfig::from_toml("x.toml", text).unwrap(),
                DetectorConfig::named(name).unwrap()
            );
        }
        assert_ne!(DetectorConfig::paper(), DetectorConfig::d435i());
        assert!(DetectorConfig::named("d415").unwrap_err().contains("paper, paper-single, scored, d435i"));
        let single = DetectorConfig::paper_single();
        assert!(!single.fit.refine && !single.gates.hidden.on);
        let mut paper = DetectorConfig::paper();
        (paper.fit.refine, paper.gates.hidden.on) = (false, false);
        assert_eq!(single, paper, "nothing else differs");
        let other = DetectorConfig::from_toml("x.toml", "base = \"paper\"\n[fit]\nrefine = false\n").unwrap();
        assert_eq!(other.gates, DetectorConfig::paper().gates);
        assert!(!other.fit.refine && other.fit.band == DetectorConfig::paper().fit.band);
        for (text, message) in [
            ("base = 3", "base: the name of a base is text"),
            ("base = \"d415\"", "base: no detector 'd415'"),
            ("base = \"paper\"\n[fitt]\nrefine = true", "unknown field `fitt`"),
            ("base = \"paper\"\n[fit]\nband = 3", "fit.band"),
            ("base = \"paper\"\nfit = 3", "fit"),
        ] {
            let e = DetectorConfig::from_toml("x.toml", text).unwrap_err().to_string();
            assert!(e.contains(message), "{e}");
        }
        let text = PAPER_TOML.replacen("depth_jump = { value = 15.0", "depth_jump = { value = -1.0", 1);
        let e = DetectorConfig::from_toml("x.toml", &text).unwrap_err().to_string();
        assert!(e.contains("segmentation.depth_jump") && e.contains("-1"), "{e}");
        let text = PAPER_TOML.replacen("depth_jump", "depth_jmp", 1);
        let e = DetectorConfig::from_toml("x.toml", &text).unwrap_err().to_string();
        assert!(e.contains("depth_jmp"), "{e}");
    }
}
