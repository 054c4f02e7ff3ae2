//! Figures of trees of eight seasons on rootstocks of all vigours.

use orchard_quantity::Span;
use serde::{Deserialize, Serialize};

use super::{Check, Measured, Moments, Population, Sample, Target};
use crate::morphometry::allometry::{area_ratios, pipe_exponents, standardised_major_axis};
use crate::morphometry::branches::Branch;
use crate::morphometry::distribution::{
    ks_distance, mean_and_sd, median, normal_cdf, quantile, quantile_cdf,
};

/// Measurements of mature trees.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mature {
    /// Fewest and most limbs on a measured tree.
    pub limbs: Span,
    /// Angles of limbs from the vertical.
    pub angle_sample: Sample,
    /// Published moments of the angles.
    pub angle: Moments,
    /// Targets of the figures.
    pub targets: MatureTargets,
}

/// Targets of the figures of mature trees.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MatureTargets {
    /// Kolmogorov-Smirnov distance of limb angles.
    pub angle_distance: Target,
    /// Number of limbs on the leader: mean of the trees.
    pub scaffolds_mean: Target,
    /// Number of limbs on the leader: standard deviation over the trees.
    pub scaffolds_sd: Target,
    /// Share of the trees whose number of limbs is within the measured range.
    pub scaffolds_in_range: Target,
    /// Median exponent of the pipe model at forks.
    pub pipe_exponent: Target,
    /// Median of the summed cross-section above a fork over that below.
    pub area_ratio: Target,
    /// Exponent of sub-tree mass against diameter.
    pub mass_diameter: Target,
    /// Exponent of path length against diameter.
    pub path_diameter: Target,
    /// Exponent of sub-tree length against diameter.
    pub length_diameter: Target,
}

impl Measured {
    /// Compares the figures of mature trees.
    pub fn mature_checks(&self, trees: &Population) -> Vec<Check> {
        let t = &self.mature.targets;
        let mut checks = self.limb_angle_checks("mature", trees).to_vec();
        let limbs = trees.each_survey(|survey| survey.limbs().count() as f64);
        let (mean, sd) = mean_and_sd(&limbs);
        let within = |n: &&f64| self.mature.limbs.contains_si(**n);
        let part = limbs.iter().filter(within).count() as f64 / limbs.len() as f64;
        let range = format!("{} to {}", quantile(&limbs, 0.0), quantile(&limbs, 1.0));
        checks.push(t.scaffolds_mean.check("mature.scaffolds.mean", mean));
        checks.push(t.scaffolds_sd.check("mature.scaffolds.sd", sd));
        checks.push(t.scaffolds_in_range.check("mature.scaffolds.in_range", part).noted(range));

        let exponents: Vec<f64> = trees.surveys.iter().flat_map(|s| pipe_exponents(&s.branches)).collect();
        let ratios: Vec<f64> = trees.surveys.iter().flat_map(|s| area_ratios(&s.branches)).collect();
        let quartiles = |v: &[f64]| {
            format!("{} forks, quartiles {:.2} and {:.2}", v.len(), quantile(v, 0.25), quantile(v, 0.75))
        };
        checks.push(
            t.pipe_exponent.check("mature.pipe_exponent", median(&exponents)).noted(quartiles(&exponents)),
        );
        checks.push(t.area_ratio.check("mature.area_ratio", median(&ratios)).noted(quartiles(&ratios)));

        type Figure = fn(&Branch) -> f64;
        let slopes: [(&Target, &str, Figure); 3] = [
            (&t.mass_diameter, "mature.allometry.mass_diameter", |b| b.subtree_volume),
            (&t.path_diameter, "mature.allometry.path_diameter", |b| b.path_length),
            (&t.length_diameter, "mature.allometry.length_diameter", |b| b.subtree_length),
        ];
        for (target, name, figure) in slopes {
            let pairs = trees.surveys.iter().flat_map(|s| s.branches.iter().map(|b| (b.diameter, figure(b))));
            let axis = standardised_major_axis(pairs);
            let note = format!("standardised major axis of {} pieces, r2 {:.2}", axis.n, axis.r_squared);
            checks.push(target.check(name, axis.slope).noted(note));
        }
        checks
    }

    /// Compares the limb angles of a population of mature trees with the measured ones.
    pub(super) fn limb_angle_checks(&self, population: &str, trees: &Population) -> [Check; 2] {
        let mature = &self.mature;
        let to_unit = 1.0 / mature.angle.unit.to_si();
        let angles: Vec<f64> = trees.limb_angles().iter().map(|angle| angle * to_unit).collect();
        let (mean, sd) = mean_and_sd(&angles);
        let note = format!("{} limbs, {mean:.1} +- {sd:.1} deg", angles.len());
        let distance = &mature.targets.angle_distance;
        let to_sample = ks_distance(&angles, |x| quantile_cdf(&mature.angle_sample.quantiles, x));
        let to_normal = ks_distance(&angles, |x| normal_cdf(x, mature.angle.mean, mature.angle.sd));
        [
            distance.check(&format!("{population}.angle.ks_to_sample"), to_sample).noted(note),
            distance.check(&format!("{population}.angle.ks_to_published_normal"), to_normal),
        ]
    }
}
