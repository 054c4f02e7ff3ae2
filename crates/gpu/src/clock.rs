//! Times of kernels by the device's own clock.

use std::collections::BTreeMap;

use wgpu::{BufferUsages, CommandEncoder, ComputePassTimestampWrites, Features};

use crate::buffers::create_buffer;
use crate::device::{Gpu, GpuError};

/// Largest number of passes that are timed between two readings.
const MOST: u32 = 512;
/// Bytes of a time stamp.
const STAMP: u64 = size_of::<u64>() as u64;

/// A clock for passes of some kind, with their names, if they are timed.
pub(crate) type Timed<'a, K> = Option<(&'a mut Clock, fn(K) -> &'static str)>;

/// Time stamps of the passes of a batch, which are summed up by the passes' names.
#[derive(Debug)]
pub(crate) struct Clock {
    stamps: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    staging: wgpu::Buffer,
    /// Seconds of a tick.
    tick: f64,
    /// Names of the passes that were given stamps since the last reading.
    names: Vec<&'static str>,
    asked: Option<wgpu::SubmissionIndex>,
    seconds: BTreeMap<&'static str, f64>,
}

impl Clock {
    /// A clock; `None` if the adapter has none.
    pub fn new(gpu: &Gpu) -> Option<Self> {
        if !gpu.device.features().contains(Features::TIMESTAMP_QUERY) {
            return None;
        }
        let stamps = gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
            label: Some("stamps"),
            ty: wgpu::QueryType::Timestamp,
            count: 2 * MOST,
        });
        let bytes = (2 * u64::from(MOST) * STAMP) as usize;
        let resolved =
            create_buffer(gpu, "stamps", bytes, BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC);
        let staging = create_buffer(gpu, "stamps", bytes, BufferUsages::MAP_READ | BufferUsages::COPY_DST);
        let tick = f64::from(gpu.queue.get_timestamp_period()) * 1e-9;
        Some(Self {
            stamps,
            resolved,
            staging,
            tick,
            names: Vec::new(),
            asked: None,
            seconds: BTreeMap::new(),
        })
    }

    /// The stamps of the next pass, which has a name; `None` if none are left before the next reading.
    pub fn stamp(&mut self, name: &'static str) -> Option<ComputePassTimestampWrites<'_>> {
        let first = 2 * self.names.len() as u32;
        (first < 2 * MOST && self.asked.is_none()).then(|| {
            self.names.push(name);
            ComputePassTimestampWrites {
                query_set: &self.stamps,
                beginning_of_pass_write_index: Some(first),
                end_of_pass_write_index: Some(first + 1),
            }
        })
    }

    /// Submits the reading of all stamps given, behind all work submitted so far.
    pub fn ask(&mut self, gpu: &Gpu) {
        let count = 2 * self.names.len() as u32;
        if count == 0 || self.asked.is_some() {
            return;
        }
        let bytes = u64::from(count) * STAMP;
        let mut encoder: CommandEncoder = gpu.device.create_command_encoder(&Default::default());
        encoder.resolve_query_set(&self.stamps, 0..count, &self.resolved, 0);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.staging, 0, bytes);
        self.asked = Some(gpu.queue.submit([encoder.finish()]));
        // A lost device is reported by the wait.
        self.staging.slice(..bytes).map_async(wgpu::MapMode::Read, |_| {});
    }

    /// Waits for the stamps that were asked for, and adds them up.
    ///
    /// # Errors
    /// The device was lost.
    pub fn fetch(&mut self, gpu: &Gpu) -> Result<(), GpuError> {
        let Some(asked) = self.asked.take() else { return Ok(()) };
        gpu.wait_for(Some(asked))?;
        let slice = self.staging.slice(..2 * STAMP * self.names.len() as u64);
        let view = slice.get_mapped_range().map_err(|e| GpuError::Lost(e.to_string()))?;
        let stamps: Vec<u64> = bytemuck::pod_collect_to_vec(&view);
        drop(view);
        self.staging.unmap();
        let seconds = |ticks: u64| ticks as f64 * self.tick;
        for (name, stamps) in self.names.drain(..).zip(stamps.chunks_exact(2)) {
            *self.seconds.entry(name).or_default() += seconds(stamps[1].saturating_sub(stamps[0]));
        }
        if let (Some(first), Some(last)) = (stamps.first(), stamps.last()) {
            *self.seconds.entry("all").or_default() += seconds(last.saturating_sub(*first));
        }
        Ok(())
    }

    /// Seconds of all passes read so far by their names; `all` has those from the beginning of the first to the end of the last before each reading.
    pub fn seconds(&self) -> &BTreeMap<&'static str, f64> {
        &self.seconds
    }
}
