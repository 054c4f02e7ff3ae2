//! Packs worlds into the device's buffers, and reads them back.

mod block;

mod fruit_rows;
mod inputs;
mod lane;
#[cfg(test)]
mod numbers;
mod outputs;
mod placed;
mod replicate;
mod room;
mod rows;
mod tiling;
mod topologies;
mod wind;

pub(crate) use lane::Scattered;
#[cfg(test)]
pub(crate) use numbers::Field;
pub(crate) use placed::{PlacedQuad, PlacedWord};
pub use room::Room;
pub(crate) use room::{Seedling, depth};

use block::{Block, blocks};

use std::collections::BTreeSet;
use std::sync::Arc;

use orchard_batch::TreeWorld;
use orchard_geometry::Vec3;

use crate::laws::Laws;
use crate::layout::{LANES, QUAD, damper, link, push, tile, touch, world};
use crate::rules::Rules;
use crate::schedule::{PARTS, Schedule};
use crate::{BatchError, Solver};

/// The buffers on the host, in the layout of [`crate::layout`]; whole numbers among floats are kept as bits.
#[derive(Debug, Clone)]
pub(crate) struct Memory {
    pub rules: Rules,
    pub tiles: Vec<u32>,
    pub operations: Vec<[u32; 4]>,
    pub states: Vec<u32>,
    pub links: Vec<f32>,
    pub fruit: Vec<f32>,
    pub work: Vec<f32>,
    pub worlds: Vec<f32>,
    pub pushes: Vec<f32>,
    /// Base table from which worlds are drawn ([`crate::table`]); empty without a base.
    pub table: Vec<[u32; QUAD]>,
    /// Largest number of external forces on the links of a world.
    pub pushes_each: usize,
    /// Solver of the linear system of a substep.
    pub solver: Solver,
    /// Laws of the worlds.
    pub laws: Laws,
    places: Vec<Place>,
    blocks: Vec<Block>,
}

/// A world with its index and its schedule.
type Member<'a> = (usize, &'a TreeWorld, &'a Schedule);

/// Place of a world.
#[derive(Debug, Clone)]
struct Place {
    block: usize,
    tile: usize,
    lane: usize,
    /// Row of each link in the tile.
    rows: Arc<[usize]>,
    /// Row of each fruit in the tile.
    fruit_rows: Arc<[usize]>,
    /// Number of links in each part.
    parts: [usize; PARTS],
    /// True if wood had broken when the world was put here last.
    is_broken: bool,
    /// Frames of the batch in which the world stood still.
    missed: u32,
}

impl Memory {
    /// Packs worlds into as few tiles as they need; each world has room for `pushes_each` forces on its links.
    ///
    /// # Errors
    /// A world has no schedule, other rules than the first, a broken limb, another damping than its wood, or too many forces.
    pub fn new(given: &[TreeWorld], pushes_each: usize, solver: Solver) -> Result<Self, BatchError> {
        Self::spread_over(1, given, pushes_each, solver, None)
    }

    /// As [`Self::new`], but worlds of different topology, which would wait for each other in a tile, are spread over up to so many tiles; with `room` a robot may touch wood and fruit, and trees of that size may take the places of the given ones.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn spread_over(
        tiles: usize,
        given: &[TreeWorld],
        pushes_each: usize,
        solver: Solver,
        room: Option<&Room>,
    ) -> Result<Self, BatchError> {
        for (index, world) in given.iter().enumerate() {
            let plant = world.plant();
            let (first, laws) = (given[0].plant(), Laws::of(plant));
            if Rules::of(plant) != Rules::of(first) || laws != Laws::of(first) {
                return Err(BatchError::Rules { world: index });
            }
            if !world.rupture().breaks().is_empty() {
                return Err(BatchError::Broken { world: index });
            }
            let damping_time = plant.spec.wood.damping_time.si();
            let mut of_wood = plant.tree.bodies.iter().flat_map(|&id| plant.model.dofs(id));
            let data = world.data();
            if !laws.modal && !of_wood.all(|dof| data.damping[dof] == damping_time * data.stiffness[dof]) {
                return Err(BatchError::Damping { world: index });
            }
            let zero = Vec3::zeros();
            let pushed = data
                .body_force_world
                .iter()
                .zip(&data.body_torque_world)
                .filter(|(f, n)| **f != zero || **n != zero);
            let pushed = pushed.count();
            if pushed > pushes_each {
                return Err(BatchError::Pushes { world: index, pushed, most: pushes_each });
            }
        }
        let laws = given.first().map_or_else(Laws::default, |world| Laws::of(world.plant()));
        let laws = Laws { touched: room.is_some(), ..laws.solved_by(solver) };
        let schedules = topologies::schedules(given, laws)?;
        // Similar worlds share a tile: a level takes as long as its longest part in any world of the tile, and the outer levels are the longest.
        let mut order: Vec<usize> = (0..given.len()).collect();
        order.sort_by_cached_key(|&index| {
            let parts = schedules[index].parts.each_ref().map(Vec::len);
            let mut levels = schedules[index].levels();
            levels.reverse();
            (levels, parts, given[index].plant().tree.parent.clone(), index)
        });
        let mut memory = Self {
            rules: given.first().map_or_else(bytemuck::Zeroable::zeroed, |world| Rules::of(world.plant())),
            tiles: Vec::new(),
            operations: Vec::new(),
            states: Vec::new(),
            links: Vec::new(),
            fruit: Vec::new(),
            work: Vec::new(),
            worlds: Vec::new(),
            pushes: Vec::new(),
            table: Vec::new(),
            pushes_each,
            solver,
            laws,
            places: vec![
                Place {
                    block: 0,
                    tile: 0,
                    lane: 0,
                    rows: [].into(),
                    fruit_rows: [].into(),
                    parts: [0; PARTS],
                    is_broken: false,
                    missed: 0,
                };
                given.len()
            ],
            blocks: Vec::new(),
        };
        memory.rules.pushes_each = pushes_each as u32;
        let fours = given.iter().map(|world| wind::fours(world.plant())).max().unwrap_or(0);
        memory.rules.fours = fours.max(room.map_or(0, |room| room.fours)) as u32;
        let first = given.first().map(|world| &world.plant().tree.parent);
        let has_one_topology = given.iter().all(|world| Some(&world.plant().tree.parent) == first);
        let tiles = if has_one_topology {
            tiling::in_equal_parts(&order, tiles)
        } else {
            tiling::share_out(&order, &schedules, tiles)
        };
        for block in blocks(tiles) {
            let of_tile = |tile: Vec<usize>| -> Vec<Member<'_>> {
                tile.into_iter().map(|index| (index, &given[index], &*schedules[index])).collect()
            };
            let block: Vec<Vec<Member<'_>>> = block.into_iter().map(of_tile).collect();
            memory.add_block(&block, room.unwrap_or(&Room::default()));
        }
        memory.laws = laws.in_tiles(memory.tile_count());
        Ok(memory)
    }

    /// Constants, state and operations of a world.
    fn load(&mut self, index: usize, given: &TreeWorld, schedule: &Schedule) {
        let place = self.places[index].clone();
        let fruit_rows = place.fruit_rows.iter().max().map_or(0, |last| last + 1);
        let numbers = self.lane_numbers(&place, fruit_rows, given, schedule);
        self.put(&place, &numbers);
        let (plant, data) = (given.plant(), given.data());
        for (segment, id) in plant.tree.bodies.iter().enumerate() {
            let (force, torque) = (data.body_force_world[id.index()], data.body_torque_world[id.index()]);
            if force != Vec3::zeros() || torque != Vec3::zeros() {
                // There is room: the number of forces has been checked.
                self.push(index, segment, force, torque);
            }
        }
    }

    /// Number of tiles.
    pub fn tile_count(&self) -> usize {
        self.tiles.len() / tile::FIELDS
    }

    /// Number of worlds.
    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// Field of a tile's header.
    pub fn header(&self, number: usize, field: usize) -> usize {
        self.tiles[number * tile::FIELDS + field] as usize
    }

    pub fn operation_at(&self, number: usize, row: usize, lane: usize) -> usize {
        (self.header(number, tile::ROWS) + row) * LANES + lane
    }

    pub fn link_at(&self, number: usize, row: usize, field: usize, lane: usize) -> usize {
        self.header(number, tile::LINKS) * QUAD + quad_at(row * link::FIELDS + field, lane)
    }

    /// Place of the time of a joint's own damper.
    fn damper_at(&self, number: usize, row: usize, lane: usize) -> usize {
        let links = self.header(number, tile::STARTS + PARTS) * link::FIELDS;
        self.behind_links_at(number, links + row * damper::FIELDS + damper::TIME, lane)
    }

    /// Place of a field in a tile's part of the buffer of links, counted from its first link.
    fn behind_links_at(&self, number: usize, field: usize, lane: usize) -> usize {
        self.header(number, tile::LINKS) * QUAD + quad_at(field, lane)
    }

    /// Place of a field of what contacts need of a link.
    fn touch_at(&self, number: usize, row: usize, field: usize, lane: usize) -> usize {
        self.header(number, tile::TOUCHES) * QUAD + quad_at(row * touch::FIELDS + field, lane)
    }

    pub fn fruit_at(&self, number: usize, row: usize, field: usize, lane: usize) -> usize {
        quad_at((self.header(number, tile::FRUIT) + row) * self.laws.fruit_fields() + field, lane)
    }

    pub fn world_at(&self, number: usize, field: usize, lane: usize) -> usize {
        (number * world::FIELDS + field) * LANES + lane
    }

    pub fn push_at(&self, number: usize, place: usize, field: usize, lane: usize) -> usize {
        ((number * self.pushes_each + place) * push::FIELDS + field) * LANES + lane
    }

    /// Place of a world's notice in the worlds' buffer.
    pub fn notice_of(&self, index: usize) -> usize {
        let place = &self.places[index];
        self.world_at(place.tile, world::NOTICE, place.lane)
    }

    /// Counts frames of the batch in which a world stands still.
    pub fn stand_still(&mut self, index: usize, frames: u32) {
        let missed = &mut self.places[index].missed;
        *missed = missed.wrapping_add(frames);
    }

    /// Frames of the batch in which each world stood still.
    pub fn missed(&self) -> impl Iterator<Item = u32> {
        self.places.iter().map(|place| place.missed)
    }

    /// Bits of a world's field.
    pub fn world_number(&self, index: usize, field: usize) -> u32 {
        let place = &self.places[index];
        self.worlds[self.world_at(place.tile, field, place.lane)].to_bits()
    }

    /// Places of a world of [`Laws::touched`] in the buffers, as `layout::place` lists them.
    pub fn bases_of(&self, index: usize) -> [u32; QUAD] {
        let Place { tile: number, lane, .. } = self.places[index];
        let fruit = self.header(number, tile::FRUIT) * self.laws.fruit_fields() / QUAD * LANES;
        let world = self.world_at(number, 0, 0);
        [self.header(number, tile::TOUCHES), self.header(number, tile::WORK), fruit, world]
            .map(|base| (base + lane) as u32)
    }

    /// Row of a world's link in its tile.
    pub fn row_of(&self, index: usize, segment: usize) -> usize {
        self.places[index].rows[segment]
    }

    /// Row of a world's fruit in its tile.
    pub fn fruit_row_of(&self, index: usize, fruit_index: usize) -> usize {
        self.places[index].fruit_rows[fruit_index]
    }

    /// Places in the buffers of the blocks of some worlds, in order.
    pub fn blocks_of(&self, worlds: &[usize]) -> Vec<Block> {
        let numbers: BTreeSet<usize> = worlds.iter().map(|&index| self.places[index].block).collect();
        numbers.into_iter().map(|number| self.blocks[number].clone()).collect()
    }

    /// Size of the buffers [bytes].
    pub fn bytes(&self) -> usize {
        let floats = [&self.links, &self.fruit, &self.work, &self.worlds, &self.pushes];
        let floats: usize = floats.into_iter().map(Vec::len).sum();
        4 * (floats + self.tiles.len() + self.states.len())
            + 16 * (self.operations.len() + self.table.len())
            + size_of::<Rules>()
    }
}

/// Place of a lane's field; `field` counts the fields of all rows before.
pub(crate) fn quad_at(field: usize, lane: usize) -> usize {
    (field / QUAD * LANES + lane) * QUAD + field % QUAD
}
