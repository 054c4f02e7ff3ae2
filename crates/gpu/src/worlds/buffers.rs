//! Buffers of whole worlds besides those of their trees and robots.

use wgpu::BufferUsages;

use super::table::WorldTable;
use crate::batch::GpuBatch;
use crate::buffers::{allocated, check_limits, create_buffer};
use crate::device::{Gpu, GpuError};
use crate::robots::RobotBatch;
use crate::rules::Rules;

/// Buffers of whole worlds, and the bindings of their kernels.
#[derive(Debug)]
pub(super) struct WorldBuffers {
    pub meetings: wgpu::Buffer,
    pub tables: wgpu::Buffer,
    /// Those with the commands of each frame that are sent at once.
    pub bindings: Vec<wgpu::BindGroup>,
}

impl WorldBuffers {
    /// Allocates the buffers and sends the table. The other one starts with zeros, as every new buffer does.
    ///
    /// # Errors
    /// The batch does not fit into the device.
    pub fn new(
        gpu: &Gpu,
        table: &WorldTable,
        trees: &GpuBatch,
        robots: &RobotBatch,
    ) -> Result<Self, GpuError> {
        let worlds = trees.len();
        let meetings = table.meetings(worlds);
        check_limits(gpu, worlds, 4 * meetings.max(table.words.len()), 4 * table.on_desks(worlds), worlds)?;
        let copied = BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::COPY_SRC;
        let of_worlds = |some: usize| {
            let words = table.words.len() * some / worlds;
            [
                create_buffer(gpu, "meetings", 4 * table.meetings(some), copied),
                create_buffer(gpu, "tables", 4 * words, copied),
                create_buffer(gpu, "taken", 4, BufferUsages::STORAGE),
            ]
        };
        let each = 4 * (meetings + table.words.len()) / worlds;
        let [meetings, tables, taken] = allocated(gpu, worlds, each, of_worlds)?;
        gpu.queue.write_buffer(&tables, 0, bytemuck::cast_slice(&table.words));
        let (of_trees, of_robots) = (&trees.buffers, &robots.buffers);
        let rules = wgpu::BindingResource::Buffer(wgpu::BufferBinding {
            buffer: &of_trees.rules,
            offset: 0,
            size: std::num::NonZeroU64::new(size_of::<Rules>() as u64),
        });
        let size = 4 * robots.words_of_commands() as u64;
        let of_frame = |frame: u64| {
            let commands = wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                buffer: &of_robots.commands,
                offset: frame * size,
                size: std::num::NonZeroU64::new(size),
            });
            let [constants, robots] =
                [&of_robots.constants, &of_robots.robots].map(wgpu::Buffer::as_entire_binding);
            let after = [&tables, &meetings, &of_trees.work, &of_trees.fruit, &of_trees.worlds, &taken];
            let resources = [constants, commands, robots, rules.clone()].into_iter();
            let resources = resources.chain(after.map(wgpu::Buffer::as_entire_binding));
            let entries: Vec<_> = (0..)
                .zip(resources)
                .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
                .collect();
            let layout = &gpu.world_pipelines(trees.memory.laws).bindings;
            gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: None,
                layout,
                entries: &entries,
            })
        };
        let frames = of_robots.commands.size() / size.max(1);
        let bindings = (0..frames).map(of_frame).collect();
        Ok(Self { meetings, tables, bindings })
    }
}
