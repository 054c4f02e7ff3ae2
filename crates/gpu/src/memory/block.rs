//! Blocks: tiles that share the rows of the buffers.

use super::room::Room;
use super::rows::rows_of;
use super::{Member, Memory, Place, fruit_rows};
use crate::Solver;
use crate::layout::{LANES, QUAD, fork, krylov, leaf, link, load, push, tile, wave, work, world};
use crate::schedule::{PARTS, Schedule, WARPS};
use std::cmp::Reverse;
use std::collections::BTreeSet;
use std::ops::Range;

/// Number of lanes whose quads are 32 bytes together, the smallest unit that a graphics card reads: they belong to one tile.
const LANES_TOGETHER: usize = 2;

/// Place of a block in the buffers.
#[derive(Debug, Clone)]
pub(crate) struct Block {
    /// Rows of operations and states.
    pub rows: Range<usize>,
    /// Numbers of links.
    pub links: Range<usize>,
    /// Rows of fruit.
    pub fruit_rows: Range<usize>,
}

/// Number of lanes of a tile.
fn lanes_of<T>(tile: &[T]) -> usize {
    tile.len().next_multiple_of(LANES_TOGETHER)
}

/// Groups tiles into blocks: the largest first, each into the first block that has room.
pub(super) fn blocks(mut tiles: Vec<Vec<usize>>) -> Vec<Vec<Vec<usize>>> {
    tiles.sort_by_key(|tile| Reverse(tile.len()));
    let mut blocks: Vec<(usize, Vec<Vec<usize>>)> = Vec::new();
    for tile in tiles {
        let lanes = lanes_of(&tile);
        match blocks.iter_mut().find(|(taken, _)| taken + lanes <= LANES) {
            Some((taken, block)) => {
                *taken += lanes;
                block.push(tile);
            }
            None => blocks.push((lanes, vec![tile])),
        }
    }
    blocks.into_iter().map(|(_, block)| block).collect()
}

/// Rows of a tile.
struct Rows {
    /// First row of each part, and their number.
    starts: [usize; PARTS + 1],
    /// First row of each link's fruit, if the worlds share these rows.
    shared: Option<Vec<usize>>,
    /// Number of rows of fruit.
    fruit: usize,
}

impl Rows {
    fn of(members: &[Member<'_>], room: &Room) -> Self {
        let mut starts = [0; PARTS + 1];
        for part in 0..PARTS {
            let longest = most(members, |schedule| schedule.parts[part].len());
            starts[part + 1] = starts[part] + longest.max(room.parts[part]);
        }
        let (shared, fruit) = match fruit_rows::shared_rows(members) {
            Some((shared, rows)) => (Some(shared), rows),
            None => (None, most(members, |schedule| schedule.fruit.len())),
        };
        Self { starts, shared, fruit: fruit.max(room.fruit) }
    }
}

fn most(members: &[Member<'_>], of: impl Fn(&Schedule) -> usize) -> usize {
    members.iter().map(|(_, _, schedule)| of(schedule)).max().unwrap_or(0)
}

impl Memory {
    /// Adds tiles that share rows, each in lanes of its own, with room for larger trees.
    pub(super) fn add_block(&mut self, tiles: &[Vec<Member<'_>>], room: &Room) {
        let all = tiles.concat();
        let of_tiles: Vec<Rows> = tiles.iter().map(|members| Rows::of(members, room)).collect();
        let rows = of_tiles.iter().map(|tile| tile.starts[PARTS]).max().unwrap_or(0);
        // At least one row, since a buffer must not be empty.
        let fruit_rows = of_tiles.iter().map(|tile| tile.fruit).max().unwrap_or(0).max(1);
        let slots = most(&all, |schedule| schedule.slots).max(room.slots);
        let slot = fork::FIELDS.max(load::FIELDS);
        let mut header = [0_u32; tile::FIELDS];
        let block = Block {
            rows: starting_at(self.operations.len() / LANES, rows),
            links: starting_at(self.links.len(), rows * link::FIELDS * LANES),
            fruit_rows: starting_at(self.fruit.len() / (self.laws.fruit_fields() * LANES), fruit_rows),
        };
        header[tile::ROWS] = block.rows.start as u32;
        header[tile::FRUIT] = block.fruit_rows.start as u32;
        header[tile::LINKS] = (block.links.start / QUAD) as u32;
        header[tile::SLOTS_EACH] = slots as u32;
        let mut at = self.work.len() / QUAD;
        for (field, size) in [
            (tile::WORK, rows * work::FIELDS),
            (tile::LEAVES, most(&all, |schedule| schedule.leaves).max(room.leaves) * leaf::FIELDS),
            (tile::SLOTS, WARPS * slots * slot),
            (tile::TOUCHES, rows * self.laws.touch_fields()),
        ] {
            header[field] = at as u32;
            at += size / QUAD * LANES;
        }
        // Forks and loads share their memory: each pass has read those of the one before.
        let forks = most(&all, |schedule| schedule.forks).max(room.forks);
        let loads = most(&all, |schedule| schedule.loads).max(room.loads);
        header[tile::CROSS_FORKS] = at as u32;
        header[tile::CROSS_LOADS] = at as u32;
        at += (forks * fork::FIELDS).max(loads * load::FIELDS) / QUAD * LANES;
        self.work.resize(at * QUAD, 0.0);
        self.operations.resize(self.operations.len() + rows * LANES, [0; 4]);
        self.states.resize(self.operations.len(), 0);
        let [dampers, airs] = self.laws.behind_links();
        let of_row = link::FIELDS
            + dampers
            + airs
            + match self.solver {
                Solver::Aba => 0,
                Solver::ConjugateGradients => krylov::FIELDS,
            };
        let (waves, places) = (self.rules.waves as usize, QUAD * self.rules.fours as usize);
        // A place has two numbers of each wave, its share of the mean speed, and its air at the ends of three frames.
        let waves = waves * (wave::FIELDS + 2 * places) + places * (1 + 3 * QUAD);
        self.links.resize(self.links.len() + (rows * of_row + waves) * LANES, 0.0);
        self.fruit.resize(self.fruit.len() + fruit_rows * self.laws.fruit_fields() * LANES, 0.0);
        let mut lane = 0;
        for (members, rows) in tiles.iter().zip(of_tiles) {
            for (field, start) in header[tile::STARTS..].iter_mut().zip(rows.starts) {
                *field = start as u32;
            }
            self.add_tile(header, members, &rows, lane);
            lane += lanes_of(members);
        }
        self.pad_fruit(block.fruit_rows.clone());
        self.blocks.push(block);
    }

    fn add_tile(
        &mut self,
        header: [u32; tile::FIELDS],
        members: &[Member<'_>],
        of_tile: &Rows,
        first_lane: usize,
    ) {
        let number = self.tile_count();
        self.tiles.extend(header);
        self.worlds.resize(self.worlds.len() + world::FIELDS * LANES, 0.0);
        self.pushes
            .resize(self.pushes.len() + self.pushes_each * push::FIELDS * LANES, f32::from_bits(u32::MAX));
        for (lane, &(index, world, schedule)) in (first_lane..).zip(members) {
            let shared = of_tile.shared.as_deref();
            let (rows, fruit_rows) = rows_of(world, schedule, &of_tile.starts, shared);
            let (block, parts) = (self.blocks.len(), schedule.parts.each_ref().map(Vec::len));
            self.places[index] =
                Place { block, tile: number, lane, rows, fruit_rows, parts, is_broken: false, missed: 0 };
            self.load(index, world, schedule);
        }
        self.set_lengths(&BTreeSet::from([number]));
    }
}

pub(super) fn starting_at(start: usize, length: usize) -> Range<usize> {
    start..start + length
}
