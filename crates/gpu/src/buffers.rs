//! Buffers of a batch on the device.

use std::ops::Range;

use wgpu::BufferUsages;

use crate::device::{Gpu, GpuError};
use crate::layout::LANES;
use crate::memory::Memory;
use crate::rules::Rules;

/// Largest number of passes in one submission; each has its own rules.
pub(crate) const PASSES_AT_ONCE: usize = 64;
/// Distance between the rules of two passes in the uniform buffer [bytes]: the alignment that every adapter supports.
pub(crate) const RULES_STRIDE: usize = 256;

/// Buffer sizes are multiples of this [bytes].
const ALIGNED: u64 = 16;

/// One buffer for each of the kernels' bindings.
#[derive(Debug)]
pub(crate) struct Buffers {
    pub rules: wgpu::Buffer,
    pub tiles: wgpu::Buffer,
    pub operations: wgpu::Buffer,
    pub states: wgpu::Buffer,
    pub links: wgpu::Buffer,
    pub fruit: wgpu::Buffer,
    pub work: wgpu::Buffer,
    pub worlds: wgpu::Buffer,
    pub pushes: wgpu::Buffer,
    table: wgpu::Buffer,
}

/// Uses of a buffer of constants, which is a uniform buffer, or one of storage where the device is in software.
pub(crate) const CONSTANTS: BufferUsages =
    BufferUsages::UNIFORM.union(BufferUsages::STORAGE).union(BufferUsages::COPY_DST);

/// The last buffer that a pass binds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Use {
    /// External forces.
    Steps,
    /// The base table in their place: a ninth storage buffer is not portable.
    Varies,
}

impl Buffers {
    /// Sends the first words of the base table, which contain the episode.
    pub fn send_head(&self, gpu: &Gpu, memory: &Memory) {
        gpu.queue.write_buffer(&self.table, 0, bytemuck::cast_slice(&memory.table[..1]));
    }

    /// Allocates the buffers of a batch and sends its contents to the device.
    ///
    /// # Errors
    /// The batch does not fit into the device.
    pub fn new(gpu: &Gpu, memory: &Memory) -> Result<Self, GpuError> {
        let worlds = memory.len();
        let largest = [
            4 * memory.links.len(),
            4 * memory.fruit.len(),
            4 * memory.work.len(),
            4 * memory.pushes.len(),
            4 * memory.pushes.len(),
            16 * memory.operations.len(),
        ];
        check_limits(gpu, worlds, largest.into_iter().max().unwrap_or(0), 0, memory.tile_count())?;
        let of_worlds = |some: usize| {
            // Without worlds there is still the table of their base.
            let (some, of) = if worlds == 0 { (1, 1) } else { (some as u128, worlds as u128) };
            Self::allocate(gpu, |bytes| (bytes as u128 * some).div_ceil(of) as usize, memory)
        };
        let buffers = allocated(gpu, worlds, memory.bytes() / worlds.max(1), of_worlds)?;
        buffers.fill(gpu, memory);
        Ok(buffers)
    }

    /// Creates buffers of `size(bytes)` for the bytes of each array of the memory.
    fn allocate(gpu: &Gpu, size: impl Fn(usize) -> usize, memory: &Memory) -> Self {
        let copied = BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::COPY_SRC;
        let storage = |label, bytes: usize| create_buffer(gpu, label, size(bytes), copied);
        let rules = RULES_STRIDE * PASSES_AT_ONCE;
        Self {
            rules: create_buffer(gpu, "rules", rules, CONSTANTS),
            tiles: storage("tiles", size_of_val(&*memory.tiles)),
            operations: storage("operations", size_of_val(&*memory.operations)),
            states: storage("states", size_of_val(&*memory.states)),
            links: storage("links", size_of_val(&*memory.links)),
            fruit: storage("fruit", size_of_val(&*memory.fruit)),
            work: storage("work", size_of_val(&*memory.work)),
            worlds: storage("worlds", size_of_val(&*memory.worlds)),
            pushes: storage("pushes", size_of_val(&*memory.pushes)),
            table: storage("table", size_of_val(&*memory.table)),
        }
    }

    /// Sends the contents. The work buffer starts with zeros, as every new buffer does, where no robot touches wood.
    fn fill(&self, gpu: &Gpu, memory: &Memory) {
        if memory.laws.touched {
            gpu.queue.write_buffer(&self.work, 0, bytemuck::cast_slice(&memory.work));
        }
        for (buffer, contents) in [
            (&self.tiles, bytemuck::cast_slice(&memory.tiles)),
            (&self.operations, bytemuck::cast_slice(&memory.operations)),
            (&self.states, bytemuck::cast_slice(&memory.states)),
            (&self.links, bytemuck::cast_slice(&memory.links)),
            (&self.fruit, bytemuck::cast_slice(&memory.fruit)),
            (&self.worlds, bytemuck::cast_slice(&memory.worlds)),
            (&self.pushes, bytemuck::cast_slice(&memory.pushes)),
            (&self.table, bytemuck::cast_slice::<_, u8>(&memory.table)),
        ] {
            gpu.queue.write_buffer(buffer, 0, contents);
        }
    }

    fn storage(&self, of: Use) -> [&wgpu::Buffer; 8] {
        [
            &self.tiles,
            &self.operations,
            &self.states,
            &self.links,
            &self.fruit,
            &self.work,
            &self.worlds,
            if of == Use::Varies { &self.table } else { &self.pushes },
        ]
    }

    pub fn bind(&self, gpu: &Gpu, layout: &wgpu::BindGroupLayout, of: Use) -> wgpu::BindGroup {
        let rules = wgpu::BindingResource::Buffer(wgpu::BufferBinding {
            buffer: &self.rules,
            offset: 0,
            size: std::num::NonZeroU64::new(size_of::<Rules>() as u64),
        });
        let storage = self.storage(of).map(wgpu::Buffer::as_entire_binding);
        let entries: Vec<_> = (0..)
            .zip(std::iter::once(rules).chain(storage))
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
    }
}

/// Checks a batch against the limits of the adapter: bytes of its largest buffer, of which `shared` are needed by fewer worlds as well, and number of workgroups.
///
/// # Errors
/// It exceeds one of them; the error names the number of worlds that would fit.
pub(crate) fn check_limits(
    gpu: &Gpu,
    worlds: usize,
    largest: usize,
    shared: usize,
    groups: usize,
) -> Result<(), GpuError> {
    let limits = gpu.device.limits();
    let bytes = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    let most_groups = u64::from(limits.max_compute_workgroups_per_dimension);
    for (what, needed, shared, has) in [
        ("bytes in one buffer", largest as u64, shared as u64, bytes),
        ("workgroups", groups as u64, 0, most_groups),
    ] {
        if needed > has {
            return Err(GpuError::TooLarge {
                worlds,
                what,
                needed,
                adapter: gpu.info().name.clone(),
                has,
                fits: fitting(worlds, needed, shared, has),
            });
        }
    }
    Ok(())
}

/// Number of worlds, in whole blocks, that fit where some need more than there is. All need the shared part.
fn fitting(worlds: usize, needed: u64, shared: u64, has: u64) -> usize {
    let [needed, has] = [needed, has].map(|bytes| u128::from(bytes.saturating_sub(shared)));
    (has * worlds as u128 / needed.max(1)) as usize / LANES * LANES
}

/// Creates a buffer of at least some bytes.
pub(crate) fn create_buffer(gpu: &Gpu, label: &str, bytes: usize, usage: BufferUsages) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        // A buffer must not be empty.
        size: (bytes as u64).next_multiple_of(ALIGNED).max(ALIGNED),
        usage,
        mapped_at_creation: false,
    })
}

/// Allocates the buffers of a batch by `of_worlds`, which creates those of a number of worlds; `each` is the memory of a world [bytes].
///
/// # Errors
/// The device has no room for them; the error names a number of worlds for which it has.
pub(crate) fn allocated<T>(
    gpu: &Gpu,
    worlds: usize,
    each: usize,
    of_worlds: impl Fn(usize) -> T,
) -> Result<T, GpuError> {
    let attempt = |worlds: usize| {
        let scope = gpu.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let buffers = of_worlds(worlds);
        pollster::block_on(scope.pop()).is_none().then_some(buffers)
    };
    attempt(worlds).ok_or_else(|| {
        // wgpu does not report free memory, so the number of worlds is halved until the allocation succeeds.
        let halves = std::iter::successors(Some(worlds / 2), |half| Some(half / 2));
        let fits = halves.take_while(|half| *half > 0).find(|half| {
            // The buffers of the failed attempt are released first; a lost device has no room at all.
            gpu.wait().is_ok() && attempt(*half).is_some()
        });
        GpuError::OutOfMemory { adapter: gpu.info().name.clone(), worlds, each, fits: fits.unwrap_or(0) }
    })
}

/// A buffer, its copy on the host, and the ranges to read.
pub(crate) type Wanted<'a, T> = (&'a wgpu::Buffer, &'a mut Vec<T>, Vec<Range<usize>>);

impl Gpu {
    /// Copies ranges of buffers to the same ranges on the host, after waiting for all submitted work.
    pub(crate) fn fetch<T: bytemuck::Pod>(&self, wanted: &mut [Wanted<'_, T>]) -> Result<(), GpuError> {
        let ranges = wanted.iter().flat_map(|(buffer, _, ranges)| {
            let buffer: &wgpu::Buffer = buffer;
            ranges.iter().map(move |range| (buffer, range.clone()))
        });
        let read = self.read::<T>(&ranges.collect::<Vec<_>>())?;
        let mut read = &*read;
        for (_, host, ranges) in wanted {
            for range in ranges {
                let (here, rest) = read.split_at(range.len());
                host[range.clone()].copy_from_slice(here);
                read = rest;
            }
        }
        Ok(())
    }

    /// Reads ranges of buffers, one after the other, after waiting for all submitted work.
    pub(crate) fn read<T: bytemuck::Pod>(
        &self,
        wanted: &[(&wgpu::Buffer, Range<usize>)],
    ) -> Result<Vec<T>, GpuError> {
        let each = size_of::<T>();
        let length: usize = wanted.iter().map(|(_, range)| range.len()).sum();
        if length == 0 {
            return self.wait().map(|()| Vec::new());
        }
        let staging = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("read"),
            size: (each * length) as u64,
            usage: BufferUsages::MAP_READ | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let mut at = 0;
        for (buffer, range) in wanted {
            let (from, size) = ((each * range.start) as u64, (each * range.len()) as u64);
            encoder.copy_buffer_to_buffer(buffer, from, &staging, at, size);
            at += size;
        }
        self.queue.submit([encoder.finish()]);
        // The wait reports the result: a lost device maps nothing.
        staging.slice(..).map_async(wgpu::MapMode::Read, |_| {});
        self.wait()?;
        let lost = |e: wgpu::MapRangeError| GpuError::Lost(e.to_string());
        let mapped = staging.slice(..).get_mapped_range().map_err(lost)?;
        Ok(bytemuck::cast_slice::<u8, T>(&mapped).to_vec())
    }
}

#[cfg(test)]
mod tests {
    use super::fitting;

    /// The number of worlds that an error names fits; the next block does not.
    #[test]
    fn as_many_fit_as_an_error_names() {
        let needed = |worlds: u64, shared: u64| shared + 1_000 * worlds;
        for shared in [0, 50_000_000] {
            let has = 100_000_000;
            let fits = fitting(200_000, needed(200_000, shared), shared, has) as u64;
            assert!(needed(fits, shared) <= has && needed(fits + 32, shared) > has, "{shared}: {fits}");
        }
        assert_eq!(fitting(64, 2_000, 1_500, 1_000), 0);
    }
}
