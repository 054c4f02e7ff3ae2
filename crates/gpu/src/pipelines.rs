//! The kernels, compiled for a device.

use std::sync::OnceLock;

use wgpu::{ComputePipeline, PipelineCompilationOptions, PipelineLayout, ShaderModule};

use crate::laws::Laws;
use crate::shader;

/// One pipeline for each kind of pass and each set of laws, compiled at its first use.
#[derive(Debug)]
pub(crate) struct Pipelines {
    device: wgpu::Device,
    module: ShaderModule,
    layout: PipelineLayout,
    /// Layout of their bindings.
    pub bindings: wgpu::BindGroupLayout,
    /// Compiled pipelines, by laws and kind of pass.
    compiled: [[OnceLock<ComputePipeline>; Pass::ALL.len()]; Laws::COUNT],
}

/// Kind of a pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Pass {
    /// Advances a frame by elimination.
    Frame,
    /// Advances a frame by conjugate gradients.
    Conjugate,
    /// Applies the events that the tests of a frame have found.
    Events,
    /// Resets marked worlds.
    Reset,
    /// Sets the air of worlds whose wind begins.
    Begin,
    /// Settles marked worlds into their equilibrium.
    Settle,
    /// Measures energies.
    Measure,
    /// Draws marked worlds from the base.
    Vary,
    /// Goes inwards through a substep of worlds with a robot.
    Inward,
    /// Goes outwards through it, after the contacts.
    Outward,
}

impl Pass {
    const ALL: [Self; 10] = [
        Self::Frame,
        Self::Conjugate,
        Self::Events,
        Self::Reset,
        Self::Begin,
        Self::Settle,
        Self::Measure,
        Self::Vary,
        Self::Inward,
        Self::Outward,
    ];

    /// Entry point, and the constants that specialise it.
    fn entry(self) -> (&'static str, &'static [(&'static str, f64)]) {
        match self {
            Self::Frame => ("frame", &[]),
            Self::Conjugate => ("conjugate", &[("CONJUGATE", 1.0)]),
            Self::Events => ("apply_events", &[]),
            Self::Reset => ("reset", &[]),
            Self::Begin => ("begin_wind", &[]),
            Self::Settle => ("frame", &[("SETTLES", 1.0)]),
            Self::Measure => ("measure", &[]),
            Self::Vary => ("vary", &[]),
            Self::Inward => ("substep_inward", &[]),
            Self::Outward => ("substep_outward", &[]),
        }
    }
}

impl Pipelines {
    /// Reads the kernels' source.
    pub fn new(device: &wgpu::Device) -> Self {
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("orchard"),
            source: wgpu::ShaderSource::Wgsl(shader::source().into()),
        });
        let bindings = binding_layout(device);
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &[Some(&bindings)],
            immediate_size: 0,
        });
        Self {
            device: device.clone(),
            layout,
            module,
            bindings,
            compiled: [const { [const { OnceLock::new() }; Pass::ALL.len()] }; Laws::COUNT],
        }
    }

    /// Pipeline of a pass under some laws.
    pub fn of(&self, pass: Pass, laws: Laws) -> &ComputePipeline {
        self.compiled[laws.index()][pass as usize].get_or_init(|| {
            let (entry, constants) = pass.entry();
            let blows = laws.wind && matches!(pass, Pass::Frame | Pass::Conjugate);
            let blowing: &[_] = if blows { &[("BLOWS", 1.0)] } else { &[] };
            let constants = &[constants, &laws.constants(), blowing].concat();
            self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(entry),
                layout: Some(&self.layout),
                module: &self.module,
                entry_point: Some(entry),
                compilation_options: PipelineCompilationOptions {
                    constants,
                    zero_initialize_workgroup_memory: false,
                },
                cache: None,
            })
        })
    }
}

/// Layout of the bindings: the rules with a dynamic offset, then the buffers in the order of `kernels/memory.wgsl`.
fn binding_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    // Tiles, and forces or the table, are read-only.
    let storage = [true, false, false, false, false, false, false, true]
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
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries })
}
