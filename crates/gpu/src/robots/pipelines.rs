//! The kernels of robots, compiled for a device.

use wgpu::{BufferBindingType, ComputePipeline};

use crate::shader;

/// Kind of a pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RobotPass {
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
    /// Layout of their bindings: the table, commands, states.
    pub bindings: wgpu::BindGroupLayout,
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

    /// Pipeline of a pass.
    pub fn of(&self, pass: RobotPass) -> &ComputePipeline {
        match pass {
            RobotPass::Frame => &self.frame,
            RobotPass::Reset => &self.reset,
        }
    }
}
