//! Ground clearance and target height.

use orchard_geometry::{Rotation, Vec3, rotation_from_z};

use crate::{TreegenError, turtle::Internode};

/// Passes of scaling and lifting before an error is returned.
const PASSES: usize = 64;

/// Largest relative error of the height: some thousand roundings.
const HEIGHT_TOLERANCE: f64 = 1e-12;

/// Scales the tree so that its highest tip is at `height` \[m\] and lifts every branch whose lowest point
/// would be nearer to the ground than `clearance` \[m\].
///
/// # Errors
/// A branch starts too low to clear the ground, or scaling and lifting do not converge.
pub(crate) fn fit_height_and_clearance(
    internodes: &mut [Internode],
    radii: &[f64],
    height: f64,
    clearance: f64,
) -> Result<(), TreegenError> {
    for _ in 0..PASSES {
        let scale = height / top(internodes);
        internodes.iter_mut().for_each(|internode| internode.length *= scale);
        lift(internodes, radii, clearance).map_err(|segment| TreegenError::Clearance {
            segment,
            clearance,
            height,
        })?;
        // Lifting may have raised a branch above the top.
        if (top(internodes) / height - 1.0).abs() <= HEIGHT_TOLERANCE {
            return Ok(());
        }
    }
    Err(TreegenError::Height { height })
}

/// Height of the highest tip \[m\].
pub(crate) fn top(internodes: &[Internode]) -> f64 {
    let mut z_tips = Vec::with_capacity(internodes.len());
    for internode in internodes {
        let z_base: f64 = internode.parent.map_or(0.0, |parent| z_tips[parent]);
        z_tips.push(z_base + internode.heading.z * internode.length);
    }
    z_tips.into_iter().fold(0.0, f64::max)
}

/// Rotates every internode whose capsule reaches below the clearance up about its base in its vertical plane, parents
/// first; its children turn with it. Lengths stay. The trunk (order 0) stands on the ground and is exempt. Returns the
/// rotation of every internode.
///
/// # Errors
/// The index of an internode whose base is itself too low.
pub(crate) fn lift(
    internodes: &mut [Internode],
    radii: &[f64],
    clearance: f64,
) -> Result<Vec<Rotation>, usize> {
    let mut z_tips = Vec::with_capacity(internodes.len());
    let mut lifts: Vec<Rotation> = Vec::with_capacity(internodes.len());
    for (i, internode) in internodes.iter_mut().enumerate() {
        let (z_base, mut turned): (f64, Rotation) =
            internode.parent.map_or((0.0, Rotation::identity()), |parent| (z_tips[parent], lifts[parent]));
        let mut heading = turned * internode.heading;
        if internode.order > 0 {
            let z_least = clearance + radii[i];
            let rise = (z_least - z_base) / internode.length;
            if z_base < z_least - HEIGHT_TOLERANCE || rise > 1.0 {
                return Err(i);
            }
            if heading.z < rise {
                let raised = at_elevation(&heading, rise);
                turned = rotation_between(&heading, &raised) * turned;
                heading = raised;
            }
        }
        internode.heading = heading;
        z_tips.push(z_base + heading.z * internode.length);
        lifts.push(turned);
    }
    Ok(lifts)
}

/// Unit vector with the compass direction of `heading` and the given sine of elevation.
fn at_elevation(heading: &Vec3, sine: f64) -> Vec3 {
    let level = Vec3::new(heading.x, heading.y, 0.0);
    // Straight down has no compass direction: take +x.
    let level = if level.norm() > 0.0 { level.normalize() } else { Vec3::x() };
    level * (1.0 - sine * sine).max(0.0).sqrt() + Vec3::z() * sine
}

/// Smallest rotation from one unit vector to another.
fn rotation_between(from: &Vec3, to: &Vec3) -> Rotation {
    let r_from = rotation_from_z(from);
    r_from * rotation_from_z(&(r_from.inverse() * to)) * r_from.inverse()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn internode(parent: Option<usize>, heading: [f64; 3], order: u8) -> Internode {
        Internode {
            parent,
            heading: Vec3::from(heading).normalize(),
            length: 1.0,
            width: 1.0,
            order,
            unit: None,
        }
    }

    /// A limb that points into the ground, with a child across it: the lifted limb's tip lies on the
    /// clearance plane, and the child keeps its angle to the limb.
    #[test]
    fn a_low_limb_is_lifted_with_its_branches() {
        let mut tree = [
            internode(None, [0.0, 0.0, 1.0], 0),
            internode(Some(0), [1.0, 0.0, -3.0], 1),
            internode(Some(1), [3.0, 0.0, 1.0], 2),
        ];
        let between = tree[1].heading.dot(&tree[2].heading);
        lift(&mut tree, &[0.1, 0.05, 0.02], 0.1).unwrap();
        assert!((1.0 + tree[1].heading.z - 0.15).abs() < 1e-15);
        assert!((tree[1].heading.dot(&tree[2].heading) - between).abs() < 1e-15);
        assert_eq!(tree[0].heading, Vec3::z());
    }

    #[test]
    fn a_clear_tree_stays() {
        let tree = [internode(None, [0.0, 0.0, 1.0], 0), internode(Some(0), [1.0, 0.0, 0.2], 1)];
        let mut lifted = tree.clone();
        lift(&mut lifted, &[0.1, 0.05], 0.1).unwrap();
        assert_eq!(lifted, tree);
    }

    #[test]
    fn a_limb_that_starts_too_low_is_an_error() {
        let mut tree = [internode(None, [0.0, 0.0, 1.0], 0), internode(Some(0), [1.0, 0.0, 0.2], 1)];
        assert_eq!(lift(&mut tree, &[0.1, 0.05], 1.1), Err(1));
    }
}
