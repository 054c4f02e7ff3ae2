//! The kernels, compiled for a device.

use std::sync::OnceLock;

use wgpu::{
    BufferBindingType, ComputePipeline, DeviceType, PipelineCompilationOptions, PipelineLayout, ShaderModule,
};

use crate::laws::Laws;
pub(crate) use crate::passes::Pass;
use crate::shader;

/// One pipeline for each kind of pass and each set of laws, compiled at its first use.
#[derive(Debug)]
pub(crate) struct Pipelines {
    pub kernels: Kernels,
    /// Compiled pipelines, by laws and kind of pass.
    compiled: [[OnceLock<ComputePipeline>; Pass::ALL.len()]; Laws::COUNT],
}

impl Pipelines {
    /// Reads the kernels' source.
    pub fn new(device: &wgpu::Device) -> Self {
        // The rules, then the buffers in the order of `kernels/memory.wgsl`: tiles, and forces or the table, are read-only.
        let storage = [true, false, false, false, false, false, false, true]
            .map(|read_only| (BufferBindingType::Storage { read_only }, false));
        let buffers: Vec<_> = std::iter::once((BufferBindingType::Uniform, true)).chain(storage).collect();
        Self {
            kernels: Kernels::new(device, "orchard", shader::source(), &buffers),
            compiled: [const { [const { OnceLock::new() }; Pass::ALL.len()] }; Laws::COUNT],
        }
    }

    /// Pipeline of a pass under some laws.
    pub fn of(&self, pass: Pass, laws: Laws) -> &ComputePipeline {
        self.compiled[laws.index()][pass as usize]
            .get_or_init(|| self.kernels.pipeline(pass.entry(), &pass.constants(laws)))
    }
}

/// True if adapters of a kind run in software on the processor.
pub(crate) fn is_software(kind: DeviceType) -> bool {
    kind == DeviceType::Cpu
}

/// A module of kernels, all with the same bindings.
#[derive(Debug)]
pub(crate) struct Kernels {
    device: wgpu::Device,
    module: ShaderModule,
    layout: PipelineLayout,
    /// Layout of their bindings.
    pub bindings: wgpu::BindGroupLayout,
}

impl Kernels {
    /// Reads their source. They bind buffers of some types, in this order; one marked true has an offset that is given with each dispatch.
    pub fn new(
        device: &wgpu::Device,
        label: &'static str,
        source: String,
        buffers: &[(BufferBindingType, bool)],
    ) -> Self {
        // Mesa's driver in software compiles a kernel whose branches depend on uniforms anew in every dispatch (`docs/decisions/0036-constants-in-storage.md`).
        let stores = is_software(device.adapter_info().device_type);
        let source = if stores { source.replace("var<uniform>", "var<storage, read>") } else { source };
        let module = without_loop_counters(
            device,
            wgpu::ShaderModuleDescriptor {
                label: Some(label),
                source: wgpu::ShaderSource::Wgsl(source.into()),
            },
        );
        let entries: Vec<_> = (0..)
            .zip(buffers)
            .map(|(binding, &(ty, has_dynamic_offset))| {
                let is_stored = stores && ty == BufferBindingType::Uniform;
                let ty = if is_stored { BufferBindingType::Storage { read_only: true } } else { ty };
                wgpu::BindGroupLayoutEntry {
                    binding,
                    visibility: wgpu::ShaderStages::COMPUTE,
                    ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset, min_binding_size: None },
                    count: None,
                }
            })
            .collect();
        let bindings = device
            .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries });
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &[Some(&bindings)],
            immediate_size: 0,
        });
        Self { device: device.clone(), module, layout, bindings }
    }

    /// Compiles the kernel of a name, specialised by constants. Memory of its workgroups is not set to zero: kernels write what they read.
    pub fn pipeline(&self, entry: &str, constants: &[(&str, f64)]) -> ComputePipeline {
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
    }
}

/// Reads a source without the counters that `wgpu` puts into every loop against loops without end, which cost a third of the time of some kernels (`docs/decisions/0034-kernels-without-loop-counters.md`).
/// All other checks stay: no kernel reads or writes outside of its buffers.
#[expect(unsafe_code, reason = "the one promise to `wgpu` that all loops end")]
fn without_loop_counters(device: &wgpu::Device, source: wgpu::ShaderModuleDescriptor<'_>) -> ShaderModule {
    let checks =
        wgpu::ShaderRuntimeChecks { force_loop_bounding: false, ..wgpu::ShaderRuntimeChecks::checked() };
    // SAFETY: every loop of our kernels counts up or down to a number that is fixed before it, takes one bit after the other from a word, or goes from a link to its parent, which comes before it.
    unsafe { device.create_shader_module_trusted(source, checks) }
}
