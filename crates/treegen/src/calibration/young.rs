//! Figures of unpruned trees of four seasons.

use orchard_geometry::math;
use serde::{Deserialize, Serialize};

use super::{Check, Measured, Moments, Population, Sample, Target, trunk_diameter};
use crate::GrowthUnit;
use crate::morphometry::allometry::{regression, standardised_major_axis};
use crate::morphometry::distribution::{
    ks_distance, mean_and_sd, median, mode, normal_cdf, quantile, quantile_cdf,
};
use crate::morphometry::shoots::{
    LeaderBranch, angle_from_vertical, branches_on_leader, divergences, leader_branches, length_classes,
    total_length,
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
    /// Structure: branches on the leader by their lengths.
    pub structure: StructureTargets,
}

/// Targets of the structure of young trees. Limbs are the branches on the leader of 20 cm and more.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StructureTargets {
    /// Median diameter at the base of limbs.
    pub limb_diameter: Target,
    /// Median diameter at the base of limbs in three classes of length: 20 to 40 cm, 40 to 80 cm, 80 cm and more.
    pub limb_diameter_by_length: [Target; 3],
    /// Exponent of a limb's length against the diameter of its base.
    pub limb_exponent: Target,
    /// Summed cross-sections of the branches' bases over that of the trunk: mean of the trees.
    pub limb_area: Target,
    /// Correlation over trees of the logarithms of trunk diameter and length of all shoots.
    pub size_correlation: Target,
    /// Number of branches of 40 cm and more: mean of the trees.
    pub long_branches: Target,
    /// Median length of a branch's axis.
    pub branch_length: Target,
    /// Change of the angle from the vertical with the length: slope on its decimal logarithm.
    pub angle_by_length: Target,
    /// Mean angle of a tree's limbs: standard deviation over the trees.
    pub limb_angle_sd: Target,
}

/// Lower ends of the length classes of limbs \[m\].
const LIMB_LENGTHS: [f64; 3] = [0.2, 0.4, 0.8];

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
                trees.each(|tree| trunk_diameter(&tree.skeleton)),
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
        checks.extend(structure_checks(&t.structure, trees));
        checks
    }
}

fn structure_checks(t: &StructureTargets, trees: &Population) -> Vec<Check> {
    let of_trees: Vec<Vec<LeaderBranch>> = trees.trees.iter().map(leader_branches).collect();
    let branches = || of_trees.iter().flatten();
    let limbs = || branches().filter(|branch| branch.length >= LIMB_LENGTHS[0]);
    let thick = |low: f64, high: f64| -> Vec<f64> {
        let of_class = branches().filter(|branch| (low..high).contains(&branch.length));
        of_class.filter_map(|branch| branch.base_diameter).collect()
    };
    let all = thick(LIMB_LENGTHS[0], f64::INFINITY);
    let mut checks = vec![
        t.limb_diameter
            .check("young.limb.diameter", median(&all))
            .noted(format!("median of {} limbs", all.len())),
    ];
    for (k, target) in t.limb_diameter_by_length.iter().enumerate() {
        let end = LIMB_LENGTHS.get(k + 1).copied().unwrap_or(f64::INFINITY);
        let of_class = thick(LIMB_LENGTHS[k], end);
        let name = format!("young.limb.diameter.from_{:.0}_cm", 100.0 * LIMB_LENGTHS[k]);
        checks.push(
            target.check(&name, median(&of_class)).noted(format!("median of {} limbs", of_class.len())),
        );
    }
    let pairs = limbs().filter_map(|limb| Some((limb.base_diameter?, limb.length)));
    let axis = standardised_major_axis(pairs);
    let note = format!("standardised major axis of {} limbs, r2 {:.2}", axis.n, axis.r_squared);
    checks.push(t.limb_exponent.check("young.limb.exponent", axis.slope).noted(note));
    let mean =
        |figure: &dyn Fn(usize) -> f64| (0..of_trees.len()).map(figure).sum::<f64>() / of_trees.len() as f64;
    let trunk = |tree: usize| trunk_diameter(&trees.trees[tree].skeleton);
    let area = mean(&|tree| {
        let bases = of_trees[tree].iter().filter_map(|branch| branch.base_diameter);
        bases.map(|d| d * d).sum::<f64>() / (trunk(tree) * trunk(tree))
    });
    checks.push(t.limb_area.check("young.limb.area", area));
    let sizes = (0..of_trees.len()).map(|tree| (trunk(tree), total_length(&trees.trees[tree].units)));
    let size = standardised_major_axis(sizes);
    let correlation = size.r_squared.sqrt().copysign(size.slope);
    let note = format!("length follows the diameter with exponent {:.2}", size.slope);
    checks.push(t.size_correlation.check("young.size_correlation", correlation).noted(note));
    let long = |tree: usize| of_trees[tree].iter().filter(|branch| branch.length >= LIMB_LENGTHS[1]).count();
    checks.push(t.long_branches.check("young.long_branches", mean(&|tree| long(tree) as f64)));
    let lengths: Vec<f64> = branches().map(|branch| branch.length).collect();
    checks.push(t.branch_length.check("young.branch_length", median(&lengths)));
    let slope = regression(branches().map(|b| (math::ln(b.length) / math::ln(10.0), b.angle)));
    checks.push(t.angle_by_length.check("young.angle_by_length", slope));
    let means = of_trees.iter().map(|tree| {
        let angles: Vec<f64> = tree.iter().filter(|b| b.length >= LIMB_LENGTHS[0]).map(|b| b.angle).collect();
        (!angles.is_empty()).then(|| mean_and_sd(&angles).0)
    });
    let means: Vec<f64> = means.flatten().collect();
    checks.push(t.limb_angle_sd.check("young.limb_angle.sd", mean_and_sd(&means).1));
    checks
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
