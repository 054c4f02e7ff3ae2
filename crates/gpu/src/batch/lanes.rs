//! Places of a batch in which worlds come and go.

use super::GpuBatch;
use crate::device::GpuError;
use crate::layout::LANES;
use crate::memory::Memory;

impl GpuBatch {
    /// Changes the memory of the blocks of some worlds: reads them, and sends them back after the change.
    pub(crate) fn change(
        &mut self,
        indices: &[usize],
        change: impl FnOnce(&mut Memory),
    ) -> Result<(), GpuError> {
        self.fetch_worlds()?;
        self.fetch_state(indices)?;
        let touches = self.memory.touches_of(indices);
        self.gpu.fetch(&mut [(&self.buffers.work, &mut self.memory.work, touches.clone())])?;
        change(&mut self.memory);
        let (queue, memory, buffers) = (&self.gpu.queue, &self.memory, &self.buffers);
        let each = memory.laws.fruit_fields() * LANES;
        for block in memory.blocks_of(indices) {
            let rows = block.rows.start * LANES..block.rows.end * LANES;
            let fruit = block.fruit_rows.start * each..block.fruit_rows.end * each;
            for (buffer, numbers, from) in
                [(&buffers.links, &memory.links, block.links), (&buffers.fruit, &memory.fruit, fruit)]
            {
                queue.write_buffer(buffer, 4 * from.start as u64, bytemuck::cast_slice(&numbers[from]));
            }
            let at = rows.start as u64;
            queue.write_buffer(&buffers.states, 4 * at, bytemuck::cast_slice(&memory.states[rows.clone()]));
            let operations = bytemuck::cast_slice(&memory.operations[rows]);
            queue.write_buffer(&buffers.operations, 16 * at, operations);
        }
        for range in touches {
            let numbers = bytemuck::cast_slice(&memory.work[range.clone()]);
            queue.write_buffer(&buffers.work, 4 * range.start as u64, numbers);
        }
        queue.write_buffer(&buffers.tiles, 0, bytemuck::cast_slice(&memory.tiles));
        queue.write_buffer(&buffers.worlds, 0, bytemuck::cast_slice(&memory.worlds));
        Ok(())
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
