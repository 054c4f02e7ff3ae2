//! Figures of trees of eight seasons on rootstocks of all vigours.

use orchard_quantity::Span;
use serde::{Deserialize, Serialize};

use super::{Check, Measured, Moments, Population, Sample, Target, height, trunk_diameter};
use crate::morphometry::allometry::{
    area_ratios, diameter_ratios, pipe_exponents, power_law, standardised_major_axis,
};
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
    /// Distributions over pieces, forks and trees.
    pub samples: MatureSamples,
    /// Targets of the figures.
    pub targets: MatureTargets,
}

/// Distributions that were measured on mature trees.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MatureSamples {
    /// Diameter of the trunk.
    pub trunk_diameter: Sample,
    /// Length of the longest path of a limb.
    pub limb_length: Sample,
    /// Diameter of a limb's first piece over the trunk's.
    pub limb_share: Sample,
    /// Length of a piece.
    pub piece_length: Sample,
    /// Diameter of a piece over that of the piece on which it stands.
    pub diameter_ratio: Sample,
    /// Exponent of the pipe model at a fork.
    pub pipe_exponent: Sample,
    /// Summed cross-section above a fork over that below.
    pub area_ratio: Sample,
}

/// A figure of trees as a power law of the trunk's diameter, by regression of the logarithms.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LawTargets {
    /// Exponent.
    pub exponent: Target,
    /// Figure of the law on a trunk of 10 cm.
    pub level: Target,
    /// Standard deviation of the logarithm about the law.
    pub scatter: Target,
}

/// Laws of trees of all sizes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SizeLaws {
    /// Height of the highest tip.
    pub height: LawTargets,
    /// Length of all pieces of wood.
    pub branch_length: LawTargets,
    /// Dry mass of the pieces.
    pub stem_mass: LawTargets,
    /// Dry mass of the twigs.
    pub twig_mass: LawTargets,
    /// Number of twigs.
    pub twigs: LawTargets,
    /// Number of limbs on the leader.
    pub limbs: LawTargets,
}

/// Trunk diameter at which the laws of trees have their level \[m\].
const LAW_TRUNK: f64 = 0.1;

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
    /// Exponent of the pipe model at forks: third quartile less the first.
    pub pipe_exponent_spread: Target,
    /// Median of the summed cross-section above a fork over that below.
    pub area_ratio: Target,
    /// Median of a piece's diameter over that of the piece on which it stands.
    pub diameter_ratio: Target,
    /// Exponent of sub-tree mass against diameter.
    pub mass_diameter: Target,
    /// Exponent of path length against diameter.
    pub path_diameter: Target,
    /// Exponent of sub-tree length against diameter.
    pub length_diameter: Target,
    /// Trunks of the thick trees.
    pub thick_trunk: Span,
    /// Mean dry mass of a thick tree's twigs.
    pub thick_twig_mass: Target,
    /// Laws by which trees follow the trunk's diameter.
    pub size: SizeLaws,
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

        let of_pieces = |figures: fn(&[Branch]) -> Vec<f64>| -> Vec<f64> {
            trees.surveys.iter().flat_map(|survey| figures(&survey.branches)).collect()
        };
        let exponents = of_pieces(pipe_exponents);
        let ratios = of_pieces(area_ratios);
        let quartiles = |v: &[f64]| [quantile(v, 0.25), quantile(v, 0.75)];
        let in_words = |v: &[f64]| {
            let [first, third] = quartiles(v);
            format!("{} forks, quartiles {first:.2} and {third:.2}", v.len())
        };
        checks.push(
            t.pipe_exponent.check("mature.pipe_exponent", median(&exponents)).noted(in_words(&exponents)),
        );
        let [first, third] = quartiles(&exponents);
        checks.push(t.pipe_exponent_spread.check("mature.pipe_exponent.spread", third - first));
        checks.push(t.area_ratio.check("mature.area_ratio", median(&ratios)).noted(in_words(&ratios)));
        let steps = of_pieces(diameter_ratios);
        checks.push(t.diameter_ratio.check("mature.diameter_ratio", median(&steps)));

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
        checks.extend(self.size_checks(trees));
        checks.extend(self.sample_checks(trees));
        checks
    }

    /// Compares how trees follow their trunks' diameters.
    fn size_checks(&self, trees: &Population) -> Vec<Check> {
        let (t, dry) = (&self.mature.targets, self.survey.dry_density.si());
        let trunks = trees.each(|tree| trunk_diameter(&tree.skeleton));
        let twig_masses = trees.each_survey(|survey| dry * survey.twig_volume);
        let thick = trunks.iter().zip(&twig_masses).filter(|(trunk, _)| t.thick_trunk.contains_si(**trunk));
        let thick: Vec<f64> = thick.map(|(_, mass)| *mass).collect();
        let note = format!("mean of {} trees", thick.len());
        let mut checks =
            vec![t.thick_twig_mass.check("mature.thick.twig_mass", mean_and_sd(&thick).0).noted(note)];
        for (targets, name, figures) in [
            (&t.size.height, "height", trees.each(|tree| height(&tree.skeleton))),
            (&t.size.branch_length, "branch_length", trees.each_survey(|s| s.length())),
            (&t.size.stem_mass, "stem_mass", trees.each_survey(|s| dry * s.volume())),
            (&t.size.twig_mass, "twig_mass", twig_masses),
            (&t.size.twigs, "twigs", trees.each_survey(|s| s.twigs as f64)),
            (&t.size.limbs, "limbs", trees.each_survey(|s| s.limbs().count() as f64)),
        ] {
            let law = power_law(trunks.iter().copied().zip(figures), LAW_TRUNK);
            for (target, part, figure) in [
                (&targets.exponent, "exponent", law.exponent),
                (&targets.level, "level", law.level),
                (&targets.scatter, "scatter", law.scatter),
            ] {
                checks.push(target.check(&format!("mature.size.{name}.{part}"), figure));
            }
        }
        checks
    }

    /// Compares distributions over pieces, forks and trees.
    fn sample_checks(&self, trees: &Population) -> Vec<Check> {
        let samples = &self.mature.samples;
        let of_pieces = |figures: fn(&[Branch]) -> Vec<f64>| -> Vec<f64> {
            trees.surveys.iter().flat_map(|survey| figures(&survey.branches)).collect()
        };
        let trunks = trees.each(|tree| trunk_diameter(&tree.skeleton));
        let shares = trees.surveys.iter().zip(&trunks);
        let shares = shares.flat_map(|(survey, trunk)| survey.limbs().map(move |limb| limb.diameter / trunk));
        let shares: Vec<f64> = shares.collect();
        let paths = trees.surveys.iter().flat_map(|survey| survey.limbs().map(|limb| limb.path_length));
        vec![
            samples.trunk_diameter.check("mature.ks.trunk_diameter", &trunks),
            samples.limb_length.check("mature.ks.limb_length", &paths.collect::<Vec<f64>>()),
            samples.limb_share.check("mature.ks.limb_share", &shares),
            samples.piece_length.check(
                "mature.ks.piece_length",
                &of_pieces(|pieces| pieces.iter().map(|piece| piece.length).collect()),
            ),
            samples.diameter_ratio.check("mature.ks.diameter_ratio", &of_pieces(diameter_ratios)),
            samples.pipe_exponent.check("mature.ks.pipe_exponent", &of_pieces(pipe_exponents)),
            samples.area_ratio.check("mature.ks.area_ratio", &of_pieces(area_ratios)),
        ]
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
