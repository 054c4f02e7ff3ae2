//! Schedules: the warp and the row of each link of a world, and the reads and writes there besides the arithmetic.
//!
//! A tree is cut into levels. The lowest is the trunk, which the first warp does alone; the branches of every other level are distributed over the warps of
//! a workgroup. Each part is a depth-first walk. In the outward pass a link's first child follows in the next row and finds its parent's numbers in registers; other children read them from a
//! slot. The inward pass is the reverse. A schedule depends only on its own tree, so that a world has the same bits beside any other worlds.

mod partition;

use std::ops::Range;

use partition::Partition;

use crate::layout::{first, second, third};

/// Largest number of warps of a workgroup. How many work follows from the laws of a batch alone (`Laws::team`), since it sets the order of sums.
pub const WARPS: usize = 6;
/// Number of levels above the trunk.
pub(crate) const LEVELS: usize = 3;
/// Number of parts: the trunk, then one for each warp of the first level, and so on.
pub(crate) const PARTS: usize = 1 + LEVELS * WARPS;

/// Part of a warp in a level.
fn part_of(level: usize, warp: usize) -> usize {
    if level == 0 { 0 } else { 1 + (level - 1) * WARPS + warp }
}

/// Error: a tree has no schedule.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ScheduleError {
    /// A number exceeds the bits of its field in an operation.
    #[error("a tree needs {needed} {what}; {most} are possible")]
    TooLarge {
        /// Kind of number.
        what: &'static str,
        /// Number needed.
        needed: usize,
        /// Largest number possible.
        most: usize,
    },
    /// A tree has another number of roots than one.
    #[error("a tree has {0} roots; one is possible")]
    Roots(usize),
}

/// A link in a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Visit {
    /// Link.
    pub link: usize,
    /// First three words of its operation; places of leaves and fruit are counted by world.
    pub words: [u32; 3],
}

/// Largest number of rows of fruit that an operation can name.
pub(crate) const MOST_FRUIT_ROWS: usize = (1 << 12) - 1;

impl Visit {
    /// Number of loads that it takes: one from a slot of its own part, and those of other parts.
    pub fn loads(&self) -> usize {
        let word = self.words[1] as usize;
        (word >> second::LOADS & 0x3f) + usize::from(word & second::TAKES != 0)
    }

    /// Range of its fruit among those of the schedule.
    pub fn fruit(&self) -> Range<usize> {
        let field = |shift: usize, bits: u32| (self.words[2] >> shift) as usize & ((1 << bits) - 1);
        let first = field(third::FIRST_FRUIT, 12);
        first..first + field(third::FRUIT, 6)
    }
}

/// Schedule of a tree.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Schedule {
    /// Visits of links, by part.
    pub parts: [Vec<Visit>; PARTS],
    /// Largest number of slots of a part.
    pub slots: usize,
    /// Number of forks with children in other parts.
    pub forks: usize,
    /// Number of loads that go to another part.
    pub loads: usize,
    /// Number of links without a child in the next row.
    pub leaves: usize,
    /// Fruit in the order of their rows.
    pub fruit: Vec<usize>,
}

/// Links of each part of a tree, in the order of their walks.
pub(crate) type Parts = [Vec<usize>; PARTS];

/// Cuts a tree into parts for a team of at most [`WARPS`] warps, which takes most of the time of scheduling.
///
/// # Errors
/// The tree has another number of roots than one.
pub(crate) fn parts(parent: &[Option<usize>], team: usize) -> Result<Parts, ScheduleError> {
    let roots = parent.iter().filter(|parent| parent.is_none()).count();
    if roots == 1 { Ok(Tree::new(parent).partitioned(team)) } else { Err(ScheduleError::Roots(roots)) }
}

impl Schedule {
    /// Schedules a tree that has been cut into parts; `fruit_of[link]` are the fruit on a link.
    ///
    /// # Errors
    /// The tree is too large for an operation's fields.
    pub fn new(
        parent: &[Option<usize>],
        parts: &Parts,
        fruit_of: &[Vec<usize>],
    ) -> Result<Self, ScheduleError> {
        let tree = Tree::new(parent);
        let mut place = vec![(0, 0); parent.len()];
        for (part, links) in parts.iter().enumerate() {
            for (row, &link) in links.iter().enumerate() {
                place[link] = (part, row);
            }
        }
        let mut schedule = Self::default();
        // By link: its fork for other parts, the first load from them, their number, and the next free one.
        let mut cross = vec![None; parent.len()];
        for &link in parts.iter().flatten() {
            let away = tree.children[link].iter().filter(|&&child| place[child].0 != place[link].0).count();
            if away > 0 {
                cross[link] = Some((schedule.forks, schedule.loads, away, schedule.loads));
                schedule.forks += 1;
                schedule.loads += away;
            }
        }
        for (part, links) in parts.iter().enumerate() {
            let slots = Slots::new(&tree, links, &place);
            schedule.slots = schedule.slots.max(slots.most);
            for (row, &link) in links.iter().enumerate() {
                let visit = schedule.visit(&tree, &place, (part, row), link, &slots, &mut cross, fruit_of);
                schedule.parts[part].push(visit);
            }
        }
        schedule.check(fruit_of)?;
        Ok(schedule)
    }

    #[expect(clippy::too_many_arguments, reason = "the tables of one walk, used only here")]
    fn visit(
        &mut self,
        tree: &Tree<'_>,
        place: &[(usize, usize)],
        (part, row): (usize, usize),
        link: usize,
        slots: &Slots,
        cross: &mut [Option<(usize, usize, usize, usize)>],
        fruit_of: &[Vec<usize>],
    ) -> Visit {
        let (mut a, mut b) = (first::ACTIVE, 0);
        match tree.parent[link] {
            None => a |= first::ROOT,
            Some(up) if place[up].0 != part => {
                if let Some((fork, _, _, next)) = &mut cross[up] {
                    a |= first::FROM_CROSS | *fork << first::PARENT;
                    b |= second::GIVES_CROSS | *next << second::OWN_LOAD;
                    *next += 1;
                }
            }
            Some(up) if place[up].1 + 1 != row => {
                let slot = slots.of_row[place[up].1].unwrap_or_default();
                a |= first::FROM_SLOT | slot << first::PARENT;
                // In the inward pass the last child comes first.
                b |= if slots.last_child[place[up].1] == Some(row) {
                    second::GIVES_FIRST
                } else {
                    second::GIVES
                };
            }
            Some(_) => {}
        }
        if let Some(slot) = slots.of_row[row] {
            a |= first::TO_SLOT | slot << first::SLOT;
            b |= second::TAKES;
        }
        if let Some((fork, first_load, count, _)) = cross[link] {
            a |= first::TO_CROSS | fork << first::FORK;
            b |= count << second::LOADS | first_load << second::FIRST_LOAD;
        }
        let mut c = self.fruit.len() << third::FIRST_FRUIT | fruit_of[link].len() << third::FRUIT;
        self.fruit.extend(&fruit_of[link]);
        c |= self.leaves << third::LEAF;
        if slots.carries[row] {
            b |= second::CARRIES;
        } else {
            self.leaves += 1;
        }
        Visit { link, words: [a as u32, b as u32, c as u32] }
    }

    /// Number of fruit of each visited link.
    pub fn fruit_by_visit(&self) -> Vec<usize> {
        self.parts.iter().flatten().map(|visit| visit.fruit().len()).collect()
    }

    /// Length of the longest part of each level, in links, from the trunk on.
    pub fn levels(&self) -> [usize; LEVELS + 1] {
        let mut levels = [self.parts[0].len(); LEVELS + 1];
        for (level, warps) in levels[1..].iter_mut().zip(self.parts[1..].chunks(WARPS)) {
            *level = warps.iter().map(Vec::len).max().unwrap_or_default();
        }
        levels
    }

    fn check(&self, fruit_of: &[Vec<usize>]) -> Result<(), ScheduleError> {
        let most_fruit = fruit_of.iter().map(Vec::len).max().unwrap_or(0);
        let rows = self.parts.iter().map(Vec::len).sum();
        for (what, needed, bits) in [
            ("slots", self.slots, 8),
            ("forks", self.forks, 8),
            ("loads", self.loads, 10),
            ("loads of one link", self.loads.min(64), 6),
            ("leaves", self.leaves, 10),
            ("fruit", self.fruit.len(), 12),
            ("fruit on one link", most_fruit, 6),
            ("links", rows, 15),
        ] {
            let most = (1 << bits) - usize::from(bits != 6);
            if needed > most {
                return Err(ScheduleError::TooLarge { what, needed, most });
            }
        }
        Ok(())
    }
}

/// A tree, with its children and the sizes of its sub-trees.
struct Tree<'a> {
    parent: &'a [Option<usize>],
    /// Children, small sub-trees first, so that a slot is free again before the walk goes down the largest one.
    children: Vec<Vec<usize>>,
    /// Number of links of each sub-tree.
    size: Vec<usize>,
}

impl<'a> Tree<'a> {
    fn new(parent: &'a [Option<usize>]) -> Self {
        let (mut children, mut size) = (vec![Vec::new(); parent.len()], vec![1; parent.len()]);
        for (link, up) in parent.iter().enumerate().rev() {
            if let Some(up) = *up {
                children[up].push(link);
                size[up] += size[link];
            }
        }
        for of in &mut children {
            of.sort_by_key(|&child| (size[child], child));
        }
        Self { parent, children, size }
    }

    fn partitioned(&self, team: usize) -> Parts {
        let of = Partition::shortest(self, team);
        let mut parts = Parts::default();
        for (link, &(level, warp)) in of.iter().enumerate() {
            if self.parent[link].is_none_or(|up| of[up] != (level, warp)) {
                self.walk(link, &mut parts[part_of(level, warp)], &|other| of[other] == (level, warp));
            }
        }
        parts
    }

    fn walk(&self, from: usize, part: &mut Vec<usize>, belongs: &dyn Fn(usize) -> bool) {
        let mut open = vec![from];
        while let Some(link) = open.pop() {
            part.push(link);
            open.extend(self.children[link].iter().rev().filter(|child| belongs(**child)));
        }
    }
}

/// Slots of one part, by row.
struct Slots {
    /// Slot of a row with children that do not follow in the next row.
    of_row: Vec<Option<usize>>,
    /// Row of the last such child.
    last_child: Vec<Option<usize>>,
    /// True if the next row is a child.
    carries: Vec<bool>,
    most: usize,
}

impl Slots {
    fn new(tree: &Tree<'_>, links: &[usize], place: &[(usize, usize)]) -> Self {
        let part = links.first().map_or(0, |link| place[*link].0);
        let parent_row =
            |row: usize| tree.parent[links[row]].filter(|up| place[*up].0 == part).map(|up| place[up].1);
        let (mut last_child, mut carries) = (vec![None; links.len()], vec![false; links.len()]);
        for row in 0..links.len() {
            match parent_row(row) {
                Some(up) if up + 1 == row => carries[up] = true,
                Some(up) => last_child[up] = Some(row),
                None => {}
            }
        }
        let (mut free, mut most) = (Vec::new(), 0);
        let mut of_row = vec![None; links.len()];
        for row in 0..links.len() {
            // The last child reads its parent's slot before it writes its own, so that both may be the same.
            if let Some(up) = parent_row(row).filter(|up| last_child[*up] == Some(row)) {
                free.extend(of_row[up]);
            }
            if last_child[row].is_some() {
                of_row[row] = Some(free.pop().unwrap_or_else(|| {
                    most += 1;
                    most - 1
                }));
            }
        }
        Self { of_row, last_child, carries, most }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn schedule(parent: &[Option<usize>]) -> Schedule {
        Schedule::new(parent, &parts(parent, WARPS).unwrap(), &vec![Vec::new(); parent.len()]).unwrap()
    }

    /// A trunk of three links with eight branches of four links each at its top.
    fn broom() -> Vec<Option<usize>> {
        let mut parent = vec![None, Some(0), Some(1)];
        for _ in 0..8 {
            let base = parent.len();
            parent.extend([Some(2), Some(base), Some(base + 1), Some(base + 2)]);
        }
        parent
    }

    #[test]
    fn every_link_is_visited_once_and_after_its_parent() {
        let parent = broom();
        let schedule = schedule(&parent);
        let mut seen = vec![false; parent.len()];
        for visit in schedule.parts.iter().flatten() {
            assert!(!seen[visit.link] && parent[visit.link].is_none_or(|up| seen[up]), "{}", visit.link);
            seen[visit.link] = true;
        }
        assert!(seen.iter().all(|seen| *seen));
        // Whole branches give a critical path of eleven links, the trunk and two of the eight branches; cutting branches makes it shorter.
        let length: usize = schedule.levels().iter().sum();
        assert!((3 + 32_usize.div_ceil(WARPS)..11).contains(&length), "{:?}", schedule.levels());
    }

    /// In the outward pass a slot holds the tip of its reader's parent; in the inward pass it is stored before anything is added, and taken afterwards.
    #[test]
    fn slots_hold_what_their_readers_expect() {
        // A chain with a twig at every link.
        let mut parent = vec![None];
        for k in 0..40 {
            parent.extend([Some(2 * k), Some(2 * k)]);
        }
        let parent: Vec<Option<usize>> = parent.into_iter().collect();
        let schedule = schedule(&parent);
        for part in &schedule.parts {
            let field = |word: u32, shift: usize| (word >> shift & 0xff) as usize;
            let mut held = vec![None; schedule.slots];
            for visit in part {
                let [a, ..] = visit.words;
                if a & first::FROM_SLOT as u32 != 0 {
                    assert_eq!(held[field(a, first::PARENT)], parent[visit.link]);
                }
                if a & first::TO_SLOT as u32 != 0 {
                    held[field(a, first::SLOT)] = Some(visit.link);
                }
            }
            let mut brought = vec![Vec::new(); schedule.slots];
            for visit in part.iter().rev() {
                let [a, b, _] = visit.words;
                if b & second::TAKES as u32 != 0 {
                    let from = std::mem::take(&mut brought[field(a, first::SLOT)]);
                    assert!(!from.is_empty() && from.iter().all(|child| parent[*child] == Some(visit.link)));
                }
                if b & second::GIVES_FIRST as u32 != 0 {
                    brought[field(a, first::PARENT)] = vec![visit.link];
                }
                if b & second::GIVES as u32 != 0 {
                    brought[field(a, first::PARENT)].push(visit.link);
                }
            }
        }
    }

    #[test]
    fn a_tree_has_one_root() {
        assert_eq!(parts(&[None, None], WARPS), Err(ScheduleError::Roots(2)));
    }
}
