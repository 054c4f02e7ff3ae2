//! Joins and cuts drawn internodes to the links that are simulated.
//!
//! Growth units are between a centimetre and a metre long: short branches become spurs on a link, long pieces are
//! cut, and short pieces in a row are joined, so that a link's length stays in its interval where the wood
//! allows it. Wood forks only at the ends of links: a fork moves outwards to the next end.

use std::collections::VecDeque;

use orchard_geometry::Vec3;

use crate::turtle::Internode;

/// A branch too short to be a link.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ShortBranch {
    /// Index of the link on which it stands.
    pub link: usize,
    /// Position on the link: 0 at its base, 1 at its tip.
    pub part: f64,
    /// Unit vector from its base to its tip, world.
    pub heading: Vec3,
    /// Length \[m\].
    pub length: f64,
    /// Index of its first internode.
    pub first: usize,
}

/// Place of a drawn internode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Place {
    /// On a link, between two parts of its length.
    Link { link: usize, from: f64, to: f64 },
    /// In a short branch, between two parts of its length.
    Short { branch: usize, from: f64, to: f64 },
}

impl Place {
    /// Index of the link.
    pub fn link(self, links: &Links) -> usize {
        match self {
            Self::Link { link, .. } => link,
            Self::Short { branch, .. } => links.short[branch].link,
        }
    }
}

/// The links of a tree.
#[derive(Debug, Clone, Default)]
pub(crate) struct Links {
    /// Parents before children.
    pub links: Vec<Internode>,
    /// Branches too short to be links.
    pub short: Vec<ShortBranch>,
    /// Drawn internodes, long ones cut.
    pub drawn: Vec<Internode>,
    /// Place of every drawn internode.
    pub places: Vec<Place>,
}

/// Joins and cuts drawn internodes to links of `least` to `most` \[m\].
pub(crate) fn link(internodes: &[Internode], least: f64, most: f64) -> Links {
    let drawn = cut(internodes, most);
    let branching = Branching::of(&drawn);
    let unplaced = Place::Link { link: 0, from: 0.0, to: 0.0 };
    let mut out = Links { places: vec![unplaced; drawn.len()], ..Links::default() };
    let mut queue = VecDeque::new();
    if !drawn.is_empty() {
        queue.push_back((0, None));
    }
    while let Some((first, parent)) = queue.pop_front() {
        Walk::new(&drawn, &branching, &mut out, &mut queue, least, most).axis(first, parent);
    }
    out.drawn = drawn;
    out
}

/// Most pieces of one internode, for any configured link length.
const MOST_PIECES: f64 = 1000.0;

/// Number of pieces that an internode longer than `most` is cut into.
fn piece_count(internode: &Internode, most: f64) -> f64 {
    (internode.length / most).ceil().clamp(1.0, MOST_PIECES)
}

/// Number of pieces of all internodes.
pub(crate) fn all_pieces(internodes: &[Internode], most: f64) -> f64 {
    internodes.iter().map(|internode| piece_count(internode, most)).sum()
}

/// Cuts internodes longer than `most` into equal pieces.
fn cut(internodes: &[Internode], most: f64) -> Vec<Internode> {
    let mut pieces: Vec<Internode> = Vec::with_capacity(internodes.len());
    let mut last_piece = Vec::with_capacity(internodes.len());
    for internode in internodes {
        let count = piece_count(internode, most);
        let mut parent = internode.parent.map(|parent| last_piece[parent]);
        for _ in 0..count as usize {
            pieces.push(Internode { parent, length: internode.length / count, ..internode.clone() });
            parent = Some(pieces.len() - 1);
        }
        last_piece.push(pieces.len() - 1);
    }
    pieces
}

/// Successor and branches of each internode.
struct Branching {
    /// Internode that continues the axis.
    next: Vec<Option<usize>>,
    /// First internodes of the branches at an internode's tip.
    laterals: Vec<Vec<usize>>,
}

impl Branching {
    fn of(drawn: &[Internode]) -> Self {
        let mut branching = Self { next: vec![None; drawn.len()], laterals: vec![Vec::new(); drawn.len()] };
        for (i, internode) in drawn.iter().enumerate() {
            let Some(parent) = internode.parent else { continue };
            if internode.order == drawn[parent].order && branching.next[parent].is_none() {
                branching.next[parent] = Some(i);
            } else {
                branching.laterals[parent].push(i);
            }
        }
        branching
    }

    fn axis(&self, first: usize) -> impl Iterator<Item = usize> {
        std::iter::successors(Some(first), |&i| self.next[i])
    }
}

/// Heading and length of a piece of wood from its base to its tip. A piece folded back on itself (by no config
/// of measured trees) goes straight up with its full length.
fn straight(chord: &Vec3, whole: f64) -> (Vec3, f64) {
    const FOLDED: f64 = 1e-3;
    chord.try_normalize(FOLDED * whole).map_or((Vec3::z(), whole), |heading| (heading, chord.norm()))
}

/// State of the walk along one axis.
struct Walk<'a> {
    drawn: &'a [Internode],
    branching: &'a Branching,
    out: &'a mut Links,
    queue: &'a mut VecDeque<(usize, Option<usize>)>,
    least: f64,
    most: f64,
    /// Internodes of the unfinished link, and the branches that move to its end.
    members: Vec<usize>,
    waiting: Vec<usize>,
    length: f64,
}

impl<'a> Walk<'a> {
    fn new(
        drawn: &'a [Internode],
        branching: &'a Branching,
        out: &'a mut Links,
        queue: &'a mut VecDeque<(usize, Option<usize>)>,
        least: f64,
        most: f64,
    ) -> Self {
        let (members, waiting) = (Vec::new(), Vec::new());
        Self { drawn, branching, out, queue, least, most, members, waiting, length: 0.0 }
    }

    /// True if a branch is too short for a link and bears none.
    fn is_short(&self, first: usize) -> bool {
        let length: f64 = self.branching.axis(first).map(|i| self.drawn[i].length).sum();
        length < self.least && self.branching.axis(first).all(|i| self.branching.laterals[i].is_empty())
    }

    fn axis(&mut self, first: usize, parent: Option<usize>) {
        let mut parent = parent;
        let members: Vec<usize> = self.branching.axis(first).collect();
        let mut closed_here = None;
        for (at, &i) in members.iter().enumerate() {
            let length = self.drawn[i].length;
            if self.length >= self.least && self.length + length > self.most {
                closed_here = Some(self.close(&mut parent));
            }
            self.members.push(i);
            self.length += length;
            let wood: Vec<usize> =
                self.branching.laterals[i].iter().copied().filter(|&b| !self.is_short(b)).collect();
            let forks = !wood.is_empty();
            self.waiting.extend(wood);
            let last = at + 1 == members.len();
            if !last && self.length >= self.least && (forks || self.length >= self.most) {
                closed_here = Some(self.close(&mut parent));
            }
        }
        match closed_here {
            // The rest is too short for a link of its own: it joins the last link.
            Some(link) if self.length < self.least => self.extend(link),
            _ => {
                self.close(&mut parent);
            }
        }
    }

    /// Ends the unfinished link.
    fn close(&mut self, parent: &mut Option<usize>) -> usize {
        let Some(&first) = self.members.first() else { return parent.unwrap_or(0) };
        let link = self.out.links.len();
        self.out.links.push(Internode { parent: *parent, ..self.drawn[first].clone() });
        let members = std::mem::take(&mut self.members);
        self.settle(link, &members);
        *parent = Some(link);
        link
    }

    /// Joins the rest of the axis to its last link.
    fn extend(&mut self, link: usize) {
        let held = |place: &Place| matches!(place, Place::Link { link: l, .. } if *l == link);
        // The link's members come before the rest, on the same axis.
        let mut members: Vec<usize> = Vec::new();
        let Some(&first_left) = self.members.first() else { return };
        let mut i = self.drawn[first_left].parent;
        while let Some(at) = i {
            if self.drawn[at].order != self.drawn[first_left].order || !held(&self.out.places[at]) {
                break;
            }
            members.push(at);
            i = self.drawn[at].parent;
        }
        members.reverse();
        members.append(&mut self.members);
        self.out.short.retain(|branch| branch.link != link);
        self.settle(link, &members);
    }

    /// Writes a link's length and heading, the places of its members and the short branches on it, and moves
    /// the waiting branches to its end.
    fn settle(&mut self, link: usize, members: &[usize]) {
        let whole: f64 = members.iter().map(|&i| self.drawn[i].length).sum();
        let chord: Vec3 = members.iter().map(|&i| self.drawn[i].heading * self.drawn[i].length).sum();
        (self.out.links[link].heading, self.out.links[link].length) = straight(&chord, whole);
        let mut from = 0.0;
        for &i in members {
            let to = (from + self.drawn[i].length / whole).min(1.0);
            self.out.places[i] = Place::Link { link, from, to };
            from = to;
            for &branch in &self.branching.laterals[i] {
                if self.is_short(branch) {
                    self.short(branch, link, to);
                }
            }
        }
        self.length = 0.0;
        let waiting = std::mem::take(&mut self.waiting);
        self.queue.extend(waiting.into_iter().map(|branch| (branch, Some(link))));
    }

    fn short(&mut self, first: usize, link: usize, part: f64) {
        let members: Vec<usize> = self.branching.axis(first).collect();
        let whole: f64 = members.iter().map(|&i| self.drawn[i].length).sum();
        let chord: Vec3 = members.iter().map(|&i| self.drawn[i].heading * self.drawn[i].length).sum();
        let (heading, length) = straight(&chord, whole);
        let branch = self.out.short.len();
        self.out.short.push(ShortBranch { link, part, heading, length, first });
        let mut from = 0.0;
        for i in members {
            let to = (from + self.drawn[i].length / whole).min(1.0);
            self.out.places[i] = Place::Short { branch, from, to };
            from = to;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// (parent, length, order), all upright but branches of order 1, which are level.
    fn tree(pieces: &[(Option<usize>, f64, u8)]) -> Vec<Internode> {
        let internode = |&(parent, length, order): &(Option<usize>, f64, u8)| {
            let heading = if order == 0 { Vec3::z() } else { Vec3::x() };
            Internode { parent, heading, length, width: 1.0, order, unit: None }
        };
        pieces.iter().map(internode).collect()
    }

    fn lengths(links: &Links) -> Vec<f64> {
        links.links.iter().map(|link| (link.length * 1e3).round()).collect()
    }

    #[test]
    fn long_pieces_are_cut_and_short_ones_joined() {
        let links = link(
            &tree(&[(None, 0.35, 0), (Some(0), 0.03, 0), (Some(1), 0.05, 0), (Some(2), 0.02, 0)]),
            0.06,
            0.12,
        );
        // 35 cm make three links, 3 + 5 + 2 cm the fourth.
        assert_eq!(lengths(&links), [117.0, 117.0, 117.0, 100.0]);
        assert_eq!(
            links.links.iter().map(|l| l.parent).collect::<Vec<_>>(),
            [None, Some(0), Some(1), Some(2)]
        );
        let whole: f64 = links.links.iter().map(|link| link.length).sum();
        assert!((whole - 0.45).abs() < 1e-12);
    }

    #[test]
    fn a_short_end_joins_the_link_before() {
        let links = link(&tree(&[(None, 0.1, 0), (Some(0), 0.11, 0), (Some(1), 0.02, 0)]), 0.06, 0.12);
        assert_eq!(lengths(&links), [100.0, 130.0]);
        assert_eq!(links.places[1], Place::Link { link: 1, from: 0.0, to: 0.11 / 0.13 });
        let Place::Link { link: 1, to, .. } = links.places[2] else { panic!("{:?}", links.places[2]) };
        assert!((to - 1.0).abs() < 1e-12);
    }

    /// A branch of 3 cm is a spur where it stands; one of 8 cm waits for the end of its link.
    #[test]
    fn branches_fork_at_the_ends_of_links_and_spurs_stand_between() {
        let links = link(
            &tree(&[
                (None, 0.02, 0),
                (Some(0), 0.08, 1),
                (Some(0), 0.03, 0),
                (Some(2), 0.03, 1),
                (Some(2), 0.05, 0),
                (Some(4), 0.07, 0),
            ]),
            0.06,
            0.12,
        );
        assert_eq!(lengths(&links), [100.0, 70.0, 80.0]);
        assert_eq!((links.links[2].parent, links.links[2].order), (Some(0), 1));
        assert_eq!(links.short.len(), 1);
        let spur = &links.short[0];
        assert_eq!((spur.link, spur.first), (0, 3));
        assert!((spur.part - 0.5).abs() < 1e-12 && (spur.length - 0.03).abs() < 1e-15);
        assert_eq!(links.places[3], Place::Short { branch: 0, from: 0.0, to: 1.0 });
    }

    #[test]
    fn nothing_gives_nothing() {
        assert!(link(&[], 0.06, 0.12).links.is_empty());
    }
}
