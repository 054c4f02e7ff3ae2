//! The kernels of images, compiled for a device.

use orchard_camera::Label;
use orchard_camera::picture::{figures, recipe};
use wgpu::{BufferBindingType, ComputePipeline};

use super::pictures::table;
use super::solids::CORNERS;
use crate::pipelines::Kernels;

/// Columns and rows of the tile of a workgroup, and its threads: our own choice. Two words of workgroup memory a pixel.
pub(super) const TILE: (usize, usize) = (64, 32);
const THREADS: usize = 128;
/// Threads of a workgroup of the kernel `bound`.
pub(super) const BOUND_THREADS: usize = 64;
/// Threads of a workgroup of the kernels of pictures.
pub(super) const PICTURE_THREADS: usize = 64;
/// Pixels of a tile up to which one thread draws a solid alone, and number of solids that all threads of a tile draw together: our own choice.
const ALONE: usize = 32;
const WIDE_MOST: usize = 512;

/// Compiled kernels of images.
#[derive(Debug)]
pub(crate) struct ImagePipelines {
    pub(super) bound: ComputePipeline,
    pub(super) draw: ComputePipeline,
    /// Lights pictures, and packs their bytes.
    pub(super) light: ComputePipeline,
    pub(super) pack: ComputePipeline,
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
        let pictures = Kernels::new(device, "pictures", pictures(), &buffers);
        Self {
            light: pictures.pipeline("light", &[]),
            pack: pictures.pipeline("pack", &[]),
            bound: kernels.pipeline("bound", &[]),
            draw: kernels.pipeline("draw", &[]),
            bindings: kernels.bindings,
        }
    }
}

fn constants(all: &[(&str, usize)]) -> String {
    all.iter().map(|(name, value)| format!("const {name}: u32 = {value}u;\n")).collect()
}

fn source() -> String {
    let constants = constants(&[
        ("TILE_WIDTH", TILE.0),
        ("TILE_HEIGHT", TILE.1),
        ("TILE_PIXELS", TILE.0 * TILE.1),
        ("THREADS", THREADS),
        ("BOUND_THREADS", BOUND_THREADS),
        ("ALONE", ALONE),
        ("WIDE_MOST", WIDE_MOST),
        ("BLADE_CORNERS", CORNERS),
    ]);
    let files = [
        include_str!("../kernels/image.wgsl"),
        include_str!("../kernels/image_bounds.wgsl"),
        include_str!("../kernels/image_draw.wgsl"),
    ];
    constants + &files.concat()
}

/// Source of the kernels of pictures, with the figures of the processor's.
fn pictures() -> String {
    let constants = constants(&[
        ("BLADE_CORNERS", CORNERS),
        ("PICTURE_THREADS", PICTURE_THREADS),
        ("NOISE_VALUES", table::VALUES),
        ("NOISE_ORDER", table::ORDER),
        ("SKY_DIRECTIONS", table::DIRECTIONS),
        ("SHOT_QUADS", table::SHOT),
        ("ITEM_QUADS", table::ITEM),
        ("MOST_SHARES", recipe::MOST_SHARES),
        ("FRUIT", Label::Fruit.number()),
        ("LEAF", Label::Leaf.number()),
        ("WOOD", Label::Wood.number()),
        ("ROBOT", Label::Robot.number()),
        ("GROUND", Label::Ground.number()),
        ("SCENERY", Label::Scenery.number()),
    ]);
    let numbers = figures::NUMBERS.iter().map(|(name, value)| format!("const {name}: f32 = {value:?};\n"));
    let vectors = figures::VECTORS
        .iter()
        .map(|(name, v)| format!("const {name} = vec3f({:?}, {:?}, {:?});\n", v.x, v.y, v.z));
    let files = [
        include_str!("../kernels/image.wgsl"),
        include_str!("../kernels/picture.wgsl"),
        include_str!("../kernels/picture_light.wgsl"),
        include_str!("../kernels/picture_material.wgsl"),
    ];
    constants + &numbers.chain(vectors).collect::<String>() + &files.concat()
}
