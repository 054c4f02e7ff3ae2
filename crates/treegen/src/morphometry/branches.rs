//! Surveys a tree as orchard surveys do: pieces of wood between forks.
//!
//! Wood thinner than a limit is a twig, also where an axis goes on: it makes neither pieces nor forks. Columns as in the data of
//! Brym and Ernest (2018): length and mid-length diameter of a piece, length of the longest path above it,
//! total length and total dry mass of it and all pieces above.

use std::f64::consts::PI;

use orchard_geometry::math;

use crate::Skeleton;

/// A piece of wood between forks.
#[derive(Debug, Clone, PartialEq)]
pub struct Branch {
    /// Index of the piece on which it stands.
    pub parent: Option<usize>,
    /// Branch order: 0 the leader.
    pub order: u8,
    /// True if it begins an axis.
    pub first: bool,
    /// Length \[m\].
    pub length: f64,
    /// Diameter at half its length \[m\].
    pub diameter: f64,
    /// Angle of the line from its base to its tip from the vertical \[rad\].
    pub angle: f64,
    /// Volume of its wood [m^3].
    pub volume: f64,
    /// Length of the piece plus that of the longest path from its tip \[m\].
    pub path_length: f64,
    /// Length of the piece plus that of all pieces above \[m\].
    pub subtree_length: f64,
    /// Volume of the piece plus that of all pieces above [m^3].
    pub subtree_volume: f64,
}

/// Survey of a tree: pieces of wood between forks, and twigs.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Survey {
    /// Pieces; parents before children.
    pub branches: Vec<Branch>,
    /// Number of twigs that stand on pieces or end them.
    pub twigs: usize,
    /// Volume of the twigs and all wood on them [m^3].
    pub twig_volume: f64,
}

/// Surveys a tree; where wood gets thinner than `least_diameter` \[m\] a twig begins.
pub fn survey(skeleton: &Skeleton, least_diameter: f64) -> Survey {
    let segments = &skeleton.segments;
    let children = skeleton.children();
    let mut out = Survey::default();
    // `None` for segments of twigs, else the index of the piece.
    let mut piece: Vec<Option<usize>> = vec![None; segments.len()];
    let mut members: Vec<Vec<usize>> = Vec::new();
    for (i, segment) in segments.iter().enumerate() {
        let volume = PI * segment.radius * segment.radius * segment.length;
        let Some(parent) = segment.parent else {
            piece[i] = Some(members.len());
            members.push(vec![i]);
            out.branches.push(begun(None, 0, true));
            continue;
        };
        let Some(parent_piece) = piece[parent] else {
            out.twig_volume += volume;
            continue;
        };
        let goes_on = segment.order == segments[parent].order;
        if 2.0 * segment.radius < least_diameter {
            out.twigs += 1;
            out.twig_volume += volume;
            continue;
        }
        let forks = children[parent].iter().any(|&child| {
            segments[child].order != segments[parent].order && 2.0 * segments[child].radius >= least_diameter
        });
        if goes_on && !forks {
            piece[i] = Some(parent_piece);
            members[parent_piece].push(i);
        } else {
            piece[i] = Some(members.len());
            members.push(vec![i]);
            out.branches.push(begun(Some(parent_piece), segment.order, !goes_on));
        }
    }
    for (branch, members) in out.branches.iter_mut().zip(&members) {
        measure(branch, members, skeleton);
    }
    for i in (0..out.branches.len()).rev() {
        let Branch { parent, path_length, subtree_length, subtree_volume, .. } = out.branches[i];
        if let Some(parent) = parent {
            let below = &mut out.branches[parent];
            below.path_length = below.path_length.max(below.length + path_length);
            below.subtree_length += subtree_length;
            below.subtree_volume += subtree_volume;
        }
    }
    out
}

fn begun(parent: Option<usize>, order: u8, first: bool) -> Branch {
    Branch {
        parent,
        order,
        first,
        length: 0.0,
        diameter: 0.0,
        angle: 0.0,
        volume: 0.0,
        path_length: 0.0,
        subtree_length: 0.0,
        subtree_volume: 0.0,
    }
}

/// Fills in a piece's own measures from its segments, base to tip.
fn measure(branch: &mut Branch, members: &[usize], skeleton: &Skeleton) {
    let own = || members.iter().map(|&i| &skeleton.segments[i]);
    branch.length = own().map(|s| s.length).sum();
    branch.volume = own().map(|s| PI * s.radius * s.radius * s.length).sum();
    let mut left = 0.5 * branch.length;
    for segment in own() {
        branch.diameter = 2.0 * segment.radius;
        left -= segment.length;
        if left <= 0.0 {
            break;
        }
    }
    if let (Some(base), Some(tip)) = (own().next(), own().next_back()) {
        let chord = tip.p_tip_world() - base.p_base_world;
        branch.angle = math::atan2(chord.xy().norm(), chord.z);
    }
    branch.path_length = branch.length;
    branch.subtree_length = branch.length;
    branch.subtree_volume = branch.volume;
}

impl Survey {
    /// Limbs: branches that stand on the leader.
    pub fn limbs(&self) -> impl Iterator<Item = &Branch> {
        self.branches.iter().filter(|b| b.first && b.parent.is_some_and(|p| self.branches[p].order == 0))
    }

    /// Length of all pieces \[m\].
    pub fn length(&self) -> f64 {
        self.branches.iter().map(|b| b.length).sum()
    }

    /// Volume of all pieces [m^3].
    pub fn volume(&self) -> f64 {
        self.branches.iter().map(|b| b.volume).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::turtle::Internode;
    use crate::{Segment, assemble};
    use orchard_geometry::Vec3;

    /// (parent, heading, length, radius, order)
    type Wood = (Option<usize>, [f64; 3], f64, f64, u8);

    fn skeleton(wood: &[Wood]) -> Skeleton {
        let internodes: Vec<Internode> = wood
            .iter()
            .map(|&(parent, heading, length, _, order)| {
                let heading = Vec3::from(heading).normalize();
                Internode { parent, heading, length, width: 1.0, order, unit: None }
            })
            .collect();
        let radii: Vec<f64> = wood.iter().map(|w| w.3).collect();
        let segments: Vec<Segment> = assemble::segments(&internodes, &radii);
        Skeleton { segments, fruit_sites: Vec::new(), leaves: Vec::new(), spurs: Vec::new() }
    }

    const UP: [f64; 3] = [0.0, 0.0, 1.0];
    const OUT: [f64; 3] = [1.0, 0.0, 0.0];

    /// A trunk of two segments, a limb of two with a twig between them, and the leader above the limb.
    #[test]
    fn pieces_of_a_small_tree() {
        let tree = skeleton(&[
            (None, UP, 0.4, 0.04, 0),
            (Some(0), UP, 0.4, 0.03, 0),
            (Some(1), OUT, 0.5, 0.010, 1),
            (Some(1), UP, 0.6, 0.020, 0),
            (Some(2), [1.0, 0.0, 1.0], 0.5, 0.006, 1),
            (Some(2), UP, 0.1, 0.002, 2),
            (Some(3), UP, 0.2, 0.003, 0),
        ]);
        let survey = survey(&tree, 0.01);
        let lengths: Vec<f64> = survey.branches.iter().map(|b| b.length).collect();
        assert_eq!(lengths, [0.8, 1.0, 0.6]);
        assert_eq!(survey.branches.iter().map(|b| b.parent).collect::<Vec<_>>(), [None, Some(0), Some(0)]);
        // Half of 0.8 m is the end of the first segment; half of 1.0 m likewise.
        let diameters: Vec<f64> = survey.branches.iter().map(|b| b.diameter).collect();
        assert_eq!(diameters, [0.08, 0.02, 0.04]);
        let trunk = &survey.branches[0];
        assert!((trunk.path_length - 1.8).abs() < 1e-12 && (trunk.subtree_length - 2.4).abs() < 1e-12);
        let volume = |w: &[(f64, f64)]| w.iter().map(|(l, r)| PI * r * r * l).sum::<f64>();
        let wood = volume(&[(0.4, 0.04), (0.4, 0.03), (0.5, 0.01), (0.6, 0.02), (0.5, 0.006)]);
        assert!((trunk.subtree_volume - wood).abs() < 1e-15);
        // The branch on the limb, and the end of the leader.
        assert_eq!(survey.twigs, 2);
        assert!((survey.twig_volume - volume(&[(0.1, 0.002), (0.2, 0.003)])).abs() < 1e-15);
        let limbs: Vec<&Branch> = survey.limbs().collect();
        assert_eq!(limbs.len(), 1);
        // Half level, half at 45 degrees: the chord rises at 22.5 degrees.
        assert!((limbs[0].angle - 67.5_f64.to_radians()).abs() < 1e-12);
    }

    /// Two limbs at one node make one fork.
    #[test]
    fn limbs_at_one_node_fork_the_leader_once() {
        let tree = skeleton(&[
            (None, UP, 1.0, 0.03, 0),
            (Some(0), OUT, 1.0, 0.01, 1),
            (Some(0), [-1.0, 0.0, 0.0], 1.0, 0.01, 1),
            (Some(0), UP, 1.0, 0.02, 0),
        ]);
        let survey = survey(&tree, 0.01);
        assert_eq!(survey.branches.len(), 4);
        assert_eq!(survey.limbs().count(), 2);
        assert_eq!(survey.branches.iter().filter(|b| b.first).count(), 3);
    }
}
