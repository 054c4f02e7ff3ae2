//! Quads of a buffer that the host reads in every frame, wherever they lie.

use rayon::prelude::*;
use wgpu::{BufferUsages, ComputePipeline};

use crate::buffers::create_buffer;
use crate::clock::Clock;
use crate::device::{Gpu, GpuError};
use crate::layout::QUAD;

/// Threads of a workgroup of `kernels/quads.wgsl`: as many as the kernels of trees ask of a device.
const THREADS: usize = 192;
/// Bytes of a quad.
const QUAD_BYTES: usize = 4 * QUAD;
/// Quads that a thread copies at once: 64 kB, our own choice.
const COPIED: usize = 4096;
/// Place of a quad that is not there.
pub(super) const NOWHERE: u32 = u32::MAX;

/// Quads of buffers at places that stay for some time, which are read together as they are at some instants: one copy an instant, one wait.
#[derive(Debug)]
pub(super) struct Gathered {
    sections: Vec<Section>,
    packed: wgpu::Buffer,
    staging: wgpu::Buffer,
    /// Quads of an instant.
    each: usize,
    /// As they were read last, instant by instant, section by section.
    quads: Vec<[f32; QUAD]>,
}

/// Places of one buffer.
#[derive(Debug)]
struct Section {
    places: wgpu::Buffer,
    bindings: wgpu::BindGroup,
    /// First of its quads among all, and their number.
    first: usize,
    count: usize,
}

impl Gathered {
    /// Lists numbers of places of buffers, all nowhere, to be read at up to so many instants.
    pub fn new(gpu: &Gpu, of: &[(&wgpu::Buffer, usize)], instants: usize) -> Self {
        let storage = BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::COPY_SRC;
        // A section begins where a buffer may be bound.
        let step = gpu.device.limits().min_storage_buffer_offset_alignment as usize / QUAD_BYTES;
        let ends = of.iter().scan(0, |end, (_, count)| {
            *end = (*end + count).next_multiple_of(step.max(1));
            Some(*end)
        });
        let ends: Vec<usize> = ends.collect();
        let each = ends.last().copied().unwrap_or(0);
        let packed = create_buffer(gpu, "packed", QUAD_BYTES * each, storage);
        let read = BufferUsages::MAP_READ | BufferUsages::COPY_DST;
        let staging = create_buffer(gpu, "staging", QUAD_BYTES * each * instants, read);
        let firsts = std::iter::once(0).chain(ends);
        let sections = of.iter().zip(firsts).map(|(&(buffer, count), first)| {
            let places = create_buffer(gpu, "places", 4 * count, storage);
            gpu.queue.write_buffer(&places, 0, &vec![0xff; 4 * count]);
            let bindings = bound(gpu, &places, buffer, packed_from(&packed, first));
            Section { places, bindings, first, count }
        });
        let (sections, quads) = (sections.collect(), vec![[0.0; QUAD]; each * instants]);
        Self { sections, packed, staging, each, quads }
    }

    /// Sets some successive places of a section.
    pub fn set_places(&self, gpu: &Gpu, section: usize, first: usize, places: &[u32]) {
        gpu.queue.write_buffer(
            &self.sections[section].places,
            4 * first as u64,
            bytemuck::cast_slice(places),
        );
    }

    /// Quads of a section at an instant, as they were read last.
    pub fn section(&self, instant: usize, section: usize) -> &[[f32; QUAD]] {
        let Section { first, count, .. } = self.sections[section];
        &self.quads[instant * self.each + first..][..count]
    }

    /// Encodes the copy of all quads at an instant.
    pub fn encode(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        instant: usize,
        clock: &mut Option<Clock>,
    ) {
        for section in &self.sections {
            let stamps = clock.as_mut().and_then(|clock| clock.stamp("gather"));
            let gather = &gpu.quad_pipelines().gather;
            run(encoder, gather, &section.bindings, section.count, stamps);
        }
        let bytes = (QUAD_BYTES * self.each) as u64;
        encoder.copy_buffer_to_buffer(&self.packed, 0, &self.staging, instant as u64 * bytes, bytes);
    }

    fn staged(&self, instants: usize) -> wgpu::BufferSlice<'_> {
        self.staging.slice(..(QUAD_BYTES * self.each * instants) as u64)
    }

    /// Maps the copies of some instants, which were submitted. A lost device is reported by the wait.
    pub fn map(&self, instants: usize) {
        self.staged(instants).map_async(wgpu::MapMode::Read, |_| {});
    }

    /// Takes the copies of some instants out of the mapped buffer, after the wait for their submission.
    ///
    /// # Errors
    /// The device was lost.
    pub fn take(&mut self, instants: usize) -> Result<(), GpuError> {
        let view = self.staged(instants).get_mapped_range().map_err(|e| GpuError::Lost(e.to_string()))?;
        let mapped: &[[f32; QUAD]] = bytemuck::cast_slice(&view);
        let quads = &mut self.quads[..mapped.len()];
        let parts = quads.par_chunks_mut(COPIED).zip(mapped.par_chunks(COPIED));
        parts.for_each(|(here, there)| here.copy_from_slice(there));
        drop(view);
        self.staging.unmap();
        Ok(())
    }
}

/// A buffer of packed quads from one of them on.
fn packed_from(packed: &wgpu::Buffer, first: usize) -> wgpu::BindingResource<'_> {
    let offset = (QUAD_BYTES * first) as u64;
    wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer: packed, offset, size: None })
}

fn bound(
    gpu: &Gpu,
    places: &wgpu::Buffer,
    of: &wgpu::Buffer,
    packed: wgpu::BindingResource<'_>,
) -> wgpu::BindGroup {
    let resources = [places.as_entire_binding(), of.as_entire_binding(), packed];
    let entries: Vec<_> =
        (0..).zip(resources).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
    let layout = &gpu.quad_pipelines().bindings;
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
}

fn run(
    encoder: &mut wgpu::CommandEncoder,
    kernel: &ComputePipeline,
    bindings: &wgpu::BindGroup,
    count: usize,
    timestamp_writes: Option<wgpu::ComputePassTimestampWrites<'_>>,
) {
    let timed = wgpu::ComputePassDescriptor { label: None, timestamp_writes };
    let mut pass = encoder.begin_compute_pass(&timed);
    pass.set_bind_group(0, bindings, &[]);
    pass.set_pipeline(kernel);
    pass.dispatch_workgroups(count.div_ceil(THREADS) as u32, 1, 1);
}
