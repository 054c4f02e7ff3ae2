//! Radii by the pipe model.
//!
//! `r_parent^beta = sum over children of r_child^beta + p`, p >= 0 one constant a tree, with every tip at the
//! tip radius. The law is linear in r^beta, so an internode with `tips` tips and `forks` internodes with children above it
//! (itself included) has `r^beta = tips r_tip^beta + forks p`, and p follows from the trunk's radius. Instead of 1 with
//! children and 0 without, an internode may count with any weight: the pipes of branches that were shed or cut off there. If
//! the tips alone make the trunk thicker than configured, p = 0 and the trunk is thicker.

use orchard_geometry::math;

/// Radius \[m\] of every internode from its parent's index; parents stand before children. `weight` maps an
/// internode's index, and true if it has children, to its weight in p.
pub(crate) fn radii(
    parents: &[Option<usize>],
    weight: impl Fn(usize, bool) -> f64,
    tip_radius: f64,
    trunk_radius: f64,
    exponent: f64,
) -> Vec<f64> {
    let tip_term = math::pow(tip_radius, exponent);
    let mut tips = vec![0_u32; parents.len()];
    let mut forks = vec![0.0_f64; parents.len()];
    for (i, parent) in parents.iter().enumerate().rev() {
        let has_children = tips[i] > 0;
        tips[i] = tips[i].max(1);
        forks[i] += weight(i, has_children);
        if let Some(parent) = *parent {
            tips[parent] += tips[i];
            forks[parent] += forks[i];
        }
    }
    let added = match (tips.first(), forks.first()) {
        (Some(&tips), Some(&forks)) if forks > 0.0 => {
            ((math::pow(trunk_radius, exponent) - f64::from(tips) * tip_term) / forks).max(0.0)
        }
        _ => 0.0,
    };
    let radius =
        |(&tips, &forks): (&u32, &f64)| math::pow(f64::from(tips) * tip_term + forks * added, 1.0 / exponent);
    tips.iter().zip(&forks).map(radius).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parents_only(_: usize, has_children: bool) -> f64 {
        f64::from(u8::from(has_children))
    }

    #[test]
    fn trunk_of_a_fork() {
        // Two tips on a trunk: R^2 = 2 t^2 + p.
        let r = radii(&[None, Some(0), Some(0)], parents_only, 1.0, 3.0, 2.0);
        assert!((r[0] - 3.0).abs() < 1e-15 && r[1] == 1.0 && r[2] == 1.0, "{r:?}");
    }

    #[test]
    fn a_trunk_is_never_thinner_than_its_pipes() {
        let r = radii(&[None, Some(0), Some(0)], parents_only, 1.0, 1.2, 2.0);
        assert!((r[0] - 2.0_f64.sqrt()).abs() < 1e-15, "{r:?}");
    }

    #[test]
    fn a_lone_internode_is_a_tip() {
        assert_eq!(radii(&[None], parents_only, 2.0, 9.0, 2.0), [2.0]);
    }
}
