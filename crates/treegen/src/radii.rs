//! Radii of a tree of annual shoots: by the pipes of the whole tree, or of each branch on the leader by itself, under a leader that tapers.

use orchard_geometry::math;
use orchard_spec::Stream;
use orchard_spec::tree::TreeSpec;
use orchard_spec::tree::annual_shoots::{Allometry, AnnualShootsSpec};

use crate::TreegenError;
use crate::pipe;
use crate::turtle::Internode;

/// Length of a branch whose base has the diameter `base_diameter` of the config \[m\].
const REFERENCE_LENGTH: f64 = 0.4;

/// Checks that every branch has a thickness.
pub(crate) fn check(allometry: &Allometry) -> Result<(), TreegenError> {
    let figures = [
        ("base_diameter", allometry.base_diameter.si()),
        ("length_exponent", allometry.length_exponent.si()),
        ("base_factor", allometry.base_factor.ends_si().0),
        ("base_share", allometry.base_share.si()),
    ];
    match figures.into_iter().find(|(_, value)| *value <= 0.0) {
        Some((field, value)) => Err(TreegenError::NotPositive { field, value }),
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
    let parents: Vec<Option<usize>> = links.iter().map(|link| link.parent).collect();
    let shed = shed_pipes(grammar, links, structural, stream);
    let (tip_radius, exponent) = (tree.tip_radius.si(), tree.pipe_exponent.si());
    let piped = |parents: &[Option<usize>], shed: &dyn Fn(usize) -> f64, base_radius: f64| {
        let tip_radius = tip_radius.min(thickest_tip(grammar, parents, base_radius, exponent));
        pipe::radii(parents, |link, _| shed(link), tip_radius, base_radius, exponent)
    };
    let Some(allometry) = &grammar.allometry else {
        return piped(&parents, &|link| shed[link], trunk_radius);
    };
    let mut radii = leader_radii(allometry, links, trunk_radius, tip_radius);
    for branch in branches(links) {
        // Parents stand before children, and the links of a branch in the order of the tree's.
        let index = |link: usize| branch.binary_search(&link).ok();
        let parents: Vec<Option<usize>> =
            branch.iter().map(|&link| links[link].parent.and_then(index)).collect();
        let axis = branch.iter().filter(|&&link| links[link].order == 1);
        let length: f64 = axis.map(|&link| links[link].length).sum();
        let most =
            allometry.base_share.si() * links[branch[0]].parent.map_or(trunk_radius, |leader| radii[leader]);
        let slender = math::pow(length / REFERENCE_LENGTH, 1.0 / allometry.length_exponent.si());
        let factor = stream.cut_normal(&allometry.base_factor);
        let base_radius = (0.5 * allometry.base_diameter.si() * slender * factor).min(most);
        let pipes = piped(&parents, &|local| shed[branch[local]], base_radius);
        // Of a branch without pipes of shed wood the tips alone make up the pipes: they are scaled to the base.
        for (&link, radius) in branch.iter().zip(&pipes) {
            radii[link] = radius * (base_radius / pipes[0]);
        }
    }
    radii
}

/// Radii of the leader's links, by the length that is left from their bases up; 0 for all other links.
fn leader_radii(allometry: &Allometry, links: &[Internode], trunk_radius: f64, tip_radius: f64) -> Vec<f64> {
    let leader = || links.iter().filter(|link| link.order == 0);
    let whole: f64 = leader().map(|link| link.length).sum();
    let mut left = whole;
    let radius = |link: &Internode| {
        if link.order != 0 {
            return 0.0;
        }
        let share = (left / whole).max(0.0);
        left -= link.length;
        tip_radius + (trunk_radius - tip_radius).max(0.0) * math::pow(share, allometry.leader_taper.si())
    };
    links.iter().map(radius).collect()
}

/// Links of each branch on the leader, with all that stands on it.
fn branches(links: &[Internode]) -> Vec<Vec<usize>> {
    let mut branches: Vec<Vec<usize>> = Vec::new();
    let mut of_link: Vec<Option<usize>> = Vec::with_capacity(links.len());
    for (i, link) in links.iter().enumerate() {
        let branch = match link.parent {
            _ if link.order == 0 => None,
            Some(parent) if links[parent].order > 0 => of_link[parent],
            _ => {
                branches.push(Vec::new());
                Some(branches.len() - 1)
            }
        };
        if let Some(branch) = branch {
            branches[branch].push(i);
        }
        of_link.push(branch);
    }
    branches
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
