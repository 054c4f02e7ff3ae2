//! In which order a tile visits the links of its worlds.
//!
//! Every world is walked depth first, so that row k of a tile holds each world's k-th link; shorter worlds are
//! padded. The first child of a link stands in the next row and takes what it needs from registers. At the
//! other children the walk comes back to a fork, whose state was put into a slot: the number of forks still
//! open above it. Rows in which all worlds do the same move whole vectors, the others move lane by lane;
//! the arithmetic of a world is the same in both cases.

/// A lane that moves nothing.
pub(crate) const NO_SLOT: u16 = u16::MAX;

/// Slot of the world frame; the tips of links use the others.
pub(crate) const WORLD_SLOT: u16 = 0;

/// Walk through one world.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Walk {
    /// Link of each row.
    pub links: Vec<usize>,
    /// Slot from which each row's parent comes back; `NO_SLOT` where the parent is the row before.
    pub resume: Vec<u16>,
    /// Slot into which a fork puts its state; `NO_SLOT` where the link has at most one child.
    pub keep: Vec<u16>,
}

impl Walk {
    /// Depth first, children in index order. Parents come before their children in `parent`.
    pub fn depth_first(parent: &[Option<usize>]) -> Self {
        let mut children = vec![Vec::new(); parent.len()];
        let mut open: Vec<usize> = Vec::new();
        for (link, parent) in parent.iter().enumerate() {
            match parent {
                Some(parent) => children[*parent].push(link),
                None => open.push(link),
            }
        }
        open.reverse();
        let mut walk = Self { links: Vec::new(), resume: Vec::new(), keep: Vec::new() };
        let mut forks_above = vec![0_u16; parent.len()];
        while let Some(link) = open.pop() {
            let before = walk.links.last().copied();
            let is_fork = children[link].len() > 1;
            let resume = match parent[link] {
                None => WORLD_SLOT,
                Some(parent) => {
                    let parent_forks = children[parent].len() > 1;
                    forks_above[link] = forks_above[parent] + u16::from(parent_forks);
                    if before == Some(parent) { NO_SLOT } else { 1 + forks_above[parent] }
                }
            };
            walk.links.push(link);
            walk.resume.push(resume);
            walk.keep.push(if is_fork { 1 + forks_above[link] } else { NO_SLOT });
            open.extend(children[link].iter().rev());
        }
        walk
    }
}

/// What the lanes of a row do with the slots.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Move {
    /// Nothing.
    None,
    /// All use the same slot.
    All(u16),
    /// Each its own, or none.
    Each,
}

/// The walks of a tile's worlds, side by side.
#[derive(Debug, Clone)]
pub(crate) struct Schedule {
    /// Rows.
    pub rows: usize,
    /// Slots, that of the world included.
    pub slots: usize,
    /// What each row takes from the slots on the way out.
    pub resume: Vec<Move>,
    /// What each row puts into the slots.
    pub keep: Vec<Move>,
    /// Slots by row and lane.
    pub resume_slot: Vec<u16>,
    /// Slots by row and lane.
    pub keep_slot: Vec<u16>,
}

impl Schedule {
    /// Puts walks side by side in `lanes` lanes; lanes without a walk are padding.
    pub fn new(walks: &[&Walk], lanes: usize) -> Self {
        let rows = walks.iter().map(|walk| walk.links.len()).max().unwrap_or(0);
        let mut slots = 1;
        let (mut resume_slot, mut keep_slot) = (Vec::new(), Vec::new());
        for row in 0..rows {
            for lane in 0..lanes {
                // Padding has no inertia, so it may hang anywhere: a lane without a world walks along with the
                // first one, rows after a world's last link hang on the world frame.
                let walk = walks.get(lane).or(walks.first()).filter(|walk| row < walk.links.len());
                resume_slot.push(walk.map_or(WORLD_SLOT, |walk| walk.resume[row]));
                let keep = walk.map_or(NO_SLOT, |walk| walk.keep[row]);
                if keep != NO_SLOT {
                    slots = slots.max(usize::from(keep) + 1);
                }
                keep_slot.push(keep);
            }
        }
        let moves = |slots: &[u16]| {
            slots
                .chunks(lanes)
                .map(|row| match row[0] {
                    slot if row.iter().any(|other| *other != slot) => Move::Each,
                    NO_SLOT => Move::None,
                    slot => Move::All(slot),
                })
                .collect()
        };
        Self { rows, slots, resume: moves(&resume_slot), keep: moves(&keep_slot), resume_slot, keep_slot }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_walk_comes_back_to_its_forks() {
        // 0 - 1 - 2
        //      \- 3 - 5
        //  \- 4
        let parent = [None, Some(0), Some(1), Some(1), Some(0), Some(3)];
        let walk = Walk::depth_first(&parent);
        assert_eq!(walk.links, [0, 1, 2, 3, 5, 4]);
        assert_eq!(walk.resume, [WORLD_SLOT, NO_SLOT, NO_SLOT, 2, NO_SLOT, 1]);
        assert_eq!(walk.keep, [1, 2, NO_SLOT, NO_SLOT, NO_SLOT, NO_SLOT]);
    }

    #[test]
    fn equal_walks_move_together_and_others_apart() {
        let fork = Walk::depth_first(&[None, Some(0), Some(0)]);
        let chain = Walk::depth_first(&[None, Some(0)]);
        let same = Schedule::new(&[&fork, &fork], 2);
        assert_eq!(same.resume, [Move::All(0), Move::None, Move::All(1)]);
        assert_eq!(same.keep, [Move::All(1), Move::None, Move::None]);
        let mixed = Schedule::new(&[&fork, &chain], 2);
        assert_eq!((mixed.rows, mixed.slots), (3, 2));
        assert_eq!(mixed.resume, [Move::All(0), Move::None, Move::Each]);
        assert_eq!(mixed.resume_slot[4..], [1, WORLD_SLOT]);
        assert_eq!(mixed.keep[0], Move::Each);
    }
}
