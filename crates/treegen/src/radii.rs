//! Radii of a tree of annual shoots: a leader that tapers, and axes with bases of their own, each with pipes for the wood on it.

use orchard_geometry::math;
use orchard_spec::Stream;
use orchard_spec::tree::TreeSpec;
use orchard_spec::tree::annual_shoots::{Allometry, AnnualShootsSpec, Thickness};

use crate::TreegenError;
use crate::pipe;
use crate::turtle::Internode;

/// Length of an axis whose base has the diameter `base_diameter` of the config \[m\].
const REFERENCE_LENGTH: f64 = 0.4;

/// Checks that trunk and branches have a thickness.
pub(crate) fn check(grammar: &AnnualShootsSpec) -> Result<(), TreegenError> {
    let of_axes = |table: &'static str, law: &Thickness| {
        [
            (table, "base_diameter", law.base_diameter.si()),
            (table, "length_exponent", law.length_exponent.si()),
            (table, "base_factor", law.base_factor.ends_si().0),
            (table, "base_share", law.base_share.si()),
        ]
    };
    let Allometry { limb, lateral, .. } = &grammar.allometry;
    let axes = [of_axes("allometry.limb.", limb), of_axes("allometry.lateral.", lateral)];
    let trunk = ("", "trunk_diameter", grammar.trunk_diameter.mean_si());
    match axes.into_iter().flatten().chain([trunk]).find(|(_, _, value)| *value <= 0.0) {
        Some((table, field, value)) => Err(TreegenError::NotPositive { table, field, value }),
        None => Ok(()),
    }
}

/// Radius of every link \[m\].
pub(crate) fn radii(
    tree: &TreeSpec,
    grammar: &AnnualShootsSpec,
    links: &[Internode],
    structural: &[bool],
    trunk_radius: f64,
    stream: &mut Stream,
) -> Vec<f64> {
    let allometry = &grammar.allometry;
    let shed = shed_pipes(grammar, links, structural, stream);
    let (tip_radius, exponent) = (tree.tip_radius.si(), tree.pipe_exponent.si());
    let size = 2.0 * trunk_radius / grammar.trunk_diameter.mean_si();
    let mut radii = leader_radii(allometry, links, structural, trunk_radius, tip_radius);
    for axis in axes(links, allometry.own_bases.get()) {
        // Parents stand before children, and the links of an axis in the order of the tree's.
        let first = axis[0];
        let index = |link: usize| axis.binary_search(&link).ok();
        let parents: Vec<Option<usize>> =
            axis.iter().map(|&link| links[link].parent.and_then(index)).collect();
        let own = axis.iter().filter(|&&link| links[link].order == links[first].order);
        let length: f64 = own.map(|&link| links[link].length).sum();
        let law = if structural[first] { &allometry.limb } else { &allometry.lateral };
        let most = law.base_share.si() * links[first].parent.map_or(trunk_radius, |wood| radii[wood]);
        let base_radius = base_radius(law, length, size, stream).min(most);
        let tip_radius = tip_radius.min(thickest_tip(grammar, &parents, base_radius, exponent));
        let pipes = pipe::radii(&parents, |local, _| shed[axis[local]], tip_radius, base_radius, exponent);
        // Of an axis without pipes of shed wood the tips alone make up the pipes: they are scaled to the base.
        for (&link, radius) in axis.iter().zip(&pipes) {
            radii[link] = radius * (base_radius / pipes[0]);
        }
    }
    radii
}

/// Radius at the base of an axis by its length \[m\] and the trunk's diameter over the mean one.
fn base_radius(law: &Thickness, length: f64, size: f64, stream: &mut Stream) -> f64 {
    let slender = math::pow(length / REFERENCE_LENGTH, 1.0 / law.length_exponent.si());
    let factor = stream.cut_normal(&law.base_factor);
    0.5 * law.base_diameter.si() * slender * factor * math::pow(size, law.trunk_exponent.si())
}

/// Radii of the leader's links, 0 for all other links: the leader loses thickness at its limbs, by their lengths, and along its own length.
fn leader_radii(
    allometry: &Allometry,
    links: &[Internode],
    structural: &[bool],
    trunk_radius: f64,
    tip_radius: f64,
) -> Vec<f64> {
    let whole: f64 = links.iter().filter(|link| link.order == 0).map(|link| link.length).sum();
    let limbs = limb_lengths(links, structural);
    let all_limbs: f64 = limbs.iter().sum();
    let of_limbs = if all_limbs > 0.0 { allometry.leader_pipes.si() } else { 0.0 };
    let (mut left, mut limbs_left) = (whole, all_limbs);
    let radius = |(link, limbs): (&Internode, &f64)| {
        if link.order != 0 {
            return 0.0;
        }
        let length_share = (left / whole).max(0.0);
        let limb_share = if of_limbs > 0.0 { (limbs_left / all_limbs).max(0.0) } else { 0.0 };
        left -= link.length;
        limbs_left -= limbs;
        let share = of_limbs * limb_share + (1.0 - of_limbs) * length_share;
        tip_radius + (trunk_radius - tip_radius).max(0.0) * math::pow(share, allometry.leader_taper.si())
    };
    links.iter().zip(&limbs).map(radius).collect()
}

/// Length of the limbs at the tip of each link of the leader \[m\].
fn limb_lengths(links: &[Internode], structural: &[bool]) -> Vec<f64> {
    let mut lengths = vec![0.0; links.len()];
    // Link of the leader at which the limb of each link stands.
    let mut stands_at: Vec<usize> = Vec::with_capacity(links.len());
    for (i, link) in links.iter().enumerate() {
        let at = match link.parent {
            Some(parent) if link.order == 1 && links[parent].order == 1 => stands_at[parent],
            parent => parent.unwrap_or(i),
        };
        stands_at.push(at);
        if link.order == 1 && structural[i] {
            lengths[at] += link.length;
        }
    }
    lengths
}

/// Links of each axis of the first `own_bases` branch orders, with the links of higher orders on it. An axis stands after the one that
/// bears it.
fn axes(links: &[Internode], own_bases: u32) -> Vec<Vec<usize>> {
    let mut axes: Vec<Vec<usize>> = Vec::new();
    let mut of_link: Vec<Option<usize>> = Vec::with_capacity(links.len());
    for (i, link) in links.iter().enumerate() {
        let axis = match link.parent {
            _ if link.order == 0 => None,
            Some(parent) if links[parent].order == link.order => of_link[parent],
            Some(parent) if u32::from(link.order) > own_bases.max(1) => of_link[parent],
            _ => {
                axes.push(Vec::new());
                Some(axes.len() - 1)
            }
        };
        if let Some(axis) = axis {
            axes[axis].push(i);
        }
        of_link.push(axis);
    }
    axes
}

/// Largest radius of the tips \[m\]: together they then make up `tip_share` of the pipes at the base.
fn thickest_tip(
    grammar: &AnnualShootsSpec,
    parents: &[Option<usize>],
    base_radius: f64,
    exponent: f64,
) -> f64 {
    let mut has_children = vec![false; parents.len()];
    for parent in parents.iter().flatten() {
        has_children[*parent] = true;
    }
    let tips = has_children.iter().filter(|has_children| !**has_children).count().max(1) as f64;
    base_radius * math::pow(grammar.tip_share.si() / tips, 1.0 / exponent)
}

/// Weight of every link in the pipes of branches that were shed or cut: scars on leader and limbs in proportion
/// to their length, and the cut tips.
fn shed_pipes(
    grammar: &AnnualShootsSpec,
    links: &[Internode],
    structural: &[bool],
    stream: &mut Stream,
) -> Vec<f64> {
    let mut goes_on = vec![false; links.len()];
    for link in links {
        if let Some(parent) = link.parent.filter(|&parent| links[parent].order == link.order) {
            goes_on[parent] = true;
        }
    }
    let mut shed = |i: usize| {
        if !structural[i] {
            return 0.0;
        }
        let tip = if goes_on[i] { 0.0 } else { stream.cut_normal(&grammar.cut_tip) };
        tip + grammar.scars.si() * links[i].length
    };
    (0..links.len()).map(&mut shed).collect()
}
