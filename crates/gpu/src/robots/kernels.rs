//! Kernels and buffers of robots.

use wgpu::{BufferBindingType, BufferUsages, ComputePipeline};

use super::table::Table;
use crate::buffers::{allocated, check_limits, create_buffer};
use crate::device::{Gpu, GpuError};
use crate::layout::LANES;
use crate::shader;

/// Kind of a pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum RobotPass {
    /// Advances a frame.
    Frame,
    /// Resets marked worlds.
    Reset,
}

/// Compiled kernels of robots: one for all robots, whose joints are data.
#[derive(Debug)]
pub(crate) struct RobotPipelines {
    frame: ComputePipeline,
    reset: ComputePipeline,
    bindings: wgpu::BindGroupLayout,
}

impl RobotPipelines {
    /// Compiles the kernels.
    pub fn new(device: &wgpu::Device) -> Self {
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("robots"),
            source: wgpu::ShaderSource::Wgsl(shader::source_of_robots().into()),
        });
        let kinds = [
            BufferBindingType::Uniform,
            BufferBindingType::Storage { read_only: true },
            BufferBindingType::Storage { read_only: false },
        ];
        let entries: Vec<_> = (0..)
            .zip(kinds)
            .map(|(binding, ty)| wgpu::BindGroupLayoutEntry {
                binding,
                visibility: wgpu::ShaderStages::COMPUTE,
                ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
                count: None,
            })
            .collect();
        let bindings = device
            .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries });
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &[Some(&bindings)],
            immediate_size: 0,
        });
        let pipeline = |entry| {
            device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(entry),
                layout: Some(&layout),
                module: &module,
                entry_point: Some(entry),
                compilation_options: Default::default(),
                cache: None,
            })
        };
        Self { frame: pipeline("robot_frame"), reset: pipeline("robot_reset"), bindings }
    }
}

/// Buffers of a batch of robots.
#[derive(Debug)]
pub(super) struct RobotBuffers {
    pub robots: wgpu::Buffer,
    commands: wgpu::Buffer,
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
        check_limits(gpu, worlds, largest, groups)?;
        let copied = BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::COPY_SRC;
        let of_worlds = |some: usize| {
            let part = |bytes: usize| bytes / groups.max(1) * some.div_ceil(LANES);
            [("robots", part(size_of_val(states))), ("commands", part(4 * commands))]
                .map(|(label, bytes)| create_buffer(gpu, label, bytes, copied))
        };
        let each = (size_of_val(states) + 4 * commands) / worlds.max(1);
        let [robots, commands] = allocated(gpu, worlds, each, of_worlds)?;
        let uniform = BufferUsages::UNIFORM | BufferUsages::COPY_DST;
        let constants = create_buffer(gpu, "robot", size_of::<Table>(), uniform);
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
        Ok(Self { robots, commands, bindings, groups: groups as u32 })
    }

    pub fn send_commands(&self, gpu: &Gpu, commands: &[f32]) {
        gpu.queue.write_buffer(&self.commands, 0, bytemuck::cast_slice(commands));
    }

    /// Submits a pass some times.
    pub fn run(&self, gpu: &Gpu, kind: RobotPass, times: usize) {
        if self.groups == 0 {
            return;
        }
        let pipelines = gpu.robot_pipelines();
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_bind_group(0, &self.bindings, &[]);
        pass.set_pipeline(match kind {
            RobotPass::Frame => &pipelines.frame,
            RobotPass::Reset => &pipelines.reset,
        });
        for _ in 0..times {
            pass.dispatch_workgroups(self.groups, 1, 1);
        }
        drop(pass);
        gpu.queue.submit([encoder.finish()]);
    }
}
