//! Quads of a buffer that the host reads in every frame, or writes now and then, wherever they lie.

use wgpu::{BufferUsages, ComputePipeline};

use crate::buffers::create_buffer;
use crate::device::{Gpu, GpuError};
use crate::layout::QUAD;

/// Threads of a workgroup of `kernels/quads.wgsl`: as many as the kernels of trees ask of a device.
const THREADS: usize = 192;
/// Place of a quad that is not there.
pub(super) const NOWHERE: u32 = u32::MAX;

/// Quads of a buffer at places that stay for some time.
#[derive(Debug)]
pub(super) struct Gathered {
    places: wgpu::Buffer,
    packed: wgpu::Buffer,
    staging: wgpu::Buffer,
    bindings: wgpu::BindGroup,
    count: usize,
    /// As they were read last.
    pub quads: Vec<[f32; QUAD]>,
}

impl Gathered {
    /// Lists `count` places of a buffer, all nowhere.
    pub fn new(gpu: &Gpu, of: &wgpu::Buffer, count: usize) -> Self {
        let storage = BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::COPY_SRC;
        let places = create_buffer(gpu, "places", 4 * count, storage);
        gpu.queue.write_buffer(&places, 0, &vec![0xff; 4 * count]);
        let packed = create_buffer(gpu, "packed", 16 * count, storage);
        let read = BufferUsages::MAP_READ | BufferUsages::COPY_DST;
        let staging = create_buffer(gpu, "staging", 16 * count, read);
        let bindings = bound(gpu, &places, of, &packed);
        Self { places, packed, staging, bindings, count, quads: vec![[0.0; QUAD]; count] }
    }

    /// Sets some successive places.
    pub fn set_places(&self, gpu: &Gpu, first: usize, places: &[u32]) {
        gpu.queue.write_buffer(&self.places, 4 * first as u64, bytemuck::cast_slice(places));
    }

    /// Submits the reading.
    pub fn submit(&self, gpu: &Gpu) {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        run(&mut encoder, &gpu.quad_pipelines().gather, &self.bindings, self.count);
        encoder.copy_buffer_to_buffer(&self.packed, 0, &self.staging, 0, 16 * self.count as u64);
        gpu.queue.submit([encoder.finish()]);
        // A lost device is reported by the wait.
        self.staging.slice(..16 * self.count as u64).map_async(wgpu::MapMode::Read, |_| {});
    }

    /// Takes what was read, after the wait for it.
    ///
    /// # Errors
    /// The device was lost.
    pub fn take(&mut self) -> Result<(), GpuError> {
        let slice = self.staging.slice(..16 * self.count as u64);
        let mapped = slice.get_mapped_range().map_err(|e| GpuError::Lost(e.to_string()))?;
        self.quads.copy_from_slice(bytemuck::cast_slice(&mapped));
        drop(mapped);
        self.staging.unmap();
        Ok(())
    }
}

/// Writes quads to places of a buffer.
pub(super) fn scatter(gpu: &Gpu, to: &wgpu::Buffer, quads: &[(u32, [f32; QUAD])]) {
    if quads.is_empty() {
        return;
    }
    let (places, values): (Vec<u32>, Vec<[f32; QUAD]>) = quads.iter().copied().unzip();
    let storage = BufferUsages::STORAGE | BufferUsages::COPY_DST;
    let list = create_buffer(gpu, "places", 4 * places.len(), storage);
    let packed = create_buffer(gpu, "packed", 16 * values.len(), storage);
    // The buffers are a little longer than the lists: what lies behind them goes nowhere.
    let mut padded = places;
    padded.resize(padded.len().next_multiple_of(QUAD), NOWHERE);
    gpu.queue.write_buffer(&list, 0, bytemuck::cast_slice(&padded));
    gpu.queue.write_buffer(&packed, 0, bytemuck::cast_slice(&values));
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    run(&mut encoder, &gpu.quad_pipelines().scatter, &bound(gpu, &list, to, &packed), padded.len());
    gpu.queue.submit([encoder.finish()]);
}

fn bound(gpu: &Gpu, places: &wgpu::Buffer, of: &wgpu::Buffer, packed: &wgpu::Buffer) -> wgpu::BindGroup {
    let entries: Vec<_> = (0..)
        .zip([places, of, packed])
        .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
        .collect();
    let layout = &gpu.quad_pipelines().bindings;
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
}

fn run(
    encoder: &mut wgpu::CommandEncoder,
    kernel: &ComputePipeline,
    bindings: &wgpu::BindGroup,
    count: usize,
) {
    let mut pass = encoder.begin_compute_pass(&Default::default());
    pass.set_bind_group(0, bindings, &[]);
    pass.set_pipeline(kernel);
    pass.dispatch_workgroups(count.div_ceil(THREADS) as u32, 1, 1);
}
