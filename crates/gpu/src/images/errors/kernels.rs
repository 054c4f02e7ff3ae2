//! The kernels of a camera's errors, compiled for a device.

use orchard_camera::TimeOfFlightErrors;
use wgpu::{BufferBindingType, ComputePipeline};

use super::law::BLOCK_WORDS;
use super::model::{Kind, Model};
use crate::device::Gpu;
use crate::pipelines::Kernels;

/// Threads of a workgroup of each kernel, our own choice.
const WHITE_THREADS: usize = 64;
const DOWN_THREADS: usize = 64;
const ROW_THREADS: usize = 128;
const FAULT_THREADS: usize = 64;
const PIXEL_THREADS: usize = 128;
/// Rows that a thread of the kernel `down` marches, our own choice.
const DOWN_ROWS: usize = 32;

/// Workgroups of a pass: along an image, and down it; images are the other number.
#[derive(Debug, Clone, Copy)]
enum Grid {
    /// All of an image along the first axis, images along the second, and a number of fields along the third.
    Flat(usize, usize),
    /// Columns, rows, and images along the third axis.
    Pixels(usize, usize),
    /// The faults of an image along the first axis, images along the second.
    Faults,
}

/// Compiled kernels in the order in which they run.
#[derive(Debug)]
pub(super) struct ErrorKernels {
    pub bindings: wgpu::BindGroupLayout,
    passes: Vec<(ComputePipeline, Grid)>,
}

impl ErrorKernels {
    /// Compiles the kernels of a camera; `white` is the number of random words of an image.
    pub fn new(gpu: &Gpu, model: &Model, white: usize) -> Self {
        let read = (BufferBindingType::Storage { read_only: true }, false);
        let written = (BufferBindingType::Storage { read_only: false }, false);
        // Law, images, faults, exact depths; memory, marks; table; measured depths.
        let buffers = [read, read, read, read, written, written, read, written];
        let kernels = Kernels::new(&gpu.device, "errors", source(model), &buffers);
        let ((width, height), (radius, averages)) = (model.size(), model.fields());
        let pixels = |(width, height): (usize, usize)| Grid::Pixels(width.div_ceil(PIXEL_THREADS), height);
        let all = pixels((width, height));
        let wide = width + 2 * radius * averages.iter().max().unwrap_or(&1);
        let down = wide.div_ceil(4 * DOWN_THREADS) * height.div_ceil(DOWN_ROWS);
        let mut list = vec![
            ("white", Grid::Flat(white.div_ceil(BLOCK_WORDS * WHITE_THREADS), 1)),
            ("down", Grid::Flat(down, averages.len())),
        ];
        let camera = model.covered.as_ref().map(|covered| pixels(covered.size()));
        match (&model.errors, camera) {
            (Kind::Stereo(_), camera) => {
                let first = [
                    ("pairs", Grid::Flat(height, 1)),
                    ("refuse", Grid::Faults),
                    ("take", all),
                    ("ramp", all),
                ];
                list.extend(first);
                match camera {
                    None => list.push(("finish", all)),
                    Some(camera) => list.extend([("place", all), ("show", camera)]),
                }
            }
            (Kind::TimeOfFlight(_), None) => list.extend([("light", all), ("blur", all), ("sense", all)]),
            (Kind::TimeOfFlight(_), Some(camera)) => {
                list.extend([
                    ("light", all),
                    ("blur", all),
                    ("keep", all),
                    ("bridge", all),
                    ("reveal", camera),
                ]);
            }
        }
        let passes = list.into_iter().map(|(name, grid)| (kernels.pipeline(name, &[]), grid)).collect();
        Self { bindings: kernels.bindings, passes }
    }

    /// Records the passes of some images, of which one has `most_faults` at most.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        bindings: &wgpu::BindGroup,
        images: usize,
        most_faults: usize,
    ) {
        for (kernel, grid) in &self.passes {
            let [x, y, z] = match *grid {
                Grid::Faults => [most_faults.div_ceil(FAULT_THREADS), images, 1],
                Grid::Flat(groups, fields) => [groups, images, fields],
                Grid::Pixels(columns, rows) => [columns, rows, images],
            };
            if x * y * z > 0 {
                let mut pass = encoder.begin_compute_pass(&Default::default());
                pass.set_bind_group(0, bindings, &[]);
                pass.set_pipeline(kernel);
                pass.dispatch_workgroups(x as u32, y as u32, z as u32);
            }
        }
    }
}

fn source(model: &Model) -> String {
    let (radius, averages) = model.fields();
    let (ramp, blur) = match &model.errors {
        Kind::Stereo(errors) => (errors.edge_ramp, 0),
        Kind::TimeOfFlight(errors) => (0, errors.blur.len()),
    };
    let constants = [
        ("RADIUS", radius),
        // Of all fields but the first.
        ("LATER_AVERAGES", averages.last().copied().unwrap_or(1)),
        ("RAMP", ramp),
        ("BLUR", blur),
        ("RAYS", TimeOfFlightErrors::RAYS),
        ("BLOCK_WORDS", BLOCK_WORDS),
        ("COLUMNS", model.size().0),
        ("WHITE_THREADS", WHITE_THREADS),
        ("DOWN_THREADS", DOWN_THREADS),
        ("DOWN_ROWS", DOWN_ROWS),
        ("ROW_THREADS", ROW_THREADS),
        ("FAULT_THREADS", FAULT_THREADS),
        ("PIXEL_THREADS", PIXEL_THREADS),
    ];
    let constants = constants.map(|(name, value)| format!("const {name}: u32 = {value}u;\n"));
    // The rounds of ChaCha; the streams behind them are those of axes.
    let chacha = include_str!("../../kernels/chacha.wgsl");
    let rounds = chacha.split_once("fn block_of").map_or(chacha, |(rounds, _)| rounds);
    let head =
        [include_str!("../../kernels/errors.wgsl"), rounds, include_str!("../../kernels/errors_fields.wgsl")];
    let steps = match &model.errors {
        Kind::Stereo(_) => [
            include_str!("../../kernels/errors_stereo.wgsl"),
            include_str!("../../kernels/errors_register.wgsl"),
        ],
        Kind::TimeOfFlight(_) => [include_str!("../../kernels/errors_flight.wgsl"), ""],
    };
    constants.concat() + &head.concat() + &steps.concat()
}
