//! Shared paths: the part of a tree between its root and the link where the paths of its contacts part.
//!
//! All impulses beyond it reach the upper end of a shared path as one wrench P, and its joints answer with
//! `P^T Lambda P`, Lambda the inverse inertia of that link (the operational-space inertia of Khatib 1987). Six
//! coordinates `C^T P`, `Lambda = C C^T`, therefore stand for all those of the shared path.

use super::block::{Block, Load};
use crate::aba::factors::Factor;
use crate::model::Model;

/// Least number of loads for which the reduction pays: it costs as much as following two of them.
const LEAST_LOADS: usize = 3;
/// Coordinates of a reduced path.
pub(super) const WIDTH: usize = 6;

/// Link where the paths of one tree part.
#[derive(Debug, Clone, Copy)]
struct Fork {
    link: usize,
    loads: usize,
    /// True if a load acts on the root's own joint, so that no link is below all of them.
    is_at_root: bool,
}

/// Finds the links up to which the paths of their tree are followed once for all blocks.
#[derive(Debug, Clone, Default)]
pub(super) struct SharedPathFinder {
    forks: Vec<Fork>,
}

impl SharedPathFinder {
    /// Returns the upper ends of the shared paths worth reducing, at most one a tree.
    pub fn find(&mut self, model: &Model, factor: &Factor, blocks: &[Block]) -> impl Iterator<Item = usize> {
        self.forks.clear();
        for load in blocks.iter().flat_map(|block| &block.loads) {
            match *load {
                Load::Body { body, .. } => self.add(model, body, false),
                Load::Dof { body, .. } => self.add(model, body, true),
                Load::Point { point, .. } if factor.points[point].share != 0.0 => {
                    if let Some(tether) = &model.points[point].tether {
                        self.add(model, tether.body.index(), false);
                    }
                }
                Load::Point { .. } | Load::None => {}
            }
        }
        let pays = |fork: &&Fork| {
            fork.loads >= LEAST_LOADS && !fork.is_at_root && coordinates(model, fork.link) > WIDTH
        };
        self.forks.iter().filter(pays).map(|fork| fork.link)
    }

    /// Takes one more load into account: on a link, or on its joint.
    fn add(&mut self, model: &Model, link: usize, on_joint: bool) {
        let common = |fork: &Fork| common_ancestor(model, fork.link, link);
        let found = self.forks.iter_mut().find_map(|fork| common(fork).map(|common| (fork, common)));
        let (fork, common) = match found {
            Some(found) => found,
            None => {
                self.forks.push(Fork { link, loads: 0, is_at_root: false });
                let last = self.forks.len() - 1;
                (&mut self.forks[last], link)
            }
        };
        fork.loads += 1;
        fork.link = common;
        if on_joint && common == link {
            match parent(model, link) {
                Some(parent) => fork.link = parent,
                None => fork.is_at_root = true,
            }
        }
    }
}

fn parent(model: &Model, link: usize) -> Option<usize> {
    model.bodies[link].parent.map(|parent| parent.index())
}

/// Returns the last link that the paths of two links to the root share. Parents have smaller indices.
fn common_ancestor(model: &Model, mut a: usize, mut b: usize) -> Option<usize> {
    while a != b {
        (a, b) = (parent(model, a.max(b))?, a.min(b));
    }
    Some(a)
}

/// Degrees of freedom between the world and a link.
fn coordinates(model: &Model, link: usize) -> usize {
    std::iter::successors(Some(link), |&link| parent(model, link))
        .map(|link| model.bodies[link].joint.nv())
        .sum()
}
