//! Growth units: length classes, totals, angles and divergences of branches on the leader.

use std::f64::consts::{PI, TAU};

use orchard_geometry::math;

use crate::growth::{Growth, GrowthUnit};

/// Upper limit of short growth units, and of medium ones \[m\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClassLimits {
    /// Shoots below this length are short.
    pub short: f64,
    /// Shoots above this length are long.
    pub medium: f64,
}

/// Shares of short, medium and long growth units.
pub fn length_classes(units: &[GrowthUnit], limits: ClassLimits) -> [f64; 3] {
    let mut counts = [0.0_f64; 3];
    for unit in units {
        let class = usize::from(unit.length >= limits.short) + usize::from(unit.length > limits.medium);
        counts[class] += 1.0;
    }
    counts.map(|count| count / units.len() as f64)
}

/// Total length of growth units \[m\].
pub fn total_length(units: &[GrowthUnit]) -> f64 {
    units.iter().map(|unit| unit.length).sum()
}

/// The first growth units of the branches on the leader, from below up.
pub fn branches_on_leader(units: &[GrowthUnit]) -> impl Iterator<Item = &GrowthUnit> {
    units.iter().filter(|unit| unit.order == 1 && unit.first)
}

/// An axis that stands on the leader.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeaderBranch {
    /// Length of its axis \[m\].
    pub length: f64,
    /// Diameter at its base \[m\]; `None` for a branch so short that it is no link of its own.
    pub base_diameter: Option<f64>,
    /// Angle of its base from the vertical \[rad\].
    pub angle: f64,
}

/// The axes on the leader, from below up.
pub fn leader_branches(tree: &Growth) -> Vec<LeaderBranch> {
    let segments = &tree.skeleton.segments;
    let mut branches: Vec<LeaderBranch> = Vec::new();
    // Units of an axis follow one another in the order in which they are drawn, with those of its laterals between them.
    for unit in tree.units.iter().filter(|unit| unit.order == 1) {
        if unit.first {
            let segment = &segments[unit.segment];
            let base_diameter = (segment.order == 1).then_some(2.0 * segment.radius);
            branches.push(LeaderBranch { length: 0.0, base_diameter, angle: angle_from_vertical(unit) });
        }
        if let Some(branch) = branches.last_mut() {
            branch.length += unit.length;
        }
    }
    branches
}

/// Angle of a growth unit's base from the vertical \[rad\].
pub fn angle_from_vertical(unit: &GrowthUnit) -> f64 {
    math::atan2(unit.heading_world.xy().norm(), unit.heading_world.z)
}

/// Angles between the compass directions of successive branches on the leader, folded to [0, pi] \[rad\].
pub fn divergences(units: &[GrowthUnit]) -> Vec<f64> {
    let azimuths: Vec<f64> = branches_on_leader(units)
        .map(|unit| math::atan2(unit.heading_world.y, unit.heading_world.x))
        .collect();
    azimuths.windows(2).map(|pair| folded(pair[1] - pair[0])).collect()
}

/// Absolute value of an angle wrapped to (-pi, pi], in [0, pi].
fn folded(angle: f64) -> f64 {
    let turned = angle.rem_euclid(TAU);
    if turned > PI { TAU - turned } else { turned }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lsystem::AxisKind;
    use orchard_geometry::Vec3;

    fn unit(order: u8, length: f64, azimuth_deg: f64, angle_deg: f64) -> GrowthUnit {
        let (sin_a, cos_a) = math::sin_cos(azimuth_deg.to_radians());
        let (sin_z, cos_z) = math::sin_cos(angle_deg.to_radians());
        GrowthUnit {
            order,
            season: 0,
            axis: AxisKind::Lateral,
            floral: false,
            first: true,
            length,
            heading_world: Vec3::new(sin_z * cos_a, sin_z * sin_a, cos_z),
            segment: 0,
        }
    }

    #[test]
    fn classes_and_totals() {
        let units = [
            unit(1, 0.01, 0.0, 0.0),
            unit(1, 0.05, 0.0, 0.0),
            unit(1, 0.2, 0.0, 0.0),
            unit(1, 0.3, 0.0, 0.0),
        ];
        let limits = ClassLimits { short: 0.05, medium: 0.2 };
        assert_eq!(length_classes(&units, limits), [0.25, 0.5, 0.25]);
        assert!((total_length(&units) - 0.56).abs() < 1e-15);
    }

    #[test]
    fn divergences_are_folded_and_skip_other_orders() {
        let mut units = [10.0, 150.0, 290.0, 95.0].map(|azimuth| unit(1, 0.1, azimuth, 80.0));
        units[2].order = 2;
        let degrees: Vec<f64> = divergences(&units).iter().map(|d| d.to_degrees().round()).collect();
        assert_eq!(degrees, [140.0, 55.0]);
        assert!((angle_from_vertical(&units[0]).to_degrees() - 80.0).abs() < 1e-12);
    }
}
