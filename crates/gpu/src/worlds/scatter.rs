//! Numbers that the host writes now and then, wherever they lie.

use rayon::prelude::*;
use wgpu::{BufferUsages, ComputePipeline};

use crate::buffers::create_buffer;
use crate::device::Gpu;
use crate::memory::{PlacedQuad, PlacedWord};

/// Threads of a workgroup of `kernels/scatter.wgsl`.
const THREADS: usize = 192;

/// Numbers for one buffer, in lists.
pub(crate) struct Parcel<'a> {
    to: &'a wgpu::Buffer,
    is_of_words: bool,
    lists: Vec<&'a [u8]>,
}

impl<'a> Parcel<'a> {
    /// Quads for a buffer.
    pub fn quads(to: &'a wgpu::Buffer, lists: impl Iterator<Item = &'a Vec<PlacedQuad>>) -> Self {
        let lists = lists.map(|list| bytemuck::cast_slice(list)).collect();
        Self { to, is_of_words: false, lists }
    }

    /// Words for a buffer.
    pub fn words(to: &'a wgpu::Buffer, lists: impl Iterator<Item = &'a Vec<PlacedWord>>) -> Self {
        let lists = lists.map(|list| bytemuck::cast_slice(list)).collect();
        Self { to, is_of_words: true, lists }
    }

    fn bytes(&self) -> usize {
        self.lists.iter().map(|list| list.len()).sum()
    }
}

/// Buffer through which records go to the device. It is kept, and replaced when it is too small.
#[derive(Debug, Default)]
pub(crate) struct Records(Option<wgpu::Buffer>);

impl Records {
    /// The buffer, with room for so many bytes.
    fn with_room(&mut self, gpu: &Gpu, bytes: usize) -> &wgpu::Buffer {
        let usage = BufferUsages::STORAGE | BufferUsages::COPY_DST;
        let has_room = |kept: &wgpu::Buffer| kept.size() >= bytes as u64;
        let kept = self.0.take().filter(has_room);
        self.0.insert(kept.unwrap_or_else(|| create_buffer(gpu, "records", bytes.next_power_of_two(), usage)))
    }
}

/// Writes numbers to places of buffers, all of them in one submission, by way of a buffer of records.
pub(crate) fn scatter(gpu: &Gpu, records: &mut Records, parcels: &[Parcel<'_>]) {
    let parcels: Vec<&Parcel<'_>> = parcels.iter().filter(|parcel| parcel.bytes() > 0).collect();
    if parcels.is_empty() {
        return;
    }
    // A parcel begins where a buffer may be bound.
    let step = gpu.device.limits().min_storage_buffer_offset_alignment as usize;
    let room = |parcel: &Parcel<'_>| parcel.bytes().next_multiple_of(step);
    let mut bytes = vec![0_u8; parcels.iter().map(|parcel| room(parcel)).sum()];
    let (mut rest, mut copies) = (&mut bytes[..], Vec::new());
    for parcel in &parcels {
        let (mut own, behind) = rest.split_at_mut(room(parcel));
        rest = behind;
        for list in &parcel.lists {
            let (to, left) = own.split_at_mut(list.len());
            own = left;
            copies.push((to, *list));
        }
    }
    copies.into_par_iter().for_each(|(to, list)| to.copy_from_slice(list));
    let records = records.with_room(gpu, bytes.len());
    gpu.queue.write_buffer(records, 0, &bytes);
    let pipelines = gpu.quad_pipelines();
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_compute_pass(&Default::default());
    let mut offset = 0;
    for parcel in parcels {
        let (kernel, each): (&ComputePipeline, usize) = if parcel.is_of_words {
            (&pipelines.scatter_words, size_of::<PlacedWord>())
        } else {
            (&pipelines.scatter_quads, size_of::<PlacedQuad>())
        };
        let size = std::num::NonZeroU64::new(parcel.bytes() as u64);
        let own = wgpu::BufferBinding { buffer: records, offset, size };
        let resources = [wgpu::BindingResource::Buffer(own), parcel.to.as_entire_binding()];
        let entries = (0..).zip(resources);
        let entries: Vec<_> =
            entries.map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
        let layout = &pipelines.scatter_bindings;
        let bound = wgpu::BindGroupDescriptor { label: None, layout, entries: &entries };
        pass.set_bind_group(0, &gpu.device.create_bind_group(&bound), &[]);
        pass.set_pipeline(kernel);
        pass.dispatch_workgroups((parcel.bytes() / each).div_ceil(THREADS) as u32, 1, 1);
        offset += room(parcel) as u64;
    }
    drop(pass);
    gpu.queue.submit([encoder.finish()]);
}
