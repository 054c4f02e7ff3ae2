//! A camera's figures and its memory on the device, as `kernels/errors.wgsl` reads them.

use orchard_camera::{CoveredPixels, ImageKey, StereoErrors, TimeOfFlightErrors};
use orchard_spec::{Purpose, Stream};

use super::model::{Kind, Model, steps};
use crate::layout::QUAD;

/// Random words that a thread makes: a block of ChaCha.
pub(super) const BLOCK_WORDS: usize = 16;

/// Figures of a camera.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct Law {
    pub size: [u32; 2],
    /// Words of memory and of marks of an image.
    pub words: u32,
    pub marks: u32,
    pub white: [u32; 4],
    pub down: [u32; 3],
    pub bit_columns: u32,
    pub disparity: u32,
    pub along: u32,
    pub taken: u32,
    pub ramp: u32,
    pub noise_centre: i32,
    pub shift_centre: i32,
    pub noise_scale: f32,
    pub shift_scale: f32,
    pub focal_baseline: f32,
    pub surface_step: f32,
    pub disparity_sd: f32,
    pub disparity_step: f32,
    pub edge_shift: f32,
    pub least_support: f32,
    pub edge_limit: f32,
    pub near: f32,
    pub far: f32,
    pub zero: u32,
    pub camera: [u32; 2],
    pub first_steps: u32,
    pub table_steps: u32,
    pub light: u32,
    pub blurred: u32,
    pub least_light: f32,
    pub reach_spread: f32,
    pub noise_floor: f32,
    pub noise_at_metre: f32,
    pub mixing: f32,
    pub bridge: f32,
    pub zoom: [f32; 2],
    pub moved: [f32; 2],
    pub parallax: f32,
    pub unused: u32,
}

/// An image.
#[repr(C)]
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct Shot {
    pub pixels: u32,
    pub measured: u32,
    pub faults: u32,
    pub fault_count: u32,
    pub number: [u32; 2],
    pub unused: [u32; 2],
    pub key: [u32; 8],
}

impl Shot {
    /// An image's random stream; its places are not set.
    pub fn of(key: ImageKey) -> Self {
        let bytes = Stream::key(key.seed, Purpose::SensorNoise);
        let word = |k: usize| u32::from_le_bytes(std::array::from_fn(|i| bytes[4 * k + i]));
        Self {
            pixels: 0,
            measured: 0,
            faults: 0,
            fault_count: 0,
            number: [key.world, key.frame],
            unused: [0; 2],
            key: std::array::from_fn(word),
        }
    }
}

impl Law {
    /// Figures of a camera, and its table.
    pub fn of(model: &Model) -> (Self, Vec<u32>) {
        let (width, height) = model.size();
        let camera = model.covered.as_ref().map_or((0, 0), CoveredPixels::size);
        let of_fields = Self {
            size: [width as u32, height as u32],
            camera: [camera.0 as u32, camera.1 as u32],
            marks: (camera.0 * camera.1) as u32,
            ..Self::of_fields(model)
        };
        match &model.errors {
            Kind::Stereo(errors) => of_fields.stereo(errors, model.covered.as_ref()),
            Kind::TimeOfFlight(errors) => of_fields.time_of_flight(errors, model.covered.as_ref()),
        }
    }

    /// Places of the random fields.
    fn of_fields(model: &Model) -> Self {
        let ((width, height), (radius, averages)) = (model.size(), model.fields());
        let (mut white, mut down) = ([0; 4], [0; 3]);
        let mut words = 0;
        for (first, averages) in white.iter_mut().zip(averages) {
            let margin = 2 * averages * radius;
            *first = words as u32;
            words += ((width + margin) * (height + margin)).div_ceil(4);
        }
        white[3] = words as u32;
        // Whole blocks, and the word behind the last bytes.
        words = (words + 1).next_multiple_of(BLOCK_WORDS);
        for (first, averages) in down.iter_mut().zip(averages) {
            *first = words as u32;
            words += (width + 2 * averages * radius).next_multiple_of(QUAD) * height;
        }
        Self { words: words as u32, white, down, ..Self::default() }
    }

    /// First word of some numbers of every pixel.
    fn place(&mut self, count: u32) -> u32 {
        let first = self.words;
        self.words = (first + count * self.size[0] * self.size[1]).next_multiple_of(QUAD as u32);
        first
    }

    fn stereo(mut self, errors: &StereoErrors, covered: Option<&CoveredPixels>) -> (Self, Vec<u32>) {
        let [disparity, along, taken] = [1, 1, 1].map(|count| self.place(count));
        let bit_columns = self.size[0].div_ceil(u32::BITS);
        let (first_steps, table_steps) = covered.and_then(|_| steps(errors)).unwrap_or((0, 0));
        let step = errors.disparity_step;
        let depths = (0..table_steps).map(|k| errors.focal_baseline / ((first_steps + k) as f32 * step));
        let table = covered.map_or(Vec::new(), |covered| depths.flat_map(|z| covered.firsts(z)).collect());
        let law = Self {
            marks: self.marks + bit_columns * self.size[1],
            bit_columns,
            disparity,
            along,
            taken,
            // In the place of the sums of displacements.
            ramp: self.down[1],
            noise_centre: errors.noise.centre,
            shift_centre: errors.shifts.centre,
            noise_scale: errors.noise.scale,
            shift_scale: errors.shifts.scale,
            focal_baseline: errors.focal_baseline,
            surface_step: errors.surface_step,
            disparity_sd: errors.disparity_sd,
            disparity_step: errors.disparity_step,
            edge_shift: errors.edge_shift,
            least_support: errors.least_support,
            edge_limit: errors.edge_limit * errors.edge_limit,
            near: errors.range.0,
            far: errors.range.1,
            first_steps: first_steps as u32,
            table_steps: table_steps as u32,
            ..self
        };
        (law, table)
    }

    fn time_of_flight(
        mut self,
        errors: &TimeOfFlightErrors,
        covered: Option<&CoveredPixels>,
    ) -> (Self, Vec<u32>) {
        let [light, blurred] = [3, 3].map(|count| self.place(count));
        let pair = |x: f64, y: f64| [x as f32, y as f32];
        let mut law = Self {
            // A binding has some bytes.
            marks: self.marks.max(1),
            light,
            blurred,
            noise_centre: errors.noise.centre,
            noise_scale: errors.noise.scale,
            least_light: errors.least_light as f32,
            reach_spread: errors.reach_spread as f32,
            noise_floor: errors.noise_floor as f32,
            noise_at_metre: errors.noise_at_metre as f32,
            mixing: (errors.mixing * errors.mixing) as f32,
            near: errors.range.0 as f32,
            far: errors.range.1 as f32,
            ..self
        };
        if let Some(CoveredPixels { imager, camera, right, bridge }) = covered {
            let (x, y) = (camera.fx / imager.fx, camera.fy / imager.fy);
            law.zoom = pair(x, y);
            law.moved = pair(camera.cx - x * imager.cx, camera.cy - y * imager.cy);
            law.parallax = (camera.fx * right) as f32;
            law.bridge = *bridge as f32;
        }
        (law, errors.blur.iter().map(|weight| (*weight as f32).to_bits()).collect())
    }
}
