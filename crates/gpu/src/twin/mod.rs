//! The kernels in Rust: the same functions by the same names over the same memory, in f32, one lane after the other. They are what a kernel is held to, and where
//! its mathematics is explained; they are not fast.

mod chacha;
mod conjugate;
mod draws;
mod frame;
mod ground;
mod habit;
mod inward;
mod load;
mod math;
mod measure;
mod mend;
mod motion;
mod outward;
mod reset;
mod stem;
#[cfg(test)]
mod tests;
mod turns;
mod vary;
#[cfg(test)]
pub(crate) mod vary_tests;

use crate::Solver;
use crate::layout::{LANES, QUAD, first, fork, leaf, link, tile, work, world};
use crate::memory::Memory;
use math::Vec3;

/// One world of the memory.
pub(crate) struct Lane<'a> {
    memory: &'a mut Memory,
    number: usize,
    lane: usize,
}

impl Memory {
    /// Advances every world by one frame, as the device does.
    pub fn frame(&mut self) {
        self.rules.frame += 1;
        match self.solver {
            Solver::Aba => self.each(|world| world.frame()),
            Solver::ConjugateGradients => self.each(|world| world.conjugate()),
        }
        self.each(|world| world.mend());
    }

    /// Resets worlds, as the device does.
    pub fn reset(&mut self, worlds: &[usize]) {
        self.mark(worlds);
        self.reset_marked();
    }

    /// Draws worlds anew from the base, as the device does.
    pub fn redraw(&mut self, worlds: &[usize], episode: u32) {
        self.set_episode(episode);
        self.mark(worlds);
        self.each(|world| world.vary());
        self.reset_marked();
    }

    fn reset_marked(&mut self) {
        self.each(|world| world.reset());
        let (rules, solver) = (self.rules, std::mem::take(&mut self.solver));
        self.settles = true;
        for settling in self.rules.settling() {
            self.rules = settling;
            self.each(|world| world.frame());
        }
        (self.rules, self.settles, self.solver) = (rules, false, solver);
    }

    /// Measures every world's energy.
    pub fn measure(&mut self) {
        self.each(|world| world.measure());
    }

    /// A world alone.
    fn lane_of(&mut self, index: usize) -> Lane<'_> {
        let (number, lane) = self.seat_of(index);
        Lane { memory: self, number, lane }
    }

    fn each(&mut self, act: impl Fn(&mut Lane<'_>)) {
        for number in 0..self.tile_count() {
            for lane in 0..LANES {
                let mut own = Lane { memory: self, number, lane };
                if own.is_there() {
                    act(&mut own);
                }
            }
        }
    }
}

impl Lane<'_> {
    /// Whether the tile has a world in this lane.
    fn is_there(&self) -> bool {
        self.world(world::LINKS).to_bits() != 0
    }

    fn header(&self, field: usize) -> usize {
        self.memory.header(self.number, field)
    }

    fn operation(&self, row: usize) -> [usize; 4] {
        self.memory.operations[self.memory.operation_at(self.number, row, self.lane)]
            .map(|word| word as usize)
    }

    fn state(&self, row: usize) -> usize {
        self.memory.states[self.memory.operation_at(self.number, row, self.lane)] as usize
    }

    fn set_state(&mut self, row: usize, bits: usize) {
        let at = self.memory.operation_at(self.number, row, self.lane);
        self.memory.states[at] = bits as u32;
    }

    fn link(&self, row: usize, field: usize) -> f32 {
        self.memory.links[self.memory.link_at(self.number, row, field, self.lane)]
    }

    fn set_link(&mut self, row: usize, field: usize, value: f32) {
        let at = self.memory.link_at(self.number, row, field, self.lane);
        self.memory.links[at] = value;
    }

    fn direction(&self, row: usize) -> Vec3 {
        Vec3::from_fn(|k, _| self.link(row, link::DIRECTION + k))
    }

    fn fruit(&self, row: usize, field: usize) -> f32 {
        self.memory.fruit[self.memory.fruit_at(self.number, row, field, self.lane)]
    }

    fn fruit3(&self, row: usize, field: usize) -> Vec3 {
        Vec3::from_fn(|k, _| self.fruit(row, field + k))
    }

    fn set_fruit(&mut self, row: usize, field: usize, value: f32) {
        let at = self.memory.fruit_at(self.number, row, field, self.lane);
        self.memory.fruit[at] = value;
    }

    fn set_fruit3(&mut self, row: usize, field: usize, value: Vec3) {
        (0..3).for_each(|k| self.set_fruit(row, field + k, value[k]));
    }

    fn world(&self, field: usize) -> f32 {
        self.memory.worlds[self.memory.world_at(self.number, field, self.lane)]
    }

    fn set_world(&mut self, field: usize, value: f32) {
        let at = self.memory.world_at(self.number, field, self.lane);
        self.memory.worlds[at] = value;
    }

    /// A number of the base table's head.
    fn base_number(&self, field: usize) -> f32 {
        f32::from_bits(self.base_word(field))
    }

    fn base_word(&self, field: usize) -> u32 {
        self.memory.table[field / QUAD][field % QUAD]
    }

    fn p_trunk(&self) -> Vec3 {
        Vec3::from_fn(|k, _| self.world(world::P + k))
    }

    /// First quad of a row's work.
    fn work_at(&self, row: usize) -> usize {
        self.header(tile::WORK) + row * work::FIELDS / QUAD * LANES + self.lane
    }

    fn leaf_at(&self, leaf: usize) -> usize {
        self.header(tile::LEAVES) + leaf * leaf::FIELDS / QUAD * LANES + self.lane
    }

    /// First quad of a slot; forks and loads take turns in it. On the device every warp has its own; here one part follows the other.
    fn slot_at(&self, slot: usize) -> usize {
        self.header(tile::SLOTS) + slot * fork::FIELDS / QUAD * LANES + self.lane
    }

    fn cross_fork_at(&self, fork: usize) -> usize {
        self.header(tile::CROSS_FORKS) + fork * fork::FIELDS / QUAD * LANES + self.lane
    }

    fn cross_load_at(&self, load: usize) -> usize {
        self.header(tile::CROSS_LOADS) + load * crate::layout::load::FIELDS / QUAD * LANES + self.lane
    }

    /// Four fields of the work buffer, from a multiple of four on.
    fn quad(&self, at: usize, field: usize) -> [f32; QUAD] {
        let at = (at + field / QUAD * LANES) * QUAD;
        [0, 1, 2, 3].map(|k| self.memory.work[at + k])
    }

    fn set_quad(&mut self, at: usize, field: usize, value: [f32; QUAD]) {
        let at = (at + field / QUAD * LANES) * QUAD;
        self.memory.work[at..at + QUAD].copy_from_slice(&value);
    }

    /// Vectors one after the other.
    fn vectors<const N: usize>(&self, at: usize, field: usize) -> [Vec3; N] {
        std::array::from_fn(|k| {
            Vec3::from_fn(|axis, _| {
                let field = field + 3 * k + axis;
                self.quad(at, field)[field % QUAD]
            })
        })
    }

    fn set_vectors(&mut self, at: usize, field: usize, values: &[Vec3]) {
        for (k, value) in values.iter().enumerate() {
            for axis in 0..3 {
                let field = field + 3 * k + axis;
                let mut quad = self.quad(at, field);
                quad[field % QUAD] = value[axis];
                self.set_quad(at, field, quad);
            }
        }
    }

    /// Where a link's parent left its fork, for a link whose parent's motion is not at hand.
    fn parent_fork_at(&self, word: usize) -> usize {
        let place = word >> first::PARENT & 0xff;
        if word & first::FROM_CROSS != 0 { self.cross_fork_at(place) } else { self.slot_at(place) }
    }
}
