//! Figures of unpruned trees of four seasons.

use serde::{Deserialize, Serialize};

use super::{Check, Measured, Moments, Population, Sample, Target};
use crate::GrowthUnit;
use crate::morphometry::distribution::{ks_distance, mean_and_sd, mode, normal_cdf, quantile, quantile_cdf};
use crate::morphometry::shoots::{
    angle_from_vertical, branches_on_leader, divergences, length_classes, total_length,
};

/// Measurements of young trees.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Young {
    /// Angles of branches on the trunk from the vertical.
    pub angle_sample: Sample,
    /// Published moments of the angles.
    pub angle: Moments,
    /// Targets of the figures.
    pub targets: YoungTargets,
}

/// Targets of the figures of young trees.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct YoungTargets {
    /// Kolmogorov-Smirnov distance of branch angles.
    pub angle_distance: Target,
    /// Most frequent divergence.
    pub divergence_mode: Target,
    /// First quartile of divergences.
    pub divergence_quartile_1: Target,
    /// Third quartile of divergences.
    pub divergence_quartile_3: Target,
    /// Share of short growth units.
    pub short_shoots: Target,
    /// Share of medium growth units.
    pub medium_shoots: Target,
    /// Share of long growth units.
    pub long_shoots: Target,
    /// Diameter of the trunk: mean of the trees.
    pub trunk_diameter_mean: Target,
    /// Diameter of the trunk: standard deviation over the trees.
    pub trunk_diameter_sd: Target,
    /// Length of trunk and leader: mean of the trees.
    pub leader_length_mean: Target,
    /// Length of trunk and leader: standard deviation over the trees.
    pub leader_length_sd: Target,
    /// Length of all growth units: mean of the trees.
    pub shoot_length_mean: Target,
    /// Length of all growth units: standard deviation over the trees.
    pub shoot_length_sd: Target,
    /// Number of growth units: mean of the trees.
    pub growth_units_mean: Target,
    /// Number of growth units: standard deviation over the trees.
    pub growth_units_sd: Target,
    /// Branches on trunk and leader, very short ones included: mean of the trees.
    pub branches_mean: Target,
    /// Branches on trunk and leader, very short ones included: standard deviation over the trees.
    pub branches_sd: Target,
    /// Leaf area in the last season: mean of the trees.
    pub leaf_area_mean: Target,
    /// Leaf area in the last season: standard deviation over the trees.
    pub leaf_area_sd: Target,
    /// Leaf area in the season before: mean of the trees.
    pub leaf_area_before_mean: Target,
    /// Leaf area in the season before: standard deviation over the trees.
    pub leaf_area_before_sd: Target,
}

impl Measured {
    /// Compares the figures of young trees.
    pub fn young_checks(&self, trees: &Population) -> Vec<Check> {
        let t = &self.young.targets;
        let mut checks = angle_checks(self, trees).to_vec();
        checks.extend(divergence_checks(self, trees));
        let units: Vec<GrowthUnit> = trees.trees.iter().flat_map(|tree| tree.units.iter().copied()).collect();
        let classes = length_classes(&units, trees.limits);
        for (target, name, part) in [
            (&t.short_shoots, "young.shoots.short", classes[0]),
            (&t.medium_shoots, "young.shoots.medium", classes[1]),
            (&t.long_shoots, "young.shoots.long", classes[2]),
        ] {
            checks.push(target.check(name, part).noted(format!("of {} growth units", units.len())));
        }
        let leader = |u: &&GrowthUnit| u.order == 0;
        let last = units.iter().map(|unit| unit.season).max().unwrap_or(0);
        for (mean, sd, name, figures) in [
            (
                &t.trunk_diameter_mean,
                &t.trunk_diameter_sd,
                "trunk_diameter",
                trees.each(|tree| tree.skeleton.segments.first().map_or(0.0, |s| 2.0 * s.radius)),
            ),
            (
                &t.leader_length_mean,
                &t.leader_length_sd,
                "leader_length",
                trees.each(|tree| tree.units.iter().filter(leader).map(|u| u.length).sum()),
            ),
            (
                &t.shoot_length_mean,
                &t.shoot_length_sd,
                "shoot_length",
                trees.each(|tree| total_length(&tree.units)),
            ),
            (
                &t.growth_units_mean,
                &t.growth_units_sd,
                "growth_units",
                trees.each(|tree| tree.units.len() as f64),
            ),
            (
                &t.branches_mean,
                &t.branches_sd,
                "branches",
                trees.each(|tree| branches_on_leader(&tree.units).count() as f64),
            ),
            (
                &t.leaf_area_mean,
                &t.leaf_area_sd,
                "leaf_area",
                trees.each(|tree| leaf_area_law(trees, &tree.units, last)),
            ),
            (
                &t.leaf_area_before_mean,
                &t.leaf_area_before_sd,
                "leaf_area_before",
                trees.each(|tree| leaf_area_law(trees, &tree.units, last.saturating_sub(1))),
            ),
        ] {
            let (m, s) = mean_and_sd(&figures);
            checks.push(mean.check(&format!("young.{name}.mean"), m));
            checks.push(sd.check(&format!("young.{name}.sd"), s));
        }
        checks
    }
}

/// Leaf area at dial 1 of the growth units of a season [m^2]; the leaves of a tree have that of the
/// last season.
fn leaf_area_law(trees: &Population, units: &[GrowthUnit], season: u8) -> f64 {
    let Some(law) = &trees.spec.foliage.leaf_area else { return f64::NAN };
    units.iter().filter(|u| u.season == season).map(|u| law.of_shoot(u.length, u.floral)).sum()
}

fn angle_checks(measured: &Measured, trees: &Population) -> [Check; 2] {
    let young = &measured.young;
    let to_unit = 1.0 / young.angle.unit.to_si();
    let angles: Vec<f64> = trees
        .trees
        .iter()
        .flat_map(|tree| branches_on_leader(&tree.units).map(|unit| angle_from_vertical(unit) * to_unit))
        .collect();
    let (mean, sd) = mean_and_sd(&angles);
    let note = format!("{} branches on leaders, {mean:.1} +- {sd:.1} deg", angles.len());
    let distance = &young.targets.angle_distance;
    let to_sample = ks_distance(&angles, |x| quantile_cdf(&young.angle_sample.quantiles, x));
    let to_normal = ks_distance(&angles, |x| normal_cdf(x, young.angle.mean, young.angle.sd));
    [
        distance.check("young.angle.ks_to_sample", to_sample).noted(note),
        distance.check("young.angle.ks_to_published_normal", to_normal),
    ]
}

fn divergence_checks(measured: &Measured, trees: &Population) -> [Check; 3] {
    let t = &measured.young.targets;
    let folded: Vec<f64> = trees.trees.iter().flat_map(|tree| divergences(&tree.units)).collect();
    let most_frequent = mode(&folded, (0.0, std::f64::consts::PI), measured.survey.mode_bandwidth.si());
    let median = quantile(&folded, 0.5).to_degrees();
    let note = format!("{} pairs of successive branches, median {median:.1} deg", folded.len());
    [
        t.divergence_mode.check("young.divergence.mode", most_frequent).noted(note),
        t.divergence_quartile_1.check("young.divergence.quartile_1", quantile(&folded, 0.25)),
        t.divergence_quartile_3.check("young.divergence.quartile_3", quantile(&folded, 0.75)),
    ]
}
