//! Stiffness laws of the joints.

use crate::{Timber, section};
use orchard_geometry::math;
use orchard_spec::wood::{JointLaw, WoodSpec};
use orchard_treegen::Skeleton;

/// Stiffness of the joint at a segment's base [N m/rad].
///
/// A rigid link with a joint at its base stands for a beam whose bending between the middles of two segments is
/// gathered in the joint between them. The corrected law adds the compliances of those two halves,
///
/// `1 / k = l_p / (2 E I_p) + l / (2 E I)`,
///
/// and at a branch root, where the wood is clamped into its parent, keeps its own half alone: k = 2 E I / l. A
/// uniform cantilever of n links then errs by 1 / (2 n^2) under a tip load. The paper's law takes E I / l everywhere.
pub(crate) fn of_joint(skeleton: &Skeleton, timber: &Timber, index: usize, wood: &WoodSpec) -> f64 {
    let segment = &skeleton.segments[index];
    let of_segment = |i: usize| {
        let segment = &skeleton.segments[i];
        section::joint_stiffness(timber.youngs_modulus[i], segment.radius, segment.length)
    };
    let whole = of_segment(index);
    match wood.joint_law {
        JointLaw::Paper => whole,
        JointLaw::Corrected => {
            let before = segment.parent.filter(|&p| skeleton.segments[p].order == segment.order);
            let half_before = before.map_or(0.0, |p| 0.5 / of_segment(p));
            1.0 / (half_before + 0.5 / whole)
        }
        JointLaw::PerLevel => {
            let level = f64::from(segment.order);
            wood.per_level_stiffness.si() * math::exp(-wood.per_level_decay.si() * level)
        }
    }
}
