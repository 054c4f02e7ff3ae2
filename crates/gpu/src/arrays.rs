//! Arrays that lie on the device, for whoever reads them there.

use orchard_tensor::{ExportedBuffer, Handle};
use wgpu::BufferUsages;

use crate::buffers::{allocated, create_buffer};
use crate::device::{Gpu, GpuError};

/// Bytes of a word, in which the queue writes.
const WORD: usize = wgpu::COPY_BUFFER_ALIGNMENT as usize;

/// An array on the device, a row a world. Other programs' interfaces can share its memory ([`Self::take_handle`]).
#[derive(Debug)]
pub struct DeviceArray {
    gpu: Gpu,
    pub(crate) buffer: wgpu::Buffer,
    handle: Option<Handle>,
    rows: usize,
    row_bytes: usize,
}

impl DeviceArray {
    /// Makes an array of zeros; `shared`: in memory that others can open.
    ///
    /// # Errors
    /// The device has no room, or cannot share memory.
    pub fn new(
        gpu: &Gpu,
        label: &str,
        rows: usize,
        row_bytes: usize,
        shared: bool,
    ) -> Result<Self, GpuError> {
        let bytes = rows * row_bytes;
        let limits = gpu.device.limits();
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let adapter = || gpu.info().name.clone();
        if bytes as u64 > most {
            return Err(GpuError::TooLarge {
                worlds: rows,
                what: "bytes in one buffer",
                needed: bytes as u64,
                adapter: adapter(),
                has: most,
                fits: (most as usize) / row_bytes,
            });
        }
        let (buffer, handle) = if shared {
            let made = ExportedBuffer::new(&gpu.device, &gpu.queue, label, bytes as u64);
            let made = made.map_err(|why| GpuError::Unshared { adapter: adapter(), why })?;
            (made.buffer, Some(made.handle))
        } else {
            let usage = BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::COPY_SRC;
            let make = |rows: usize| create_buffer(gpu, label, rows * row_bytes, usage);
            (allocated(gpu, rows, row_bytes, make)?, None)
        };
        Ok(Self { gpu: gpu.clone(), buffer, handle, rows, row_bytes })
    }

    /// Takes the handle of the memory, by which another interface opens it; none if it is not shared, or was taken.
    pub fn take_handle(&mut self) -> Option<Handle> {
        self.handle.take()
    }

    /// Bytes of all rows.
    pub fn bytes(&self) -> usize {
        self.rows * self.row_bytes
    }

    /// Writes all rows, once the queue comes to it.
    ///
    /// # Panics
    /// There are not as many bytes.
    pub fn write(&self, bytes: &[u8]) {
        assert_eq!(bytes.len(), self.bytes(), "bytes of an array");
        let (words, rest) = bytes.split_at(bytes.len() / WORD * WORD);
        self.gpu.queue.write_buffer(&self.buffer, 0, words);
        if !rest.is_empty() {
            let mut last = [0; WORD];
            last[..rest.len()].copy_from_slice(rest);
            self.gpu.queue.write_buffer(&self.buffer, words.len() as u64, &last);
        }
    }

    /// Writes a row, once the queue comes to it.
    ///
    /// # Panics
    /// There are not as many numbers, or no such row, or it has not whole words.
    pub fn write_row<T: bytemuck::NoUninit>(&self, row: usize, numbers: &[T]) {
        self.assert_row(row, size_of_val(numbers));
        self.gpu.queue.write_buffer(
            &self.buffer,
            (row * self.row_bytes) as u64,
            bytemuck::cast_slice(numbers),
        );
    }

    /// Sets a row of 32-bit numbers to zero, after what was submitted before.
    ///
    /// # Panics
    /// There is no such row, or it has not whole words.
    pub fn clear_row(&self, row: usize) {
        self.assert_row(row, self.row_bytes);
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        encoder.clear_buffer(&self.buffer, (row * self.row_bytes) as u64, Some(self.row_bytes as u64));
        self.gpu.queue.submit([encoder.finish()]);
    }

    /// Panics unless there is a row, and has as many bytes, which are whole words.
    pub(crate) fn assert_row(&self, row: usize, bytes: usize) {
        assert!(
            self.row_bytes.is_multiple_of(WORD),
            "rows of {} bytes, which are not whole words",
            self.row_bytes
        );
        assert!(row < self.rows && bytes == self.row_bytes, "row {row} of {}, of {bytes} bytes", self.rows);
    }

    /// Reads all rows, after waiting for all submitted work.
    ///
    /// # Errors
    /// The device was lost.
    pub fn read(&self) -> Result<Vec<u8>, GpuError> {
        let words = self.bytes().div_ceil(WORD);
        let mut bytes = bytemuck::pod_collect_to_vec(&self.gpu.read::<u32>(&[(&self.buffer, 0..words)])?);
        bytes.truncate(self.bytes());
        Ok(bytes)
    }
}

impl Gpu {
    /// Submits what was written into arrays, and waits until all submitted work is done.
    ///
    /// # Errors
    /// The device was lost.
    pub fn finish(&self) -> Result<(), GpuError> {
        self.queue.submit([]);
        self.wait()
    }
}
