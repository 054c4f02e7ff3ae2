//! The kernels of images, compiled for a device.

use wgpu::{BufferBindingType, ComputePipeline};

use super::solids::CORNERS;
use crate::pipelines::Kernels;

/// Columns and rows of the tile of a workgroup, and its threads: our own choice. Two words of workgroup memory a pixel.
pub(super) const TILE: (usize, usize) = (64, 32);
const THREADS: usize = 128;
/// Threads of a workgroup of the kernel `bound`.
pub(super) const BOUND_THREADS: usize = 64;
/// Pixels of a tile up to which one thread draws a solid alone, and number of solids that all threads of a tile draw together: our own choice.
const ALONE: usize = 32;
const WIDE_MOST: usize = 512;

/// Compiled kernels of images.
#[derive(Debug)]
pub(crate) struct ImagePipelines {
    pub(super) bound: ComputePipeline,
    pub(super) draw: ComputePipeline,
    /// Layout of their bindings, in the order of `kernels/image.wgsl`.
    pub(super) bindings: wgpu::BindGroupLayout,
}

impl ImagePipelines {
    /// Compiles the kernels.
    pub fn new(device: &wgpu::Device) -> Self {
        let read = (BufferBindingType::Storage { read_only: true }, false);
        let written = (BufferBindingType::Storage { read_only: false }, false);
        // Views, solids, corners, bodies; posed solids, rectangles, depths, items.
        let buffers = [read, read, read, read, written, written, written, written];
        let kernels = Kernels::new(device, "images", source(), &buffers);
        Self {
            bound: kernels.pipeline("bound", &[]),
            draw: kernels.pipeline("draw", &[]),
            bindings: kernels.bindings,
        }
    }
}

fn source() -> String {
    let constants = [
        ("TILE_WIDTH", TILE.0),
        ("TILE_HEIGHT", TILE.1),
        ("TILE_PIXELS", TILE.0 * TILE.1),
        ("THREADS", THREADS),
        ("BOUND_THREADS", BOUND_THREADS),
        ("ALONE", ALONE),
        ("WIDE_MOST", WIDE_MOST),
        ("BLADE_CORNERS", CORNERS),
    ];
    let constants = constants.map(|(name, value)| format!("const {name}: u32 = {value}u;\n"));
    let files = [
        include_str!("../kernels/image.wgsl"),
        include_str!("../kernels/image_bounds.wgsl"),
        include_str!("../kernels/image_draw.wgsl"),
    ];
    constants.concat() + &files.concat()
}
