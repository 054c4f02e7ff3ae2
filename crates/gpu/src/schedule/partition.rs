//! Partition of a tree: the level and the warp of each link.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::{LEVELS, Tree, WARPS};

/// Cost of another level, in links of a walk: two barriers, and the first link's numbers, which are not read ahead.
const LEVEL_COST: usize = 1;

/// A link that is not assigned yet; the one with the largest sub-tree comes first.
type Waiting = (usize, Reverse<usize>);

/// A tree that is being cut into parts, from the root on. In a level each warp takes one link a turn: one whose parent belongs to a lower level, or to its own part of this
/// level. A level is as long as its number of turns.
#[derive(Clone)]
pub(super) struct Partition<'a> {
    tree: &'a Tree<'a>,
    /// Number of warps that work.
    team: usize,
    /// Level and warp of each assigned link.
    part: Vec<Option<(usize, usize)>>,
    /// Links whose parents belong to lower levels.
    free: BinaryHeap<Waiting>,
    /// Links that only one warp can take in this level, by warp.
    own: [BinaryHeap<Waiting>; WARPS],
    /// Number of links that are not assigned.
    left: usize,
    /// Length of the critical path so far: turns of all levels, and their costs.
    length: usize,
}

impl<'a> Partition<'a> {
    /// Parts of the cut with the shortest critical path that was found: every number of turns of the lower levels is tried, and the last level takes whole
    /// sub-trees.
    pub fn shortest(tree: &'a Tree<'a>, team: usize) -> Vec<(usize, usize)> {
        let mut best: Option<Self> = None;
        Self::start(tree, team).search(0, &mut best);
        let parts = best.map(|best| best.part).unwrap_or_default();
        parts.into_iter().map(Option::unwrap_or_default).collect()
    }

    fn start(tree: &'a Tree<'a>, team: usize) -> Self {
        let root = tree.parent.iter().position(Option::is_none).unwrap_or_default();
        Self {
            tree,
            team,
            part: vec![None; tree.parent.len()],
            free: BinaryHeap::from([(tree.size[root], Reverse(root))]),
            own: Default::default(),
            left: tree.parent.len(),
            length: 0,
        }
    }

    fn search(mut self, level: usize, best: &mut Option<Self>) {
        let warps = if level == 0 { 1 } else { self.team };
        loop {
            // No turn takes more than a link a warp.
            let at_least = self.length + self.left.div_ceil(self.team) + LEVEL_COST;
            if best.as_ref().is_some_and(|best| at_least >= best.length) {
                return;
            }
            if level + 1 == LEVELS {
                let length = self.length + LEVEL_COST + self.last_level();
                if best.as_ref().is_none_or(|best| length < best.length) {
                    let mut cut = self.clone();
                    cut.end_level();
                    cut.take_all();
                    *best = Some(cut);
                }
            } else if level > 0 || self.left < self.part.len() {
                let mut next = self.clone();
                next.end_level();
                next.search(level + 1, best);
            }
            if self.left == 0 {
                return;
            }
            (0..warps).for_each(|warp| self.take(level, warp));
            self.length += 1;
        }
    }

    /// Turn of a warp.
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
        self.length += LEVEL_COST;
    }

    /// Length of the last level if this one ended now, as [`Self::take_all`] assigns it.
    fn last_level(&self) -> usize {
        let waiting = self.own.iter().chain([&self.free]).flatten();
        let mut sizes: Vec<usize> = waiting.map(|(size, _)| *size).collect();
        sizes.sort_unstable_by_key(|size| Reverse(*size));
        let mut work = [0; WARPS];
        for size in sizes {
            if let Some(least) = work[..self.team].iter_mut().min() {
                *least += size;
            }
        }
        work.into_iter().max().unwrap_or_default()
    }

    /// Assigns the last level: the largest sub-tree first, each to the warp with the fewest links.
    fn take_all(&mut self) {
        let mut work = [0; WARPS];
        while let Some((size, Reverse(root))) = self.free.pop() {
            let warp = (0..self.team).min_by_key(|&warp| work[warp]).unwrap_or_default();
            work[warp] += size;
            let mut open = vec![root];
            while let Some(link) = open.pop() {
                self.part[link] = Some((LEVELS, warp));
                open.extend(&self.tree.children[link]);
            }
        }
        self.left = 0;
        self.length += work.into_iter().max().unwrap_or_default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The length that a cut is chosen by is that of its parts.
    #[test]
    fn the_last_level_is_as_long_as_foreseen() {
        let mut parent = vec![None];
        parent.extend((1..150_usize).map(|k| Some(k * 7 % k)));
        parent.extend((150..300_usize).map(|k| Some(k / 3)));
        let tree = Tree::new(&parent);
        for team in 1..=WARPS {
            let mut cut = Partition::start(&tree, team);
            for level in 0..2 {
                let warps = if level == 0 { 1 } else { team };
                (0..3).for_each(|_| (0..warps).for_each(|warp| cut.take(level, warp)));
                let foreseen = cut.length + LEVEL_COST + cut.last_level();
                let mut whole = cut.clone();
                whole.end_level();
                whole.take_all();
                assert_eq!(whole.length, foreseen, "team of {team}, level {level}");
                assert!(whole.part.iter().all(Option::is_some));
                cut.end_level();
            }
        }
    }
}
