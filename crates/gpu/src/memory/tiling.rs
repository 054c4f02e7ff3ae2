//! Distribution of worlds over tiles.
//!
//! The worlds of a tile wait for each other: a level takes as long as its longest part, and a row as long as its busiest world.

use std::sync::Arc;

use crate::layout::LANES;
use crate::schedule::{PARTS, Schedule, WARPS};

/// Time of a row, in tenths of a link's time: the link, each of its fruit, and each load from other rows. Fitted to the rates of batches on one H200.
const LINK: usize = 10;
const FRUIT: usize = 6;
const LOAD: usize = 3;

/// Distributes worlds in a given order over as few tiles as they need or, if `most` is more, over up to so many tiles such that the longest critical path of a tile is shortest. If the slowest world alone
/// has that path, the others are still spread: their tiles end sooner.
pub(super) fn share_out(order: &[usize], schedules: &[Arc<Schedule>], most: usize) -> Vec<Vec<usize>> {
    let within = |bound: usize| tiles_within(bound, order, schedules);
    let fewest = order.len().div_ceil(LANES);
    if most <= fewest {
        return order.chunks(LANES).map(<[usize]>::to_vec).collect();
    }
    // The smallest bound on the critical paths that makes no more tiles.
    let (mut too_low, mut bound) = (0, critical_path(order, schedules));
    while bound - too_low > LINK / 2 {
        let middle = usize::midpoint(too_low, bound);
        if within(middle).len() <= most {
            bound = middle;
        } else {
            too_low = middle;
        }
    }
    within(bound)
}

/// Distributes worlds of one topology over tiles with half of their lanes, which read memory faster, if half of so many tiles are enough for that; else over as few tiles as needed. Still fewer lanes are
/// not faster.
pub(super) fn in_equal_parts(order: &[usize], most: usize) -> Vec<Vec<usize>> {
    let half = LANES / 2;
    let lanes = if order.len().div_ceil(half) <= most / 2 { half } else { LANES };
    order.chunks(lanes).map(<[usize]>::to_vec).collect()
}

/// Critical path of a tile with all these worlds.
fn critical_path(order: &[usize], schedules: &[Arc<Schedule>]) -> usize {
    let mut all = Busiest::default();
    order.iter().for_each(|&index| all = all.with(&schedules[index]));
    all.critical_path()
}

/// Puts each world into the tile of the one before it, unless that makes the critical path longer than a bound.
fn tiles_within(bound: usize, order: &[usize], schedules: &[Arc<Schedule>]) -> Vec<Vec<usize>> {
    let mut tiles: Vec<Vec<usize>> = Vec::new();
    let mut busiest = Busiest::default();
    for &index in order {
        let joined = busiest.with(&schedules[index]);
        match tiles.last_mut() {
            Some(tile) if tile.len() < LANES && joined.critical_path() <= bound => {
                tile.push(index);
                busiest = joined;
            }
            _ => {
                tiles.push(vec![index]);
                busiest = Busiest::default().with(&schedules[index]);
            }
        }
    }
    tiles
}

/// Largest number of fruit and of loads that a world of a tile has in each row, by part.
#[derive(Debug, Clone, Default)]
struct Busiest([Vec<Busy>; PARTS]);

#[derive(Debug, Clone, Copy, Default)]
struct Busy {
    fruit: usize,
    loads: usize,
}

impl Busiest {
    fn with(&self, schedule: &Schedule) -> Self {
        let mut joined = self.clone();
        for (rows, visits) in joined.0.iter_mut().zip(&schedule.parts) {
            rows.resize(rows.len().max(visits.len()), Busy::default());
            for (row, visit) in rows.iter_mut().zip(visits) {
                row.fruit = row.fruit.max(visit.fruit().len());
                row.loads = row.loads.max(visit.loads());
            }
        }
        joined
    }

    /// Critical path of the tile: the sum over all levels of their longest parts.
    fn critical_path(&self) -> usize {
        let of_row = |row: &Busy| LINK + FRUIT * row.fruit + LOAD * row.loads;
        let of_part = |part: &Vec<Busy>| part.iter().map(of_row).sum::<usize>();
        let levels =
            self.0[1..].chunks(WARPS).map(|parts| parts.iter().map(of_part).max().unwrap_or_default());
        of_part(&self.0[0]) + levels.sum::<usize>()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::schedule::parts;

    fn longest(tiles: &[Vec<usize>], schedules: &[Arc<Schedule>]) -> usize {
        tiles.iter().map(|tile| critical_path(tile, schedules)).max().unwrap_or_default()
    }

    /// Trees of 40 links, each on one of the last few before it, with fruit on some.
    fn forest() -> impl Strategy<Value = Vec<Arc<Schedule>>> {
        let tree = prop::collection::vec((1..8_usize, prop::bool::weighted(0.2)), 39).prop_map(|links| {
            let parent = |(link, &(back, _)): (usize, &(usize, bool))| Some((link + 1).saturating_sub(back));
            let parents: Vec<_> = std::iter::once(None).chain(links.iter().enumerate().map(parent)).collect();
            let mut fruit = 0..;
            let mut fruit_of: Vec<Vec<usize>> =
                links.iter().map(|(_, bears)| fruit.by_ref().take(usize::from(*bears)).collect()).collect();
            fruit_of.push(Vec::new());
            Arc::new(Schedule::new(&parents, &parts(&parents, WARPS).unwrap(), &fruit_of).unwrap())
        });
        prop::collection::vec(tree, 1..60)
    }

    proptest! {
        // Each has up to 59 trees, which are cut into parts without optimisation.
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn spreading_shortens_the_critical_path(schedules in forest(), most in 1..40_usize) {
            let order: Vec<usize> = (0..schedules.len()).collect();
            let fewest = share_out(&order, &schedules, 1);
            prop_assert_eq!(fewest.len(), order.len().div_ceil(LANES));
            let spread = share_out(&order, &schedules, most);
            prop_assert_eq!(spread.concat(), order.clone());
            prop_assert!(spread.len() <= most.max(fewest.len()));
            prop_assert!(spread.iter().all(|tile| tile.len() <= LANES));
            let found = longest(&spread, &schedules);
            prop_assert!(found <= longest(&fewest, &schedules));
            if most > fewest.len() {
                // No even split into as many tiles is better by more than the tolerance of the search.
                let even: Vec<_> = order.chunks(order.len().div_ceil(most)).map(<[usize]>::to_vec).collect();
                prop_assert!(found <= longest(&even, &schedules) + LINK / 2);
            }
        }
    }

    #[test]
    fn equal_worlds_have_half_tiles_where_there_is_room() {
        let tiles = |worlds: usize, most: usize| {
            let order: Vec<usize> = (0..worlds).collect();
            let tiles = in_equal_parts(&order, most);
            assert_eq!(tiles.concat(), order);
            (tiles.len(), tiles.iter().map(Vec::len).max())
        };
        assert_eq!(tiles(512, 128), (32, Some(16)));
        assert_eq!(tiles(4096, 256), (128, Some(32)));
        assert_eq!(tiles(40, 1), (2, Some(32)));
        assert_eq!(tiles(0, 128), (0, None));
    }

    /// Two worlds, one with a fruit on its only link, the other with one link more: both count, row by row.
    #[test]
    fn a_row_takes_what_the_busiest_of_its_worlds_does() {
        let schedule = |parent: &[Option<usize>], fruit_of: &[Vec<usize>]| {
            Arc::new(Schedule::new(parent, &parts(parent, WARPS).unwrap(), fruit_of).unwrap())
        };
        let one = schedule(&[None], &[vec![0]]);
        let two = schedule(&[None, Some(0)], &[vec![], vec![]]);
        let [one_alone, two_alone, both] =
            [&[0][..], &[1], &[0, 1]].map(|worlds| critical_path(worlds, &[one.clone(), two.clone()]));
        assert_eq!(one_alone, LINK + FRUIT);
        assert_eq!(both, two_alone + FRUIT);
    }
}
