//! Room for trees that take the places of others.

use std::collections::BTreeSet;
use std::sync::Arc;

use orchard_batch::{Plant, TreeWorld};
use orchard_multibody::Data;
use rayon::prelude::*;

use super::lane::{LaneNumbers, Scattered, limits};
use super::placed::{PlacedQuad, PlacedWord};
use super::rows::rows_of;
use super::{Memory, Place, fruit_rows, topologies, wind};
use crate::BatchError;
use crate::laws::Laws;
use crate::layout::{LANES, QUAD, link, notice, tile, world};
use crate::schedule::{MOST_FRUIT_ROWS, PARTS, Schedule, WARPS};

/// Sizes of trees that fit into the same place of a batch: the rows of each part of a schedule, what its passes hand on, the places at which it feels the air, and the longest way from a tip to the root.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Room {
    pub(super) parts: [usize; PARTS],
    pub(super) slots: usize,
    pub(super) forks: usize,
    pub(super) loads: usize,
    pub(super) leaves: usize,
    pub(super) fruit: usize,
    /// Number of groups of four places at which the air is sampled.
    pub(super) fours: usize,
    depth: usize,
}

/// Largest number of links from a tip to the root, both included.
pub(crate) fn depth(parent: &[Option<usize>]) -> usize {
    let mut depths = vec![1; parent.len()];
    for (segment, parent) in parent.iter().enumerate() {
        if let Some(parent) = *parent {
            depths[segment] = depths[parent] + 1;
        }
    }
    depths.into_iter().max().unwrap_or(0)
}

impl Room {
    /// Room for each of some trees, and for trees that are larger by a share of each size.
    ///
    /// # Errors
    /// A tree has no schedule.
    pub fn for_trees(samples: &[TreeWorld], more: f64) -> Result<Self, BatchError> {
        let laws = samples.first().map_or_else(Laws::default, |world| Laws::of(world.plant()));
        let schedules = topologies::schedules(samples, Laws { touched: true, ..laws })?;
        let mut room = Self::default();
        for (sample, schedule) in samples.iter().zip(&schedules) {
            let own = Self::of(schedule, sample.plant());
            room.each(&own, |most, size| *most = size.max(*most));
        }
        // The warps of a level have about the same work, and any of them may have the most.
        for level in room.parts[1..].chunks_mut(WARPS) {
            level.fill(level.iter().copied().max().unwrap_or(0));
        }
        // Fields of an operation hold no larger numbers.
        let fields = Self {
            parts: [1 << 14; PARTS],
            slots: 255,
            forks: 255,
            loads: 1023,
            leaves: 1023,
            fruit: MOST_FRUIT_ROWS,
            fours: usize::MAX,
            depth: usize::MAX,
        };
        room.each(&room.clone(), |most, size| *most = (size as f64 * (1.0 + more)).ceil() as usize);
        room.each(&fields, |most, size| *most = size.min(*most));
        Ok(room)
    }

    /// Sizes of a tree.
    pub(crate) fn of(schedule: &Schedule, plant: &Plant) -> Self {
        Self {
            parts: schedule.parts.each_ref().map(Vec::len),
            slots: schedule.slots,
            forks: schedule.forks,
            loads: schedule.loads,
            leaves: schedule.leaves,
            fruit: schedule.fruit.len(),
            fours: wind::fours(plant),
            depth: depth(&plant.tree.parent),
        }
    }

    /// True if a tree of these sizes fits.
    pub(crate) fn holds(&self, other: &Self) -> bool {
        let mut fits = true;
        self.clone().each(other, |most, size| fits &= size <= *most);
        fits
    }

    fn each(&mut self, other: &Self, mut with: impl FnMut(&mut usize, usize)) {
        self.parts.iter_mut().zip(other.parts).for_each(|(own, other)| with(own, other));
        for (own, other) in [
            (&mut self.slots, other.slots),
            (&mut self.forks, other.forks),
            (&mut self.loads, other.loads),
            (&mut self.leaves, other.leaves),
            (&mut self.fruit, other.fruit),
            (&mut self.fours, other.fours),
            (&mut self.depth, other.depth),
        ] {
            with(own, other);
        }
    }

    /// Largest number of links from a tip to the root.
    pub(crate) fn depth(&self) -> usize {
        self.depth
    }

    /// Largest number of links.
    pub(crate) fn links(&self) -> usize {
        self.parts.iter().sum()
    }

    /// Largest number of fruit.
    pub(crate) fn fruit(&self) -> usize {
        self.fruit
    }

    /// Largest number of links and fruit together.
    pub(crate) fn colliders(&self) -> usize {
        self.links() + self.fruit
    }
}

/// Another tree for the place of a world.
#[derive(Debug)]
pub(crate) struct Seedling {
    place: Place,
    numbers: LaneNumbers,
}

impl Memory {
    /// Prepares another tree for the place of a world: constants, state and operations of its lane, with the bending of the joints at the start of the episode. It must fit into the room of the batch.
    pub fn seedling(&self, index: usize, given: &TreeWorld, schedule: &Schedule, start: &Data) -> Seedling {
        let Place { block, tile: number, lane, missed, .. } = self.places[index];
        let starts: [usize; PARTS] = std::array::from_fn(|part| self.header(number, tile::STARTS + part));
        let (rows, fruit_rows) = rows_of(given, schedule, &starts, None);
        let parts = schedule.parts.each_ref().map(Vec::len);
        let is_broken = !given.rupture().breaks().is_empty();
        let place = Place { block, tile: number, lane, rows, fruit_rows, parts, is_broken, missed };
        let fruit_rows = self.blocks[block].fruit_rows.len();
        let mut numbers = self.lane_numbers(&place, fruit_rows, given, schedule);
        numbers.set_wood(&place, &self.states_of(&place, given), &limits(given, start));
        Seedling { place, numbers }
    }

    /// Plants trees in the places of worlds, of which nothing is left, and returns what the device takes. Of their numbers the host keeps only those that a world has but once.
    pub fn plant(&mut self, seedlings: Vec<(usize, Seedling)>) -> Vec<Scattered> {
        let each: Vec<Scattered> =
            seedlings.par_iter().map(|(_, tree)| self.scattered(&tree.place, &tree.numbers)).collect();
        let mut of_tiles = BTreeSet::new();
        for (index, Seedling { place, numbers }) in seedlings {
            self.put_world(&place, &numbers);
            of_tiles.insert(place.tile);
            self.places[index] = place;
        }
        self.set_lengths(&of_tiles);
        each
    }

    /// Sets the numbers of rows of the parts of tiles that their worlds use.
    pub(super) fn set_lengths(&mut self, tiles: &BTreeSet<usize>) {
        for &number in tiles {
            let first = number * tile::FIELDS + tile::LENGTHS;
            self.tiles[first..first + PARTS].fill(0);
        }
        for place in self.places.iter().filter(|place| tiles.contains(&place.tile)) {
            let lengths = &mut self.tiles[place.tile * tile::FIELDS + tile::LENGTHS..][..PARTS];
            for (longest, &own) in lengths.iter_mut().zip(&place.parts) {
                *longest = (*longest).max(own as u32);
            }
        }
    }
}

impl Memory {
    /// Schedule of a tree under the laws of the batch.
    ///
    /// # Errors
    /// It has none.
    pub fn schedule(&self, given: &TreeWorld) -> Result<Arc<Schedule>, BatchError> {
        let mut of_one = topologies::schedules(std::slice::from_ref(given), self.laws)?;
        Ok(of_one.remove(0))
    }

    /// Sets the state of a world of which the tree stands here, as in [`Self::plant`]. Its constants stay. Returns what the device takes but for the world's flags ([`Self::flags_of`]).
    pub fn resume(&mut self, index: usize, given: &TreeWorld, start: &Data) -> Scattered {
        let (plant, data) = (given.plant().clone(), given.data());
        let place = self.places[index].clone();
        let (number, lane) = (place.tile, place.lane);
        let mut sent = Scattered::default();
        for (&id, &row) in plant.tree.bodies.iter().zip(place.rows.iter()) {
            let (dof, q) = (plant.model.dofs(id).start, plant.model.qs(id).start);
            let motion = [data.q[q], data.q[q + 1], data.v[dof], data.v[dof + 1]].map(|x| x as f32);
            sent.links.push(PlacedQuad::new(self.motion_quad(number, row, lane), motion));
        }
        let is_broken = !given.rupture().breaks().is_empty();
        if is_broken || place.is_broken {
            let each = self.states_of(&place, given).into_iter().zip(limits(given, start));
            for (&row, (bits, limit)) in place.rows.iter().zip(each) {
                sent.states.push(PlacedWord { at: self.operation_at(number, row, lane) as u32, bits });
                let at = (self.link_at(number, row, link::LIMIT, lane) / QUAD) as u32;
                sent.links.push(PlacedQuad::new(at, limit));
            }
        }
        self.places[index].is_broken = is_broken;
        for (i, &row) in place.fruit_rows.iter().enumerate() {
            let first = self.fruit_at(number, row, 0, lane) / QUAD;
            let mut quads = vec![[0.0_f32; QUAD]; self.laws.fruit_fields() / QUAD];
            for (field, value) in fruit_rows::numbers(given, i) {
                quads[field / QUAD][field % QUAD] = value as f32;
            }
            let places = (first..).step_by(LANES);
            sent.fruit.extend(places.zip(quads).map(|(at, quad)| PlacedQuad::new(at as u32, quad)));
        }
        let began = self.began(&place, given);
        for (field, bits) in
            [(world::STOPPED, 0), (world::NOTICE, notice::STALE as u32), (world::BEGAN, began)]
        {
            let at = self.world_at(number, field, lane);
            self.worlds[at] = f32::from_bits(bits);
        }
        sent
    }

    /// Quad of angles and rates of a link.
    fn motion_quad(&self, number: usize, row: usize, lane: usize) -> u32 {
        (self.link_at(number, row, link::Q, lane) / QUAD) as u32
    }

    /// Quads of the angles and rates of a world's links, and of the motion of its fruit ([`Laws::fruit_motion`]).
    pub fn motion_quads(&self, index: usize) -> [Vec<u32>; 2] {
        let Place { tile: number, lane, rows, fruit_rows, .. } = &self.places[index];
        let links = rows.iter().map(|&row| self.motion_quad(*number, row, *lane));
        let fields = self.laws.fruit_motion();
        let fruit = fruit_rows.iter().flat_map(|&row| {
            fields.iter().map(move |&field| (self.fruit_at(*number, row, field, *lane) / QUAD) as u32)
        });
        [links.collect(), fruit.collect()]
    }

    /// Fields of a world that [`Self::resume`] sets: their places in the worlds' buffer, with their bits.
    pub fn flags_of(&self, index: usize) -> [(usize, u32); 3] {
        let place = &self.places[index];
        [world::STOPPED, world::NOTICE, world::BEGAN].map(|field| {
            let at = self.world_at(place.tile, field, place.lane);
            (at, self.worlds[at].to_bits())
        })
    }

    /// Stops a world as of a frame; returns the place of the number in the worlds' buffer.
    pub fn stop(&mut self, index: usize, frame: u32) -> usize {
        let place = &self.places[index];
        let at = self.world_at(place.tile, world::STOPPED, place.lane);
        self.worlds[at] = f32::from_bits(frame);
        at
    }
}
