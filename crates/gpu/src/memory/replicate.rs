//! Copies of one tree in all worlds.

use std::slice::from_ref;

use super::block::{Block, starting_at};
use super::{Memory, Place};
use crate::layout::{LANES, QUAD, base, tile};
use crate::table::BaseTree;
use crate::{BatchError, Solver};

/// Fields of a tile's header that are places in the work buffer: they grow from tile to tile.
const WORK_PLACES: [usize; 6] =
    [tile::WORK, tile::LEAVES, tile::SLOTS, tile::CROSS_FORKS, tile::CROSS_LOADS, tile::TOUCHES];

impl Memory {
    /// Creates `count` copies of a base, with the table from which they are drawn later. The base is packed once and copied; lanes after the last world hold
    /// copies too.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn replicated(
        base: &BaseTree,
        count: usize,
        pushes_each: usize,
        solver: Solver,
    ) -> Result<Self, BatchError> {
        let mut memory = Self::new(from_ref(base.world()), pushes_each, solver)?;
        memory.table = base.table(&memory);
        let tiles = count.div_ceil(LANES);
        let Block { rows, links: own_links, fruit_rows } = memory.blocks[0].clone();
        let (rows, fruit) = (rows.len(), fruit_rows.len());
        let (links, work) = (memory.links.len() / QUAD, memory.work.len() / QUAD);
        let block = |number: usize| Block {
            rows: starting_at(number * rows, rows),
            links: starting_at(number * links * QUAD, own_links.len()),
            fruit_rows: starting_at(number * fruit, fruit),
        };
        memory.blocks = (0..tiles).map(block).collect();
        memory.tiles = (0..tiles)
            .flat_map(|number| {
                let mut header = memory.tiles.clone();
                header[tile::ROWS] += (number * rows) as u32;
                header[tile::FRUIT] += (number * fruit) as u32;
                header[tile::LINKS] += (number * links) as u32;
                WORK_PLACES.iter().for_each(|&field| header[field] += (number * work) as u32);
                header
            })
            .collect();
        memory.operations = spread(&memory.operations, 1).repeat(tiles);
        memory.states = spread(&memory.states, 1).repeat(tiles);
        memory.links = spread(&memory.links, QUAD).repeat(tiles);
        memory.fruit = spread(&memory.fruit, QUAD).repeat(tiles);
        memory.worlds = spread(&memory.worlds, 1).repeat(tiles);
        memory.pushes = spread(&memory.pushes, 1).repeat(tiles);
        memory.work = vec![0.0; tiles * work * QUAD];
        let Place { rows, fruit_rows, parts, .. } = memory.places[0].clone();
        let place = |index| Place {
            block: index / LANES,
            tile: index / LANES,
            lane: index % LANES,
            rows: rows.clone(),
            fruit_rows: fruit_rows.clone(),
            parts,
            is_broken: false,
            missed: 0,
        };
        memory.places = (0..count).map(place).collect();
        Ok(memory)
    }

    /// Sets the episode of the next draws.
    pub fn set_episode(&mut self, episode: u32) {
        if let Some(first) = self.table.first_mut() {
            first[base::EPISODE] = episode;
        }
    }
}

/// A tile with its first lane copied to all lanes; `each` numbers of a lane are adjacent.
fn spread<T: Copy>(tile: &[T], each: usize) -> Vec<T> {
    tile.chunks_exact(each * LANES).flat_map(|lanes| lanes[..each].repeat(LANES)).collect()
}
