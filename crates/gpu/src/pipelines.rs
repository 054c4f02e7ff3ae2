//! The kernels, compiled for a device.

use std::sync::OnceLock;

use wgpu::{ComputePipeline, PipelineCompilationOptions, PipelineLayout, ShaderModule};

use crate::buffers::binding_layout;
use crate::shader;

/// One pipeline for each thing that a pass can do. What not every batch needs is compiled when it is first asked for.
#[derive(Debug)]
pub(crate) struct Pipelines {
    device: wgpu::Device,
    module: ShaderModule,
    layout: PipelineLayout,
    /// What they bind.
    pub bindings: wgpu::BindGroupLayout,
    /// By pass.
    compiled: [OnceLock<ComputePipeline>; Pass::ALL.len()],
}

/// What every tile does at once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Pass {
    /// A frame.
    Frame,
    /// A frame by conjugate gradients.
    Conjugate,
    /// What its tests found.
    Mend,
    /// Worlds back to their beginning.
    Reset,
    /// Steps to their equilibrium.
    Settle,
    /// Energies.
    Measure,
    /// Worlds drawn anew from the base.
    Vary,
}

impl Pass {
    const ALL: [Self; 7] =
        [Self::Frame, Self::Conjugate, Self::Mend, Self::Reset, Self::Settle, Self::Measure, Self::Vary];

    /// Its entry point, and the constants that make it what it is.
    fn entry(self) -> (&'static str, &'static [(&'static str, f64)]) {
        match self {
            Self::Frame => ("frame", &[]),
            Self::Conjugate => ("conjugate", &[("CONJUGATE", 1.0)]),
            Self::Mend => ("mend", &[]),
            Self::Reset => ("reset", &[]),
            Self::Settle => ("frame", &[("SETTLES", 1.0)]),
            Self::Measure => ("measure", &[]),
            Self::Vary => ("vary", &[]),
        }
    }
}

impl Pipelines {
    /// Compiles what every batch needs.
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
        let pipelines = Self {
            device: device.clone(),
            layout,
            module,
            bindings,
            compiled: [const { OnceLock::new() }; Pass::ALL.len()],
        };
        // Every batch steps: nobody should wait for this in the first frame.
        for pass in [Pass::Frame, Pass::Mend] {
            pipelines.of(pass);
        }
        pipelines
    }

    /// The pipeline of a pass.
    pub fn of(&self, pass: Pass) -> &ComputePipeline {
        self.compiled[pass as usize].get_or_init(|| {
            let (entry, constants) = pass.entry();
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
