//! Worlds on a device.

use std::ops::Range;
use std::sync::Arc;

use orchard_batch::{BatchEvent, Plant, Status, TreeEvent, TreeWorld};
use orchard_geometry::Vec3;
use orchard_multibody::Data;
use wgpu::{BufferUsages, util::DeviceExt};

use crate::device::{Gpu, GpuError};
use crate::layout::{LANES, fruit, link, notice, world};
use crate::memory::Memory;
use crate::rules::Rules;
use crate::shader;

/// Frames that go to the device at once: each has its own rules, of which the frame's number differs.
const FRAMES_AT_ONCE: u32 = 64;
/// Distance of their rules in the uniform buffer [bytes]: what every adapter can do.
const RULES_APART: u64 = 256;
/// Forces that a world can have on its links at once, unless asked otherwise.
pub const PUSHES_EACH: usize = 4;

/// Tree worlds that advance together on a graphics device. Their state stays there; what is asked for is read.
///
/// The result of a world does not depend on the others or on their number.
#[derive(Debug)]
pub struct GpuBatch {
    gpu: Gpu,
    plants: Vec<Arc<Plant>>,
    memory: Memory,
    buffers: Buffers,
    frame: wgpu::ComputePipeline,
    mend: wgpu::ComputePipeline,
    bindings: wgpu::BindGroup,
    /// What has been reported of each world: snapped, detached, stopped.
    reported: Vec<[u32; 3]>,
    inputs_changed: bool,
}

#[derive(Debug)]
struct Buffers {
    rules: wgpu::Buffer,
    tiles: wgpu::Buffer,
    operations: wgpu::Buffer,
    states: wgpu::Buffer,
    links: wgpu::Buffer,
    fruit: wgpu::Buffer,
    work: wgpu::Buffer,
    worlds: wgpu::Buffer,
    pushes: wgpu::Buffer,
}

impl GpuBatch {
    /// Takes over the state and the applied forces of some worlds. Counts of frames over a limit start anew.
    ///
    /// # Errors
    /// The worlds do not step alike, one is broken already, or they do not fit into the device.
    pub fn new(gpu: &Gpu, worlds: &[TreeWorld]) -> Result<Self, GpuError> {
        Self::with_pushes(gpu, worlds, PUSHES_EACH)
    }

    /// The same with room for so many forces on links in each world.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_pushes(gpu: &Gpu, worlds: &[TreeWorld], pushes_each: usize) -> Result<Self, GpuError> {
        let memory = Memory::new(worlds, pushes_each.max(1))?;
        let buffers = Buffers::new(gpu, &memory)?;
        let layout = binding_layout(gpu);
        let bindings = buffers.bind(gpu, &layout);
        let device = &gpu.device;
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("orchard"),
            source: wgpu::ShaderSource::Wgsl(shader::source(memory.pushes_each).into()),
        });
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let pipeline = |entry: &str| {
            device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(entry),
                layout: Some(&layout),
                module: &module,
                entry_point: Some(entry),
                compilation_options: wgpu::PipelineCompilationOptions {
                    zero_initialize_workgroup_memory: false,
                    ..Default::default()
                },
                cache: None,
            })
        };
        Ok(Self {
            frame: pipeline("frame"),
            mend: pipeline("mend"),
            gpu: gpu.clone(),
            plants: worlds.iter().map(|world| world.plant().clone()).collect(),
            reported: vec![[0; 3]; worlds.len()],
            memory,
            buffers,
            bindings,
            inputs_changed: false,
        })
    }

    /// Number of worlds.
    pub fn len(&self) -> usize {
        self.memory.len()
    }

    /// Whether there is no world.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Memory on the device [bytes].
    pub fn bytes(&self) -> usize {
        self.memory.bytes()
    }

    /// Asks the device for whole frames of every world. It returns at once; whoever reads waits.
    pub fn advance(&mut self, frames: u32) {
        self.send_inputs();
        let tiles = self.memory.tile_count() as u32;
        let mut left = frames;
        while left > 0 && tiles > 0 {
            let now = left.min(FRAMES_AT_ONCE);
            let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
            let mut rules = vec![0; (RULES_APART * u64::from(now)) as usize];
            for slot in rules.chunks_mut(RULES_APART as usize) {
                self.memory.rules.frame += 1;
                slot[..size_of::<Rules>()].copy_from_slice(bytemuck::bytes_of(&self.memory.rules));
            }
            self.gpu.queue.write_buffer(&self.buffers.rules, 0, &rules);
            let mut pass = encoder.begin_compute_pass(&Default::default());
            for slot in 0..now {
                pass.set_bind_group(0, &self.bindings, &[slot * RULES_APART as u32]);
                for pipeline in [&self.frame, &self.mend] {
                    pass.set_pipeline(pipeline);
                    pass.dispatch_workgroups(tiles, 1, 1);
                }
            }
            drop(pass);
            self.gpu.queue.submit([encoder.finish()]);
            left -= now;
        }
    }

    /// Waits until all frames are done.
    ///
    /// # Errors
    /// The device was lost.
    pub fn wait(&self) -> Result<(), GpuError> {
        self.gpu.wait()
    }

    /// What has happened since the last call, by frame and world.
    ///
    /// # Errors
    /// The device was lost.
    pub fn events(&mut self) -> Result<Vec<BatchEvent>, GpuError> {
        self.fetch_worlds()?;
        let counts = |memory: &Memory, index: usize| {
            [world::SNAPPED, world::DETACHED, world::STOPPED].map(|field| memory.world_number(index, field))
        };
        let changed: Vec<usize> =
            (0..self.len()).filter(|&index| counts(&self.memory, index) != self.reported[index]).collect();
        self.fetch_state(&changed)?;
        let since = self.reported.clone();
        let mut events = Vec::new();
        for index in changed {
            let now = counts(&self.memory, index);
            let (broke, off) = self.memory.lost(index);
            let snapped =
                broke.into_iter().enumerate().map(|(segment, frame)| (frame, TreeEvent::Snapped { segment }));
            let came_off =
                off.into_iter().enumerate().map(|(fruit, frame)| (frame, TreeEvent::Detached { fruit }));
            let last = self.memory.reported_until[index];
            events.extend(
                snapped.chain(came_off).filter(|(frame, _)| *frame > last).map(|(frame, event)| BatchEvent {
                    frame,
                    world: index,
                    event,
                }),
            );
            if let (Status::Quarantined(quarantine), 0) = (self.memory.status(index), since[index][2]) {
                let event = TreeEvent::Quarantined { fault: quarantine.fault };
                events.push(BatchEvent { frame: quarantine.frame, world: index, event });
            }
            self.reported[index] = now;
            self.memory.reported_until[index] = self.memory.rules.frame;
        }
        events.sort_unstable();
        Ok(events)
    }

    /// Whether a world runs.
    ///
    /// # Errors
    /// The device was lost.
    pub fn status(&mut self, index: usize) -> Result<Status, GpuError> {
        self.fetch_worlds()?;
        self.fetch_state(&[index])?;
        Ok(self.memory.status(index))
    }

    /// What a world has gone through.
    ///
    /// # Errors
    /// The device was lost.
    pub fn statistics(&mut self) -> Result<Vec<Statistics>, GpuError> {
        self.fetch_worlds()?;
        let of = |index| Statistics {
            snapped: self.memory.world_number(index, world::SNAPPED),
            detached: self.memory.world_number(index, world::DETACHED),
            peak_moment: f32::from_bits(self.memory.world_number(index, world::PEAK)).sqrt(),
        };
        Ok((0..self.len()).map(of).collect())
    }

    /// Writes a world's state into the f64 state of its model.
    ///
    /// # Errors
    /// The device was lost.
    pub fn store(&mut self, index: usize, data: &mut Data) -> Result<(), GpuError> {
        self.fetch_state(&[index])?;
        self.memory.store(index, &self.plants[index], data);
        Ok(())
    }

    /// Sets the external force [N] at, and torque [N m] about, a segment's centre of mass until changed. Gives whether the world had room for it.
    #[must_use]
    pub fn push(&mut self, index: usize, segment: usize, force_world: Vec3, torque_world: Vec3) -> bool {
        self.inputs_changed = true;
        self.memory.push(index, segment, force_world, torque_world)
    }

    /// Sets the external force [N] on a fruit until changed.
    pub fn pull(&mut self, index: usize, fruit_index: usize, force_world: Vec3) {
        for at in self.memory.pull(index, fruit_index, force_world) {
            let bytes = self.memory.fruit[at].to_ne_bytes();
            self.gpu.queue.write_buffer(&self.buffers.fruit, 4 * at as u64, &bytes);
        }
        let at = self.memory.notice_of(index);
        self.gpu.queue.write_buffer(
            &self.buffers.worlds,
            4 * at as u64,
            &(notice::STALE as u32).to_ne_bytes(),
        );
    }

    fn send_inputs(&mut self) {
        if std::mem::take(&mut self.inputs_changed) {
            let queue = &self.gpu.queue;
            queue.write_buffer(&self.buffers.pushes, 0, bytemuck::cast_slice(&self.memory.pushes));
            queue.write_buffer(&self.buffers.operations, 0, bytemuck::cast_slice(&self.memory.operations));
        }
    }

    fn fetch_worlds(&mut self) -> Result<(), GpuError> {
        let whole = 0..self.memory.worlds.len();
        self.gpu.fetch(&mut [(&self.buffers.worlds, &mut self.memory.worlds, vec![whole])])
    }

    /// Reads links and fruit of the tiles of some worlds.
    fn fetch_state(&mut self, indices: &[usize]) -> Result<(), GpuError> {
        let mut tiles: Vec<usize> = indices.iter().map(|&index| self.memory.tile_of(index)).collect();
        tiles.sort_unstable();
        tiles.dedup();
        let ranges =
            |of: &dyn Fn(usize) -> Range<usize>| tiles.iter().map(|&tile| of(tile)).collect::<Vec<_>>();
        let rows = ranges(&|tile| self.memory.rows_of(tile));
        let fruit_rows = ranges(&|tile| self.memory.fruit_rows_of(tile));
        let times = |ranges: &[Range<usize>], each: usize| -> Vec<Range<usize>> {
            ranges.iter().map(|r| r.start * each * LANES..r.end * each * LANES).collect()
        };
        let memory = &mut self.memory;
        self.gpu.fetch(&mut [
            (&self.buffers.links, &mut memory.links, times(&rows, link::FIELDS)),
            (&self.buffers.fruit, &mut memory.fruit, times(&fruit_rows, fruit::FIELDS)),
        ])?;
        self.gpu.fetch(&mut [(&self.buffers.states, &mut memory.states, times(&rows, 1))])
    }
}

/// What a world has gone through so far.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Statistics {
    /// Joints that broke.
    pub snapped: u32,
    /// Fruit that came off.
    pub detached: u32,
    /// Largest moment of a joint at the end of any frame, over the one that breaks it.
    pub peak_moment: f32,
}

impl Buffers {
    fn new(gpu: &Gpu, memory: &Memory) -> Result<Self, GpuError> {
        let (worlds, limits) = (memory.len(), gpu.device.limits());
        let largest = [
            4 * memory.links.len(),
            4 * memory.fruit.len(),
            4 * memory.work.len(),
            16 * memory.operations.len(),
        ];
        let needed = largest.into_iter().max().unwrap_or(0) as u64;
        let has = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        if needed > has {
            return Err(GpuError::TooLarge {
                worlds,
                what: "one buffer",
                needed,
                adapter: gpu.info().name.clone(),
                has,
                fits: (u128::from(has) * worlds as u128 / u128::from(needed)) as usize / LANES * LANES,
            });
        }
        let scope = gpu.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let filled = |label: &str, contents: &[u8]| {
            gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some(label),
                // A buffer has a size.
                contents: if contents.is_empty() { &[0; 16] } else { contents },
                usage: BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::COPY_SRC,
            })
        };
        let buffers = Self {
            rules: gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("rules"),
                size: RULES_APART * u64::from(FRAMES_AT_ONCE),
                usage: BufferUsages::UNIFORM | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
            tiles: filled("tiles", bytemuck::cast_slice(&memory.tiles)),
            operations: filled("operations", bytemuck::cast_slice(&memory.operations)),
            states: filled("states", bytemuck::cast_slice(&memory.states)),
            links: filled("links", bytemuck::cast_slice(&memory.links)),
            fruit: filled("fruit", bytemuck::cast_slice(&memory.fruit)),
            work: filled("work", bytemuck::cast_slice(&memory.work)),
            worlds: filled("worlds", bytemuck::cast_slice(&memory.worlds)),
            pushes: filled("pushes", bytemuck::cast_slice(&memory.pushes)),
        };
        match pollster::block_on(scope.pop()) {
            None => Ok(buffers),
            Some(_) => Err(GpuError::OutOfMemory {
                adapter: gpu.info().name.clone(),
                worlds,
                each: memory.bytes() / worlds.max(1),
                fits: worlds / 2,
            }),
        }
    }

    fn storage(&self) -> [&wgpu::Buffer; 8] {
        [
            &self.tiles,
            &self.operations,
            &self.states,
            &self.links,
            &self.fruit,
            &self.work,
            &self.worlds,
            &self.pushes,
        ]
    }

    fn bind(&self, gpu: &Gpu, layout: &wgpu::BindGroupLayout) -> wgpu::BindGroup {
        let rules = wgpu::BindingResource::Buffer(wgpu::BufferBinding {
            buffer: &self.rules,
            offset: 0,
            size: std::num::NonZeroU64::new(size_of::<Rules>() as u64),
        });
        let storage = self.storage().map(wgpu::Buffer::as_entire_binding);
        let entries: Vec<_> = (0..)
            .zip(std::iter::once(rules).chain(storage))
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
    }
}

fn binding_layout(gpu: &Gpu) -> wgpu::BindGroupLayout {
    // Tiles, operations and pushes are only read.
    let storage = [true, true, false, false, false, false, false, true]
        .map(|read_only| (wgpu::BufferBindingType::Storage { read_only }, false));
    let all = std::iter::once((wgpu::BufferBindingType::Uniform, true)).chain(storage);
    let entries: Vec<_> = (0..)
        .zip(all)
        .map(|(binding, (ty, has_dynamic_offset))| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset, min_binding_size: None },
            count: None,
        })
        .collect();
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries })
}

/// A buffer, its copy on the host, and what of it is to be read.
type Wanted<'a, T> = (&'a wgpu::Buffer, &'a mut Vec<T>, Vec<Range<usize>>);

impl Gpu {
    /// Copies ranges of buffers to the same ranges on the host.
    fn fetch<T: bytemuck::Pod>(&self, wanted: &mut [Wanted<'_, T>]) -> Result<(), GpuError> {
        let each = size_of::<T>();
        let length: usize = wanted.iter().flat_map(|(_, _, ranges)| ranges).map(Range::len).sum();
        if length == 0 {
            return self.wait();
        }
        let staging = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("read"),
            size: (each * length) as u64,
            usage: BufferUsages::MAP_READ | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let mut at = 0;
        for (buffer, _, ranges) in wanted.iter() {
            for range in ranges {
                let (from, size) = ((each * range.start) as u64, (each * range.len()) as u64);
                encoder.copy_buffer_to_buffer(buffer, from, &staging, at, size);
                at += size;
            }
        }
        self.queue.submit([encoder.finish()]);
        // Its result is that of the wait: a device that is lost maps nothing.
        staging.slice(..).map_async(wgpu::MapMode::Read, |_| {});
        self.wait()?;
        let lost = |e: wgpu::MapRangeError| GpuError::Lost(e.to_string());
        let mapped = staging.slice(..).get_mapped_range().map_err(lost)?;
        let mut read = bytemuck::cast_slice::<u8, T>(&mapped);
        for (_, host, ranges) in wanted {
            for range in ranges {
                let (here, rest) = read.split_at(range.len());
                host[range.clone()].copy_from_slice(here);
                read = rest;
            }
        }
        Ok(())
    }
}
