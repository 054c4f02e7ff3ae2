//! The kernels that draw worlds, in Rust: functions of the same names over the same memory, in f32. They explain the formulas and are tested against the host's draws in f64, without a
//! device; the kernels are tested against them. The kernels that step worlds have no twins: they are tested against the f64 worlds.

mod chacha;
mod draws;
mod habit;
mod math;
mod motion;
mod turns;
mod vary;
pub(crate) mod vary_tests;

use crate::layout::{LANES, QUAD, tile, work, world};
use crate::memory::Memory;
use math::Vec3;

/// One world of the memory.
pub(crate) struct Lane<'a> {
    memory: &'a mut Memory,
    number: usize,
    lane: usize,
}

impl Memory {
    /// Draws the constants of some worlds from the base. On the device a reset follows.
    pub fn draw(&mut self, worlds: &[usize], episode: u32) {
        self.set_episode(episode);
        self.mark(worlds);
        for number in 0..self.tile_count() {
            for lane in 0..LANES {
                let mut own = Lane { memory: self, number, lane };
                if own.world(world::LINKS).to_bits() != 0 {
                    own.vary();
                }
            }
        }
    }
}

impl Lane<'_> {
    fn header(&self, field: usize) -> usize {
        self.memory.header(self.number, field)
    }

    fn link(&self, row: usize, field: usize) -> f32 {
        self.memory.links[self.memory.link_at(self.number, row, field, self.lane)]
    }

    fn set_link(&mut self, row: usize, field: usize, value: f32) {
        let at = self.memory.link_at(self.number, row, field, self.lane);
        self.memory.links[at] = value;
    }

    fn set_fruit(&mut self, row: usize, field: usize, value: f32) {
        let at = self.memory.fruit_at(self.number, row, field, self.lane);
        self.memory.fruit[at] = value;
    }

    fn world(&self, field: usize) -> f32 {
        self.memory.worlds[self.memory.world_at(self.number, field, self.lane)]
    }

    /// Number in the head of the base table.
    fn base_number(&self, field: usize) -> f32 {
        f32::from_bits(self.base_word(field))
    }

    fn base_word(&self, field: usize) -> u32 {
        self.memory.table[field / QUAD][field % QUAD]
    }

    /// First quad of the work of a row.
    fn work_at(&self, row: usize) -> usize {
        self.header(tile::WORK) + row * work::FIELDS / QUAD * LANES + self.lane
    }

    /// Four fields of the work buffer; `field` is a multiple of four.
    fn quad(&self, at: usize, field: usize) -> [f32; QUAD] {
        let at = (at + field / QUAD * LANES) * QUAD;
        [0, 1, 2, 3].map(|k| self.memory.work[at + k])
    }

    fn set_quad(&mut self, at: usize, field: usize, value: [f32; QUAD]) {
        let at = (at + field / QUAD * LANES) * QUAD;
        self.memory.work[at..at + QUAD].copy_from_slice(&value);
    }

    /// Adjacent vectors in the work buffer.
    fn vectors<const N: usize>(&self, at: usize, field: usize) -> [Vec3; N] {
        std::array::from_fn(|k| {
            Vec3::from_fn(|axis, _| {
                let field = field + 3 * k + axis;
                self.quad(at, field)[field % QUAD]
            })
        })
    }
}
