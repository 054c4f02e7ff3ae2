//! Counts that tell why an image has few detections: how much was measured, how much of it in range, and which gate refused how many.

use std::collections::BTreeMap;

use orchard_geometry::DepthImage;
use orchard_perception::Candidate;
use serde::Serialize;

/// Depth beyond which no camera for fruit measures, and below which none does \[m\].
const FAR: f64 = 30.0;
const NEAR: f64 = 0.05;
/// Share of the measured pixels there from which the unit is doubted.
const DOUBTFUL: f64 = 0.9;

/// Content of a depth image.
#[derive(Debug, Serialize)]
pub struct Census {
    width: usize,
    height: usize,
    /// Depth of value 1 \[m\].
    unit: f64,
    /// Working range of the detector \[m\].
    range: [f64; 2],
    /// Share of the pixels with a measurement.
    measured: f64,
    /// Share of the measured pixels within the range; null if nothing is measured.
    in_range: Option<f64>,
    /// Spheres that each gate refused.
    refusals: BTreeMap<&'static str, usize>,
    /// Sentences about an image that cannot be right, such as a wrong unit.
    warnings: Vec<String>,
}

impl Census {
    /// Counts.
    pub fn of(depth: &DepthImage, unit: f64, range: (f64, f64), found: &[Candidate]) -> Self {
        let (mut measured, mut inside, mut far, mut near) = (0_usize, 0_usize, 0_usize, 0_usize);
        for z in depth.pixels().iter().map(|&z| f64::from(z)).filter(|z| z.is_finite() && *z > 0.0) {
            measured += 1;
            inside += usize::from(z >= range.0 && z <= range.1);
            far += usize::from(z > FAR);
            near += usize::from(z < NEAR);
        }
        let share = |n: usize, of: usize| (of > 0).then(|| n as f64 / of as f64);
        let mut refusals = BTreeMap::new();
        for gate in found.iter().filter_map(|candidate| candidate.refused_by) {
            *refusals.entry(gate.name()).or_default() += 1;
        }
        let mut warnings = Vec::new();
        let doubt = |n: usize, side: &str, limit: f64| {
            let share = share(n, measured).filter(|share| *share >= DOUBTFUL)?;
            // Rounded down, so that 100 % are all.
            let percent = (100.0 * share).floor();
            Some(format!(
                "{percent} % of the measured pixels are {side} {limit} m: is the unit (--unit {unit}, in metres) right?"
            ))
        };
        warnings.extend(doubt(far, "beyond", FAR));
        warnings.extend(doubt(near, "nearer than", NEAR));
        if measured == 0 {
            warnings.push("no pixel has a measurement".to_owned());
        } else if inside == 0 {
            let (low, high) = range;
            warnings.push(format!(
                "no measured pixel is within the detector's range of {low} to {high} m; --range changes it"
            ));
        }
        Self {
            width: depth.width(),
            height: depth.height(),
            unit,
            range: range.into(),
            measured: share(measured, depth.pixels().len()).unwrap_or(0.0),
            in_range: share(inside, measured),
            refusals,
            warnings,
        }
    }

    /// Tells the counts on the error output.
    pub fn tell(&self, detections: usize) {
        let Self { width, height, range: [near, far], measured, in_range, refusals, warnings, .. } = self;
        let in_range = 100.0 * in_range.unwrap_or(0.0);
        note!(
            "depth: {:.1} % of {width} x {height} pixels measured, {in_range:.1} % of these within {near} to {far} m",
            100.0 * measured
        );
        let refused: Vec<String> = refusals.iter().map(|(gate, n)| format!("{n} by {gate}")).collect();
        let refused = if refused.is_empty() { "none".to_owned() } else { refused.join(", ") };
        note!("detections: {detections}; spheres refused: {refused}");
        for warning in warnings {
            note!("warning: {warning}");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn census(pixels: Vec<f32>, unit: f64) -> Census {
        let depth = DepthImage::from_pixels(pixels.len(), 1, pixels).unwrap();
        Census::of(&depth, unit, (0.3, 3.0), &[])
    }

    #[test]
    fn shares_and_doubts_by_hand() {
        let fine = census(vec![0.0, f32::NAN, 1.0, 2.0, 4.0], 0.001);
        assert_eq!((fine.measured, fine.in_range), (0.6, Some(2.0 / 3.0)));
        assert!(fine.warnings.is_empty());
        let mut metres = vec![1000.0; 199];
        metres.push(1.0);
        let far = census(metres, 1.0);
        assert_eq!(
            far.warnings,
            ["99 % of the measured pixels are beyond 30 m: is the unit (--unit 1, in metres) right?"]
        );
        let near = census(vec![0.001; 3], 1e-6);
        assert!(near.warnings[0].starts_with("100 % of the measured pixels are nearer than 0.05 m"));
        assert!(
            near.warnings[1].starts_with("no measured pixel is within the detector's range of 0.3 to 3 m")
        );
        assert_eq!(census(vec![0.0; 3], 1.0).warnings, ["no pixel has a measurement"]);
    }
}
