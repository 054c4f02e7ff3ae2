//! Numbers with their places in a buffer, as records that the device reads.

use bytemuck::{Pod, Zeroable};

use crate::layout::QUAD;

/// A quad with its place in a buffer, which counts quads.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct PlacedQuad {
    pub at: u32,
    pub bits: [u32; QUAD],
}

/// A word with its place in a buffer.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct PlacedWord {
    pub at: u32,
    pub bits: u32,
}

impl PlacedQuad {
    /// A quad at a place.
    pub fn new<T: Pod>(at: u32, quad: [T; QUAD]) -> Self {
        Self { at, bits: bytemuck::cast(quad) }
    }
}
