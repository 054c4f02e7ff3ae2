//! Numbers of a world, for tests.

use super::{Memory, Place};
use crate::layout::{fruit, link};

/// Field of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Field {
    Link(usize),
    Fruit(usize),
}

impl Memory {
    /// Field of a world's link.
    pub fn link_of(&self, index: usize, segment: usize, field: usize) -> f32 {
        let Place { tile, lane, rows, .. } = &self.places[index];
        self.links[self.link_at(*tile, rows[segment], field, *lane)]
    }

    /// Field of a world's fruit.
    pub fn fruit_of(&self, index: usize, fruit_index: usize, field: usize) -> f32 {
        let Place { tile, lane, fruit_rows, .. } = &self.places[index];
        self.fruit[self.fruit_at(*tile, fruit_rows[fruit_index], field, *lane)]
    }

    /// Number of fruit of a world.
    pub fn fruit_count(&self, index: usize) -> usize {
        self.places[index].fruit_rows.len()
    }

    /// Operation of a world's link.
    pub fn operation_of(&self, index: usize, segment: usize) -> [u32; 4] {
        let Place { tile, lane, rows, .. } = &self.places[index];
        self.operations[self.operation_at(*tile, rows[segment], *lane)]
    }

    /// Constants of a world's links and fruit.
    pub fn constants(&self, index: usize) -> Vec<(Field, f32)> {
        let Place { rows, fruit_rows, .. } = &self.places[index];
        let link = |segment, field| (Field::Link(field), self.link_of(index, segment, field));
        let links =
            (0..rows.len()).flat_map(|segment| (0..=link::LIMIT).map(move |field| link(segment, field)));
        let one = |i, field| (Field::Fruit(field), self.fruit_of(index, i, field));
        let fruit = (0..fruit_rows.len()).flat_map(|i| (0..fruit::FORCE).map(move |field| one(i, field)));
        links.chain(fruit).collect()
    }

    /// Last words of a world's operations.
    pub fn last_words(&self, index: usize) -> Vec<u32> {
        (0..self.places[index].rows.len()).map(|segment| self.operation_of(index, segment)[3]).collect()
    }
}
