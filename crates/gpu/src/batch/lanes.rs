//! Places of a batch in which worlds come and go.

use super::GpuBatch;
use crate::memory::{Scattered, Seedling};
use crate::worlds::{scatter, scatter_words};

impl GpuBatch {
    /// Plants trees in the places of worlds. Other worlds stay as they are on the device, and nothing waits for it.
    pub(crate) fn plant(&mut self, seedlings: Vec<(usize, Seedling)>) {
        let sent = self.memory.plant(seedlings);
        self.send(&sent);
        self.gpu.queue.write_buffer(&self.buffers.tiles, 0, bytemuck::cast_slice(&self.memory.tiles));
    }

    /// Writes numbers to their places.
    pub(crate) fn send(&self, numbers: &Scattered) {
        let (gpu, buffers) = (&self.gpu, &self.buffers);
        let Scattered { links, fruit, touches, operations, states, worlds } = numbers;
        scatter(gpu, &buffers.links, links);
        scatter(gpu, &buffers.fruit, fruit);
        scatter(gpu, &buffers.work, touches);
        scatter(gpu, &buffers.operations, operations);
        scatter_words(gpu, &buffers.states, states);
        scatter_words(gpu, &buffers.worlds, worlds);
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
