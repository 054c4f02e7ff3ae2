//! Inputs of worlds: forces, and marks for resets.

use std::ops::RangeInclusive;

use orchard_geometry::Vec3;

use super::{Memory, Place};
use crate::layout::{LANES, fourth, fruit, push, world};

/// Last frame of a force without an end: later than any frame that the bits of a state can hold.
const FOREVER: u32 = 1 << 30;

impl Memory {
    /// Sets force and torque on a link until changed; returns false if there is no room.
    pub fn push(&mut self, index: usize, segment: usize, force: Vec3, torque: Vec3) -> bool {
        let row = self.places[index].rows[segment] as u32;
        let lasts = |memory: &Self, k: usize| {
            memory.pushed(index, k, push::ROW) == row && memory.pushed(index, k, push::UNTIL) == FOREVER
        };
        let same = (0..self.pushes_each).find(|&k| lasts(self, k));
        let Some(k) = same.or_else(|| self.free_push(index)) else { return false };
        if force == Vec3::zeros() && torque == Vec3::zeros() {
            self.set_push(index, k, push::ROW, f32::from_bits(u32::MAX));
        } else {
            self.fill_push(index, k, segment, [force, torque], 1..=FOREVER);
        }
        true
    }

    /// Adds force and torque on a link in some frames; returns false if there is no room.
    pub fn script(
        &mut self,
        index: usize,
        segment: usize,
        force: Vec3,
        torque: Vec3,
        frames: RangeInclusive<u32>,
    ) -> bool {
        let Some(k) = self.free_push(index) else { return false };
        self.fill_push(index, k, segment, [force, torque], frames);
        true
    }

    /// Free place for a force: an empty one, or one whose frames are over.
    fn free_push(&self, index: usize) -> Option<usize> {
        (0..self.pushes_each).find(|&k| {
            self.pushed(index, k, push::ROW) == u32::MAX
                || self.pushed(index, k, push::UNTIL) <= self.rules.frame
        })
    }

    fn fill_push(
        &mut self,
        index: usize,
        k: usize,
        segment: usize,
        wrench: [Vec3; 2],
        frames: RangeInclusive<u32>,
    ) {
        let row = self.places[index].rows[segment];
        let (tile, lane) = (self.places[index].tile, self.places[index].lane);
        for (field, number) in [
            (push::ROW, row as u32),
            (push::AFTER, frames.start().saturating_sub(1)),
            (push::UNTIL, (*frames.end()).min(FOREVER)),
        ] {
            self.set_push(index, k, field, f32::from_bits(number));
        }
        for (field, vector) in [push::FORCE, push::TORQUE].into_iter().zip(wrench) {
            for (axis, value) in vector.iter().enumerate() {
                self.set_push(index, k, field + axis, *value as f32);
            }
        }
        let operation = self.operation_at(tile, row, lane);
        self.operations[operation][3] |= fourth::PUSHED as u32;
    }

    /// Removes all forces on the links of some worlds; returns true if there were any.
    pub fn clear_pushes(&mut self, worlds: &[usize]) -> bool {
        let mut cleared = false;
        for &index in worlds {
            for k in 0..self.pushes_each {
                cleared |= self.pushed(index, k, push::ROW) != u32::MAX;
                self.set_push(index, k, push::ROW, f32::from_bits(u32::MAX));
            }
        }
        cleared
    }

    fn pushed(&self, index: usize, k: usize, field: usize) -> u32 {
        let Place { tile, lane, .. } = &self.places[index];
        self.pushes[self.push_at(*tile, k, field, *lane)].to_bits()
    }

    fn set_push(&mut self, index: usize, k: usize, field: usize, value: f32) {
        let Place { tile, lane, .. } = &self.places[index];
        let at = self.push_at(*tile, k, field, *lane);
        self.pushes[at] = value;
    }

    /// Marks these worlds, and no others, for a reset.
    pub fn mark(&mut self, worlds: &[usize]) {
        for number in 0..self.tile_count() {
            let at = self.world_at(number, world::RESET, 0);
            self.worlds[at..at + LANES].fill(0.0);
        }
        for &index in worlds {
            let Place { tile, lane, .. } = &self.places[index];
            let at = self.world_at(*tile, world::RESET, *lane);
            self.worlds[at] = 1.0;
        }
    }

    /// Marks by tile, with their place in the worlds' buffer.
    pub fn marks(&self) -> impl Iterator<Item = (usize, &[f32])> {
        (0..self.tile_count()).map(|number| {
            let at = self.world_at(number, world::RESET, 0);
            (at, &self.worlds[at..at + LANES])
        })
    }

    /// Sets the force on a fruit; returns the places in `fruit` that changed. In wind the device adds its own to it.
    pub fn pull(&mut self, index: usize, fruit_index: usize, force: Vec3) -> [usize; 3] {
        let (number, lane) = (self.places[index].tile, self.places[index].lane);
        let row = self.places[index].fruit_rows[fruit_index];
        let field = if self.laws.wind { self.laws.pull_field() } else { fruit::FORCE };
        [0, 1, 2].map(|k| {
            let at = self.fruit_at(number, row, field + k, lane);
            self.fruit[at] = force[k] as f32;
            at
        })
    }
}
