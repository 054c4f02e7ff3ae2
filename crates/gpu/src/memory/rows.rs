//! Rows of a world's links and fruit in a tile.

use std::sync::Arc;

use orchard_batch::TreeWorld;

use crate::schedule::Schedule;

/// Row of each link, and of each fruit, in a tile whose parts start at some rows; `shared` is the first row of each link's fruit where worlds share them.
pub(super) fn rows_of(
    world: &TreeWorld,
    schedule: &Schedule,
    starts: &[usize],
    shared: Option<&[usize]>,
) -> (Arc<[usize]>, Arc<[usize]>) {
    let mut rows = vec![0; world.plant().tree.len()];
    let mut fruit_rows = vec![0; schedule.fruit.len()];
    for (part, visits) in schedule.parts.iter().enumerate() {
        for (row, visit) in visits.iter().enumerate() {
            rows[visit.link] = starts[part] + row;
        }
    }
    for (number, visit) in schedule.parts.iter().flatten().enumerate() {
        let own = visit.fruit();
        let start = shared.map_or(own.start, |starts| starts[number]);
        for (row, &fruit) in (start..).zip(&schedule.fruit[own]) {
            fruit_rows[fruit] = row;
        }
    }
    (rows.into(), fruit_rows.into())
}
