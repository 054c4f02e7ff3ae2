//! Which level and which warp each link of a tree goes to.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::{LEVELS, Tree, WARPS};

/// What a level more costs, in links of a walk: two barriers, and the first link's numbers, which nobody has read ahead.
const LEVEL_COST: usize = 1;

/// A link that waits, the one with the largest sub-tree first.
type Waiting = (usize, Reverse<usize>);

/// A tree that is being shared out, from the root on. In a level each warp takes a link a turn: one whose parent belongs to a lower level, or to its own part of this
/// one. The links of a level are its number of turns long.
#[derive(Clone)]
pub(super) struct Shares<'a> {
    tree: &'a Tree<'a>,
    /// Level and warp of each link that has been taken.
    part: Vec<Option<(usize, usize)>>,
    /// Links whose parents belong to lower levels.
    free: BinaryHeap<Waiting>,
    /// Links that only a warp itself can take in this level.
    own: [BinaryHeap<Waiting>; WARPS],
    /// Links that nobody has taken.
    left: usize,
    /// Turns of all levels so far, and what the levels cost.
    way: usize,
}

impl<'a> Shares<'a> {
    /// The parts of the cut with the shortest way through that was found: every number of turns of the lower levels is tried, and the last level takes whole
    /// sub-trees.
    pub fn shortest(tree: &'a Tree<'a>) -> Vec<(usize, usize)> {
        let root = tree.parent.iter().position(Option::is_none).unwrap_or_default();
        let start = Self {
            tree,
            part: vec![None; tree.parent.len()],
            free: BinaryHeap::from([(tree.size[root], Reverse(root))]),
            own: Default::default(),
            left: tree.parent.len(),
            way: 0,
        };
        let mut best: Option<Self> = None;
        start.search(0, &mut best);
        let parts = best.map(|best| best.part).unwrap_or_default();
        parts.into_iter().map(Option::unwrap_or_default).collect()
    }

    fn search(mut self, level: usize, best: &mut Option<Self>) {
        if level == LEVELS {
            self.take_all();
            if best.as_ref().is_none_or(|best| self.way < best.way) {
                *best = Some(self);
            }
            return;
        }
        let warps = if level == 0 { 1 } else { WARPS };
        loop {
            // No turn takes more than a link a warp.
            let at_least = self.way + self.left.div_ceil(WARPS) + LEVEL_COST;
            if best.as_ref().is_some_and(|best| at_least >= best.way) {
                return;
            }
            if level > 0 || self.left < self.part.len() {
                let mut next = self.clone();
                next.end_level();
                next.search(level + 1, best);
            }
            if self.left == 0 {
                return;
            }
            (0..warps).for_each(|warp| self.take(level, warp));
            self.way += 1;
        }
    }

    /// A warp's turn.
    fn take(&mut self, level: usize, warp: usize) {
        let own = &mut self.own[warp];
        let next = if own.peek() >= self.free.peek() { own.pop() } else { self.free.pop() };
        if let Some((_, Reverse(link))) = next {
            self.part[link] = Some((level, warp));
            self.left -= 1;
            own.extend(self.tree.children[link].iter().map(|&child| (self.tree.size[child], Reverse(child))));
        }
    }

    fn end_level(&mut self) {
        self.own.iter_mut().for_each(|own| self.free.append(own));
        self.way += LEVEL_COST;
    }

    /// The last level: the largest sub-tree first, each to the warp with least to do.
    fn take_all(&mut self) {
        let mut work = [0; WARPS];
        while let Some((size, Reverse(root))) = self.free.pop() {
            let warp = (0..WARPS).min_by_key(|&warp| work[warp]).unwrap_or_default();
            work[warp] += size;
            let mut open = vec![root];
            while let Some(link) = open.pop() {
                self.part[link] = Some((LEVELS, warp));
                open.extend(&self.tree.children[link]);
            }
        }
        self.left = 0;
        self.way += work.into_iter().max().unwrap_or_default();
    }
}
