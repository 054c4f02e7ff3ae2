//! Buffers of a batch of robots.

use wgpu::BufferUsages;

use super::pipelines::RobotPass;
use super::table::Table;
use crate::buffers::{CONSTANTS, allocated, check_limits, create_buffer};
use crate::device::{Gpu, GpuError};
use crate::layout::LANES;

/// Buffers of a batch of robots.
#[derive(Debug)]
pub(crate) struct RobotBuffers {
    pub robots: wgpu::Buffer,
    pub commands: wgpu::Buffer,
    /// The table.
    pub constants: wgpu::Buffer,
    bindings: wgpu::BindGroup,
    groups: u32,
}

impl RobotBuffers {
    /// Allocates the buffers of a batch and sends its table and states.
    ///
    /// # Errors
    /// The batch does not fit into the device.
    pub fn new(gpu: &Gpu, table: &Table, states: &[f32], commands: usize) -> Result<Self, GpuError> {
        let worlds = table.worlds as usize;
        let groups = worlds.div_ceil(LANES);
        let largest = size_of_val(states).max(4 * commands);
        check_limits(gpu, worlds, largest, 0, groups)?;
        let copied = BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::COPY_SRC;
        let of_worlds = |some: usize| {
            let part = |bytes: usize| bytes / groups.max(1) * some.div_ceil(LANES);
            [("robots", part(size_of_val(states))), ("commands", part(4 * commands))]
                .map(|(label, bytes)| create_buffer(gpu, label, bytes, copied))
        };
        let each = (size_of_val(states) + 4 * commands) / worlds.max(1);
        let [robots, commands] = allocated(gpu, worlds, each, of_worlds)?;
        let constants = create_buffer(gpu, "robot", size_of::<Table>(), CONSTANTS);
        gpu.queue.write_buffer(&constants, 0, bytemuck::bytes_of(table));
        gpu.queue.write_buffer(&robots, 0, bytemuck::cast_slice(states));
        let entries: Vec<_> = (0..)
            .zip([&constants, &commands, &robots])
            .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
            .collect();
        let layout = &gpu.robot_pipelines().bindings;
        let bindings = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout,
            entries: &entries,
        });
        Ok(Self { robots, commands, constants, bindings, groups: groups as u32 })
    }

    pub fn send_commands(&self, gpu: &Gpu, commands: &[f32]) {
        gpu.queue.write_buffer(&self.commands, 0, bytemuck::cast_slice(commands));
    }

    /// Submits a pass some times.
    pub fn run(&self, gpu: &Gpu, kind: RobotPass, times: usize) {
        if self.groups == 0 {
            return;
        }
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_bind_group(0, &self.bindings, &[]);
        pass.set_pipeline(gpu.robot_pipelines().of(kind));
        for _ in 0..times {
            pass.dispatch_workgroups(self.groups, 1, 1);
        }
        drop(pass);
        gpu.queue.submit([encoder.finish()]);
    }
}
