//! Figures of dwarf trees of eight seasons.

use serde::{Deserialize, Serialize};

use super::{Check, Measured, Population, Target, height, trunk_diameter};
use crate::morphometry::distribution::{mean_and_sd, quantile};

/// Measurements of dwarf trees.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Dwarf {
    /// Targets of the figures.
    pub targets: DwarfTargets,
}

/// Targets of the figures of dwarf trees.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DwarfTargets {
    /// Height of the highest tip.
    pub height: Target,
    /// Diameter of the trunk.
    pub trunk_diameter: Target,
    /// Length of all pieces of wood between forks.
    pub branch_length: Target,
    /// Number of these pieces.
    pub pieces: Target,
    /// Number of twigs on them.
    pub twigs: Target,
    /// Dry mass of the pieces.
    pub stem_mass: Target,
    /// Dry mass of the twigs.
    pub twig_mass: Target,
    /// Number of hanging fruit.
    pub fruit: Target,
    /// Mass of the fruit.
    pub crop: Target,
    /// Largest bending moment over the rupture moment.
    pub load: Target,
}

impl Measured {
    /// Compares the figures of dwarf trees, except those of their crop.
    pub fn dwarf_checks(&self, trees: &Population) -> Vec<Check> {
        let t = &self.dwarf.targets;
        let dry = self.survey.dry_density.si();
        let mut checks = vec![
            mean_of(&t.height, "dwarf.height", &trees.each(|tree| height(&tree.skeleton))),
            mean_of(
                &t.trunk_diameter,
                "dwarf.trunk_diameter",
                &trees.each(|tree| trunk_diameter(&tree.skeleton)),
            ),
            mean_of(&t.branch_length, "dwarf.branch_length", &trees.each_survey(|s| s.length())),
            mean_of(&t.pieces, "dwarf.pieces", &trees.each_survey(|s| s.branches.len() as f64)),
            mean_of(&t.twigs, "dwarf.twigs", &trees.each_survey(|s| s.twigs as f64)),
            mean_of(&t.stem_mass, "dwarf.stem_mass", &trees.each_survey(|s| dry * s.volume())),
            mean_of(&t.twig_mass, "dwarf.twig_mass", &trees.each_survey(|s| dry * s.twig_volume)),
        ];
        checks.extend(self.limb_angle_checks("dwarf", trees));
        checks
    }
}

/// Compares the mean of a figure over trees with its target; the note has the 5 % and 95 % quantiles.
pub fn mean_of(target: &Target, name: &str, figures: &[f64]) -> Check {
    let k = target.unit.to_si();
    let at = |p| quantile(figures, p) / k;
    let note = format!("mean of {} trees; 5 % to 95 %: {:.3} to {:.3}", figures.len(), at(0.05), at(0.95));
    target.check(name, mean_and_sd(figures).0).noted(note)
}
