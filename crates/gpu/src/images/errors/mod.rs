//! The errors of cameras, added on the device to the exact depths that it has drawn.

mod kernels;
mod law;
mod model;

use orchard_camera::{ImageKey, Sensor};
use orchard_geometry::{DepthImage, Pose};
use orchard_spec::camera::Measurement;
use rayon::prelude::*;
use wgpu::BufferUsages;

use super::into::Rows;
use super::{ImageBatch, Subject, View, image};
use crate::arrays::DeviceArray;
use crate::buffers::{allocated, create_buffer};
use crate::device::{Gpu, GpuError};
use kernels::ErrorKernels;
use law::{Law, Shot};
use model::Model;

/// Memory of the errors of the images that are measured at once \[bytes\], our own choice: enough of them for every core of a large device.
const AT_ONCE: usize = 1 << 30;
/// Images whose numbers fill a step of the offsets of a binding.
const ALIGNED: usize = 256 / size_of::<Shot>();

/// An image to be measured.
#[derive(Debug, Clone, Copy)]
pub struct Look<'a> {
    /// The scene in front of the camera.
    pub subject: Subject<'a>,
    /// Pose of the camera's optical frame.
    pub x_world_camera: Pose,
    /// Key of the errors.
    pub key: ImageKey,
}

impl ImageBatch {
    /// True if the device measures with the errors of a camera ([`Self::measured`]): an exact camera has none; a stereo camera of up to 1920 columns with windows of up to 15 x 15 pixels, registered
    /// without interpolation or not at all; a camera by time of flight, registered with interpolation or not at all. These are all cameras that come with the program. Others measure on the processor
    /// ([`Sensor::measure`]).
    pub fn can_measure(sensor: &Sensor) -> bool {
        matches!(sensor.spec().measurement(), Measurement::Exact) || Model::of(sensor).is_some()
    }

    /// Draws images and measures them with the errors of their camera. From the same exact depths the processor makes the same bits ([`Sensor::measure`]) of a stereo camera, and the same to some roundings of f32 of one
    /// by time of flight.
    ///
    /// # Errors
    /// As [`Self::depths`]; there are no kernels for this camera ([`Self::can_measure`]).
    pub fn measured(&mut self, sensor: &Sensor, looks: &[Look<'_>]) -> Result<Vec<DepthImage>, GpuError> {
        if !Self::can_measure(sensor) {
            return Err(GpuError::NoKernels { camera: sensor.spec().name() });
        }
        let views = views_of(sensor, looks);
        if let Some(model) = Model::of(sensor) {
            self.errors.begin(&self.gpu, model, looks);
        }
        let (width, height) = (sensor.intrinsics().width, sensor.intrinsics().height);
        let drawn = self.draw(&views, false, |_, _, depths, _| image(width, height, depths.to_vec()));
        self.errors.end();
        drawn
    }

    /// As [`Self::measured`], into rows of an array of as many pixels each; returns at once, as [`Self::depths_into`] does.
    ///
    /// # Errors
    /// As [`Self::measured`].
    ///
    /// # Panics
    /// As [`Self::depths_into`].
    pub fn measured_into(
        &mut self,
        sensor: &Sensor,
        looks: &[Look<'_>],
        array: &DeviceArray,
        rows: &[usize],
    ) -> Result<(), GpuError> {
        if !Self::can_measure(sensor) {
            return Err(GpuError::NoKernels { camera: sensor.spec().name() });
        }
        if let Some(model) = Model::of(sensor) {
            self.errors.begin(&self.gpu, model, looks);
        }
        let drawn = self.depths_into(&views_of(sensor, looks), array, rows);
        self.errors.end();
        drawn
    }
}

/// The exact images of looks by a camera.
fn views_of<'a>(sensor: &Sensor, looks: &[Look<'a>]) -> Vec<View<'a>> {
    let view =
        |look: &Look<'a>| View { subject: look.subject, exposure: sensor.exposure(&look.x_world_camera) };
    looks.iter().map(view).collect()
}

/// A buffer with some bytes, which kernels read.
fn sent(gpu: &Gpu, label: &str, bytes: &[u8]) -> wgpu::Buffer {
    let buffer = create_buffer(gpu, label, bytes.len(), BufferUsages::STORAGE | BufferUsages::COPY_DST);
    gpu.queue.write_buffer(&buffer, 0, bytes);
    buffer
}

/// Cameras with errors that a batch has met, and the images that are being measured.
#[derive(Debug, Default)]
pub(super) struct Errors {
    cameras: Vec<Camera>,
    /// Camera of the images that are being measured.
    active: Option<usize>,
    /// Images that are not measured yet, and their faults.
    left: Vec<(Shot, Vec<u32>)>,
    /// Measured depths of the latest call \[m\], image after image.
    measured: Option<wgpu::Buffer>,
    /// Camera and parts of the images recorded last, to record them again.
    recorded: Option<(usize, Vec<Part>)>,
}

/// Images that are measured at once.
#[derive(Debug)]
struct Part {
    bindings: wgpu::BindGroup,
    images: usize,
    /// The largest number of faults of one of them.
    most_faults: usize,
}

/// A camera's kernels and memory.
#[derive(Debug)]
struct Camera {
    model: Model,
    law: Law,
    kernels: ErrorKernels,
    figures: wgpu::Buffer,
    table: wgpu::Buffer,
    memory: Option<Memory>,
}

/// Memory of the images that are measured at once.
#[derive(Debug)]
struct Memory {
    images: usize,
    words: wgpu::Buffer,
    marks: wgpu::Buffer,
}

impl Errors {
    /// Begins to measure images of a camera.
    fn begin(&mut self, gpu: &Gpu, model: Model, looks: &[Look<'_>]) {
        self.left = looks.par_iter().map(|look| (Shot::of(look.key), model.faults(look.key))).collect();
        let known = self.cameras.iter().position(|camera| camera.model == model);
        self.active = Some(known.unwrap_or_else(|| {
            self.cameras.push(Camera::new(gpu, model));
            self.cameras.len() - 1
        }));
    }

    /// Ends it.
    fn end(&mut self) {
        self.active = None;
        self.left.clear();
    }

    /// Memory on the device \[bytes\].
    pub fn bytes(&self) -> usize {
        let of = |camera: &Camera| {
            let images = camera.memory.as_ref().map_or(0, |memory| memory.images);
            images * camera.bytes_each().iter().sum::<usize>()
        };
        let measured = self.measured.as_ref().map_or(0, |measured| measured.size() as usize);
        measured + self.cameras.iter().map(of).sum::<usize>()
    }

    /// Pixels of an image that is being measured, if one is.
    pub fn pixels(&self) -> Option<usize> {
        let (width, height) = self.cameras[self.active?].model.measured_size();
        Some(width * height)
    }

    /// Records the errors of the next images, whose exact depths begin at some places of a buffer, and returns the buffer of measured depths, image after image, or in rows of an array if they are given; `None` if no images
    /// are being measured.
    ///
    /// # Errors
    /// An image is larger than the device allows; the device has no room.
    pub fn record<'a>(
        &'a mut self,
        gpu: &Gpu,
        depths: &wgpu::Buffer,
        places: &[u32],
        into: Option<Rows<'a>>,
        encoder: &mut wgpu::CommandEncoder,
    ) -> Result<Option<&'a wgpu::Buffer>, GpuError> {
        self.recorded = None;
        let (Some(active), Some(each)) = (self.active, self.pixels()) else { return Ok(None) };
        let camera = &mut self.cameras[active];
        let at_once = camera.reserve(gpu, places.len())?;
        let bytes = (size_of::<f32>() * each * places.len()) as u64;
        if into.is_none() && self.measured.as_ref().is_none_or(|measured| measured.size() < bytes) {
            self.measured = None;
            let usage = BufferUsages::STORAGE | BufferUsages::COPY_SRC;
            let make = |images| create_buffer(gpu, "measured", size_of::<f32>() * each * images, usage);
            self.measured = Some(allocated(gpu, places.len(), size_of::<f32>() * each, make)?);
        }
        let into_array = into.map(|into| &into.array.buffer);
        let Some(measured) = into_array.or(self.measured.as_ref()) else { return Ok(None) };
        let mut shots = Vec::with_capacity(places.len());
        let mut faults = Vec::new();
        for (k, ((shot, its), pixels)) in self.left.drain(..places.len()).zip(places).enumerate() {
            let (first, fault_count) = (faults.len() as u32, its.len() as u32);
            shots.push(Shot {
                pixels: *pixels,
                measured: (into.map_or(k, |into| into.rows[k]) * each) as u32,
                faults: first,
                fault_count,
                ..shot
            });
            faults.extend(its);
        }
        let shots_there = sent(gpu, "shots", bytemuck::cast_slice(&shots));
        let faults_there = sent(gpu, "faults", bytemuck::cast_slice(&faults));
        let parts = shots.chunks(at_once).enumerate().map(|(part, shots)| {
            let offset = (part * at_once * size_of::<Shot>()) as u64;
            let most_faults = shots.iter().map(|shot| shot.fault_count).max().unwrap_or(0) as usize;
            Part {
                bindings: camera.bind(gpu, [depths, measured, &faults_there], (&shots_there, offset)),
                images: shots.len(),
                most_faults,
            }
        });
        self.recorded = Some((active, parts.collect()));
        self.record_again(encoder);
        Ok(into_array.or(self.measured.as_ref()))
    }

    /// Records the errors of the images that were recorded last.
    pub fn record_again(&self, encoder: &mut wgpu::CommandEncoder) {
        let Some((camera, parts)) = &self.recorded else { return };
        let camera = &self.cameras[*camera];
        let Some(memory) = &camera.memory else { return };
        for Part { bindings, images, most_faults } in parts {
            encoder.clear_buffer(&memory.marks, 0, None);
            camera.kernels.record(encoder, bindings, *images, *most_faults);
        }
    }
}

impl Camera {
    fn new(gpu: &Gpu, model: Model) -> Self {
        let (law, table) = Law::of(&model);
        let kernels = ErrorKernels::new(gpu, &model, law.white[3] as usize);
        let figures = sent(gpu, "law", bytemuck::bytes_of(&law));
        let table = sent(gpu, "table", bytemuck::cast_slice(&table));
        Self { model, law, kernels, figures, table, memory: None }
    }

    /// Bytes of the memory and of the marks of an image.
    fn bytes_each(&self) -> [usize; 2] {
        [self.law.words, self.law.marks].map(|words| size_of::<u32>() * words as usize)
    }

    /// Makes room for up to some images at once; returns for how many there is.
    fn reserve(&mut self, gpu: &Gpu, images: usize) -> Result<usize, GpuError> {
        let limits = gpu.device.limits();
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size) as usize;
        let [words, marks] = self.bytes_each();
        let fit = AT_ONCE.min(most) / words.max(marks);
        if fit < ALIGNED.min(images) {
            return Err(GpuError::TooLarge {
                worlds: images,
                what: "bytes in one buffer",
                needed: (words.max(marks) * ALIGNED.min(images)) as u64,
                adapter: gpu.info().name.clone(),
                has: most as u64,
                fits: fit,
            });
        }
        // Parts begin where a binding may.
        let whole = if fit < ALIGNED { images } else { fit / ALIGNED * ALIGNED };
        let wanted = images.next_multiple_of(ALIGNED).min(whole);
        if self.memory.as_ref().is_none_or(|memory| memory.images < wanted) {
            self.memory = None;
            let usage = BufferUsages::STORAGE | BufferUsages::COPY_DST;
            self.memory = Some(allocated(gpu, wanted, words + marks, |some| Memory {
                images: some,
                words: create_buffer(gpu, "errors", some * words, usage),
                marks: create_buffer(gpu, "marks", some * marks, usage),
            })?);
        }
        Ok(self.memory.as_ref().map_or(wanted, |memory| memory.images))
    }

    /// Binds buffers of exact depths, of measured depths and of faults, and the images from an offset \[bytes\] on.
    fn bind(
        &self,
        gpu: &Gpu,
        [depths, measured, faults]: [&wgpu::Buffer; 3],
        (shots, offset): (&wgpu::Buffer, u64),
    ) -> wgpu::BindGroup {
        let Some(memory) = &self.memory else { unreachable!("room is made before it is bound") };
        let shots = wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer: shots, offset, size: None });
        let resources = [
            self.figures.as_entire_binding(),
            shots,
            faults.as_entire_binding(),
            depths.as_entire_binding(),
            memory.words.as_entire_binding(),
            memory.marks.as_entire_binding(),
            self.table.as_entire_binding(),
            measured.as_entire_binding(),
        ];
        let entries: Vec<_> = (0..)
            .zip(resources)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        let layout = &self.kernels.bindings;
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
    }
}
