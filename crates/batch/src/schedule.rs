//! Order in which a tile visits the links of its worlds.
//!
//! Row k of a tile holds the k-th link of each world's own walk; shorter worlds are padded. A link writes the motion
//! that its children need to a slot; in the leaf-to-root pass the slot collects their inertia and wrench. Slots are
//! few, so that they stay in the nearest cache. Where all worlds of a row have the same parent row, whole vectors
//! move. Elsewhere a row has several sources, each for some lanes; the arithmetic of a world is the same.

/// The row has no slot: no link of it has children.
pub(crate) const NO_SLOT: usize = usize::MAX;

/// Slot of the world frame.
pub(crate) const WORLD_SLOT: usize = 0;

/// Order of the links of one world. It depends on that world alone.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Walk {
    /// Link of each row.
    pub links: Vec<usize>,
    /// Row of its parent.
    pub parent: Vec<Option<usize>>,
}

impl Walk {
    /// Two depth-first walks that take turns, in two sub-trees where possible: a row rarely waits for the
    /// numbers of the row before it, so that the processor overlaps the two.
    pub fn in_turns(parent: &[Option<usize>]) -> Self {
        let mut children = vec![Vec::new(); parent.len()];
        let mut open: [Vec<usize>; 2] = [Vec::new(), Vec::new()];
        for (link, parent) in parent.iter().enumerate().rev() {
            match parent {
                Some(parent) => children[*parent].push(link),
                None => open[0].push(link),
            }
        }
        let mut row_of = vec![0; parent.len()];
        let mut walk = Self { links: Vec::new(), parent: Vec::new() };
        for turn in (0..2).cycle() {
            let (own, other) = (turn, 1 - turn);
            if open[own].is_empty() && open[other].len() > 1 {
                // Roughly the largest sub-tree that waits.
                let link = open[other].remove(0);
                open[own].push(link);
            }
            let stack = if open[own].is_empty() { other } else { own };
            let Some(link) = open[stack].pop() else { break };
            row_of[link] = walk.links.len();
            walk.links.push(link);
            walk.parent.push(parent[link].map(|parent| row_of[parent]));
            open[stack].append(&mut children[link]);
        }
        walk
    }
}

/// Parents of some lanes of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Source {
    /// Slot of the parent.
    pub slot: usize,
    /// True if this row is the first to write to the slot in the leaf-to-root pass.
    pub is_first: bool,
}

/// The moves of a row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Row {
    /// Slot of the row's own state and load.
    pub slot: usize,
    /// First of its sources, and their number.
    pub sources: (usize, usize),
    /// First row of fruit, and the one after the last.
    pub fruit: (usize, usize),
}

/// The walks of a tile's worlds, side by side.
#[derive(Debug, Clone)]
pub(crate) struct Schedule {
    /// Rows.
    pub rows: Vec<Row>,
    /// Slots, that of the world included.
    pub slots: usize,
    /// Sources of all rows.
    pub sources: Vec<Source>,
    /// Lanes of each source.
    pub lanes_of_source: Vec<Vec<bool>>,
}

impl Schedule {
    /// Puts walks side by side in `lanes` lanes; lanes without a walk are padding. `fruit[row]` rows of fruit
    /// belong to a row of links.
    pub fn new(walks: &[&Walk], lanes: usize, fruit: &[usize]) -> Self {
        let longest = walks.iter().max_by_key(|walk| walk.links.len());
        let Some(longest) = longest else {
            return Self { rows: Vec::new(), slots: 1, sources: Vec::new(), lanes_of_source: Vec::new() };
        };
        // Padding has no inertia, so any parent will do: that of most other lanes.
        let parent = |row: usize, lane: usize| {
            let walk = walks.get(lane).unwrap_or(&walks[0]);
            *walk.parent.get(row).unwrap_or(&longest.parent[row])
        };
        let count = longest.links.len();
        let mut last_child = vec![None; count];
        for row in 0..count {
            for parent in (0..lanes).filter_map(|lane| parent(row, lane)) {
                last_child[parent] = Some(row);
            }
        }
        let mut schedule =
            Self { rows: Vec::new(), slots: 1, sources: Vec::new(), lanes_of_source: Vec::new() };
        let (mut free, mut next_fruit) = (Vec::new(), 0);
        for row in 0..count {
            // Its own slot before its parents' are given back: no row reads and writes the same one.
            let slot = match last_child[row] {
                None => NO_SLOT,
                Some(_) => free.pop().unwrap_or_else(|| {
                    schedule.slots += 1;
                    schedule.slots - 1
                }),
            };
            let first_source = schedule.sources.len();
            let mut parents: Vec<Option<usize>> = Vec::new();
            for lane in 0..lanes {
                let parent = parent(row, lane);
                let at = parents.iter().position(|p| *p == parent).unwrap_or_else(|| {
                    parents.push(parent);
                    let is_first = parent.is_none_or(|parent| last_child[parent] == Some(row));
                    let slot = parent.map_or(WORLD_SLOT, |parent| schedule.rows[parent].slot);
                    schedule.sources.push(Source { slot, is_first });
                    schedule.lanes_of_source.push(vec![false; lanes]);
                    parents.len() - 1
                });
                schedule.lanes_of_source[first_source + at][lane] = true;
            }
            for source in &schedule.sources[first_source..] {
                if source.slot != WORLD_SLOT && source.is_first {
                    free.push(source.slot);
                }
            }
            let fruit = (next_fruit, next_fruit + fruit.get(row).copied().unwrap_or(0));
            next_fruit = fruit.1;
            schedule.rows.push(Row { slot, sources: (first_source, parents.len()), fruit });
        }
        schedule
    }

    /// Number of rows of fruit.
    pub fn fruit_rows(&self) -> usize {
        self.rows.last().map_or(0, |row| row.fruit.1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_sub_trees_take_turns() {
        // 0 - 1 - 2
        //      \- 3 - 5
        //  \- 4 - 6
        let parent = [None, Some(0), Some(1), Some(1), Some(0), Some(3), Some(4)];
        let walk = Walk::in_turns(&parent);
        assert_eq!(walk.links, [0, 4, 1, 6, 2, 3, 5]);
        assert_eq!(walk.parent, [None, Some(0), Some(0), Some(1), Some(2), Some(2), Some(5)]);
    }

    #[test]
    fn slots_are_given_back_but_never_read_and_written_in_one_row() {
        let chain = Walk::in_turns(&[None, Some(0), Some(1), Some(2)]);
        let schedule = Schedule::new(&[&chain], 1, &[0, 1, 0, 2]);
        let slots: Vec<usize> = schedule.rows.iter().map(|row| row.slot).collect();
        assert_eq!((slots, schedule.slots), (vec![1, 2, 1, NO_SLOT], 3));
        assert_eq!(schedule.rows[3].fruit, (1, 3));
        assert!(schedule.sources.iter().all(|source| source.is_first));
    }

    #[test]
    fn equal_walks_share_their_sources_and_others_do_not() {
        let fork = Walk::in_turns(&[None, Some(0), Some(0)]);
        let chain = Walk::in_turns(&[None, Some(0), Some(1)]);
        let same = Schedule::new(&[&fork, &fork], 2, &[]);
        assert_eq!(same.sources.len(), 3);
        assert_eq!(
            same.sources[1..],
            [(1, false), (1, true)].map(|(slot, is_first)| Source { slot, is_first })
        );
        let mixed = Schedule::new(&[&fork, &chain], 2, &[]);
        assert_eq!(mixed.rows[2].sources, (2, 2));
        assert_eq!(mixed.lanes_of_source[2..], [[true, false], [false, true]]);
    }
}
