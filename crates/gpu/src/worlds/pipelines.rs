//! The kernels of whole worlds, compiled for a device.

use wgpu::{BufferBindingType, ComputePipeline};

use crate::pipelines::Pass;
use crate::shader;

/// Kind of a pass of whole worlds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum WorldPass {
    /// A pass of the trees.
    Trees(Pass),
    /// First half of the robots' substep.
    RobotBegin,
    /// Contacts.
    Meet,
    /// Second half of the robots' substep.
    RobotEnd,
}

/// Compiled kernels of whole worlds, but for those of their trees.
#[derive(Debug)]
pub(crate) struct WorldPipelines {
    pub robot_begin: ComputePipeline,
    pub meet: ComputePipeline,
    pub robot_end: ComputePipeline,
    /// Layout of their bindings, in the order of `kernels/robot.wgsl` and `kernels/world.wgsl`.
    pub bindings: wgpu::BindGroupLayout,
}

impl WorldPipelines {
    /// Compiles the kernels.
    pub fn new(device: &wgpu::Device) -> Self {
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("worlds"),
            source: wgpu::ShaderSource::Wgsl(shader::source_of_worlds().into()),
        });
        let read = BufferBindingType::Storage { read_only: true };
        let written = BufferBindingType::Storage { read_only: false };
        let uniform = BufferBindingType::Uniform;
        // Robot, commands, robots; rules; tables, meetings; works, fruit, worlds.
        let kinds = [uniform, read, written, uniform, read, written, written, written, written];
        const RULES: u32 = 3;
        let entries: Vec<_> = (0..)
            .zip(kinds)
            .map(|(binding, ty)| wgpu::BindGroupLayoutEntry {
                binding,
                visibility: wgpu::ShaderStages::COMPUTE,
                ty: wgpu::BindingType::Buffer {
                    ty,
                    has_dynamic_offset: binding == RULES,
                    min_binding_size: None,
                },
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
                compilation_options: wgpu::PipelineCompilationOptions {
                    zero_initialize_workgroup_memory: false,
                    ..Default::default()
                },
                cache: None,
            })
        };
        Self {
            robot_begin: pipeline("robot_begin"),
            meet: pipeline("meet"),
            robot_end: pipeline("robot_end"),
            bindings,
        }
    }
}
