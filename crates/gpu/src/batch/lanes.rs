//! Places of a batch in which worlds come and go.

use super::GpuBatch;
use crate::memory::{Scattered, Seedling};
use crate::worlds::Parcel;

impl GpuBatch {
    /// Plants trees in the places of worlds, and returns the numbers that [`Self::parcels`] are to bring there. Other worlds stay as they are on the device, and nothing waits for it.
    pub(crate) fn plant(&mut self, seedlings: Vec<(usize, Seedling)>) -> Vec<Scattered> {
        let sent = self.memory.plant(seedlings);
        self.gpu.queue.write_buffer(&self.buffers.tiles, 0, bytemuck::cast_slice(&self.memory.tiles));
        sent
    }

    /// Numbers of worlds for the buffers in which they lie.
    pub(crate) fn parcels<'a>(&'a self, worlds: &'a [Scattered]) -> [Parcel<'a>; 6] {
        let buffers = &self.buffers;
        [
            Parcel::quads(&buffers.links, worlds.iter().map(|own| &own.links)),
            Parcel::quads(&buffers.fruit, worlds.iter().map(|own| &own.fruit)),
            Parcel::quads(&buffers.work, worlds.iter().map(|own| &own.touches)),
            Parcel::quads(&buffers.operations, worlds.iter().map(|own| &own.operations)),
            Parcel::words(&buffers.states, worlds.iter().map(|own| &own.states)),
            Parcel::words(&buffers.worlds, worlds.iter().map(|own| &own.worlds)),
        ]
    }

    /// Sends the flags of a world that goes on.
    pub(crate) fn send_flags(&self, index: usize) {
        for (at, bits) in self.memory.flags_of(index) {
            self.gpu.queue.write_buffer(&self.buffers.worlds, 4 * at as u64, &bits.to_ne_bytes());
        }
    }

    /// Stops a world as of a frame: it stands still from then on.
    pub(crate) fn stop(&mut self, index: usize, frame: u32) {
        let at = self.memory.stop(index, frame);
        self.gpu.queue.write_buffer(&self.buffers.worlds, 4 * at as u64, &frame.to_ne_bytes());
    }
}
