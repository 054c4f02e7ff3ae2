//! Masks of depth images on the device.

use wgpu::{BindGroupDescriptor, BindGroupEntry, BufferBindingType, ComputePipeline};

use crate::arrays::DeviceArray;
use crate::device::Gpu;
use crate::pipelines::Kernels;

/// Threads of a workgroup: our own choice.
const THREADS: u32 = 128;
/// Pixels of a word.
const PIXELS: usize = 4;

/// Marks which pixels of depth images have a depth: an array of bytes beside one of depths.
#[derive(Debug)]
pub struct DepthMask {
    gpu: Gpu,
    kernel: ComputePipeline,
    bindings: wgpu::BindGroup,
    /// Workgroups along x and y.
    groups: [u32; 2],
}

impl DepthMask {
    /// Prepares the masks of an array of depths (f32) in an array of as many bytes.
    ///
    /// # Panics
    /// The arrays have not the same number of pixels.
    pub fn new(gpu: &Gpu, depths: &DeviceArray, masks: &DeviceArray) -> Self {
        assert_eq!(depths.bytes(), size_of::<f32>() * masks.bytes(), "bytes of depths and masks");
        let source =
            format!("const MASK_THREADS: u32 = {THREADS}u;\n") + include_str!("../kernels/image_mask.wgsl");
        let storage = |read_only| (BufferBindingType::Storage { read_only }, false);
        let kernels = Kernels::new(&gpu.device, "masks", source, &[storage(true), storage(false)]);
        let entries = [(0, depths), (1, masks)]
            .map(|(binding, array)| BindGroupEntry { binding, resource: array.buffer.as_entire_binding() });
        let descriptor = BindGroupDescriptor { label: None, layout: &kernels.bindings, entries: &entries };
        let bindings = gpu.device.create_bind_group(&descriptor);
        let groups = masks.bytes().div_ceil(PIXELS).div_ceil(THREADS as usize) as u32;
        let wide = gpu.device.limits().max_compute_workgroups_per_dimension.min(groups).max(1);
        let groups = [wide, groups.div_ceil(wide)];
        Self { gpu: gpu.clone(), kernel: kernels.pipeline("mask", &[]), bindings, groups }
    }

    /// Marks all images, after what was submitted before.
    pub fn mark(&self) {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_bind_group(0, &self.bindings, &[]);
            pass.set_pipeline(&self.kernel);
            pass.dispatch_workgroups(self.groups[0], self.groups[1], 1);
        }
        self.gpu.queue.submit([encoder.finish()]);
    }
}
