//! Sway of a limb: its lowest bending frequency, and the dampers that give it a damping ratio.
//!
//! A limb is an axis of wood with all that it bears: the trunk with the whole tree, or a branch from its union on.

use crate::{section, subtree};
use orchard_geometry::Vec3;
use orchard_multibody::SpatialInertia;
use orchard_spec::wood::ModalDampingSpec;
use orchard_treegen::Skeleton;

/// Angular frequency of a limb's sway about a clamped base [rad/s]: Rayleigh's quotient of its deflection u under an even sideways
/// pull a, in the softer of two planes through its base,
///
/// `omega^2 = sum m a.u / sum (m |u|^2 + w.I w)`,
///
/// with the joints' springs alone. It is exact for one link and 0.4 % above the first frequency of a uniform cantilever.
/// `inertia` and `stiffness` \[N m/rad\] are per segment; `root` is the limb's first segment.
pub fn limb_frequency(
    skeleton: &Skeleton,
    inertia: &[SpatialInertia],
    stiffness: &[f64],
    root: usize,
) -> f64 {
    let parents: Vec<Option<usize>> = skeleton.segments.iter().map(|s| s.parent).collect();
    let members = subtree::members(&parents, root);
    let r_world_root = skeleton.segments[root].r_world_segment;
    let squares = [Vec3::x(), Vec3::y()]
        .map(|across| squared_frequency(skeleton, inertia, stiffness, &members, &(r_world_root * across)));
    squares[0].min(squares[1]).sqrt()
}

fn squared_frequency(
    skeleton: &Skeleton,
    inertia: &[SpatialInertia],
    stiffness: &[f64],
    members: &[usize],
    pull: &Vec3,
) -> f64 {
    let segments = &skeleton.segments;
    let p_com = |i: usize| segments[i].p_base_world + segments[i].heading() * inertia[i].p_com.z;
    // Mass and first moment of what each joint bears.
    let mut borne = vec![(0.0, Vec3::zeros()); segments.len()];
    for &i in members.iter().rev() {
        let (mass, moment) = &mut borne[i];
        *mass += inertia[i].mass;
        *moment += p_com(i) * inertia[i].mass;
        let (mass, moment) = borne[i];
        if let Some(parent) = segments[i].parent.filter(|_| i != members[0]) {
            borne[parent].0 += mass;
            borne[parent].1 += moment;
        }
    }
    // Displacement of each base, and turn of each link.
    let mut moved = vec![(Vec3::zeros(), Vec3::zeros()); segments.len()];
    let (mut work, mut motion) = (0.0, 0.0);
    for &i in members {
        let segment = &segments[i];
        let (base, turn) = match segment.parent.filter(|_| i != members[0]) {
            Some(p) => {
                let (base, turn) = moved[p];
                (base + turn.cross(&(segment.p_base_world - segments[p].p_base_world)), turn)
            }
            None => (Vec3::zeros(), Vec3::zeros()),
        };
        let (mass, moment) = borne[i];
        let bending = (moment - segment.p_base_world * mass).cross(pull);
        let along = segment.heading();
        let turn = turn + (bending - along * bending.dot(&along)) / stiffness[i];
        moved[i] = (base, turn);
        let u = base + turn.cross(&(p_com(i) - segment.p_base_world));
        let spin = segment.r_world_segment.inverse() * turn;
        work += inertia[i].mass * pull.dot(&u);
        motion += inertia[i].mass * u.norm_squared() + spin.dot(&(inertia[i].i_com * spin));
    }
    work / motion
}

/// Time by which the damper of each segment's joint follows from its spring, `K_d = c K_p` with `c = 2 zeta / omega` of its limb \[s\].
pub(crate) fn damping_times(
    skeleton: &Skeleton,
    inertia: &[SpatialInertia],
    stiffness: &[f64],
    law: &ModalDampingSpec,
) -> Vec<f64> {
    let mut in_leaf = vec![false; skeleton.segments.len()];
    for leaf in &skeleton.leaves {
        in_leaf[leaf.segment] = true;
    }
    for i in (1..in_leaf.len()).rev() {
        if let Some(parent) = skeleton.segments[i].parent {
            in_leaf[parent] |= in_leaf[i];
        }
    }
    let mut times = Vec::with_capacity(in_leaf.len());
    for (i, segment) in skeleton.segments.iter().enumerate() {
        let same_limb = segment.parent.filter(|&p| skeleton.segments[p].order == segment.order);
        times.push(match same_limb {
            Some(parent) => times[parent],
            None => {
                let ratio = if in_leaf[i] { &law.ratio_in_leaf } else { &law.ratio };
                2.0 * ratio.si() / limb_frequency(skeleton, inertia, stiffness, i)
            }
        });
    }
    times
}

/// Inertias of the segments' links.
pub(crate) fn inertias(skeleton: &Skeleton, density: &[f64]) -> Vec<SpatialInertia> {
    let segments = skeleton.segments.iter().zip(density);
    segments.map(|(s, &density)| section::capsule_inertia(density, s.radius, s.length)).collect()
}
