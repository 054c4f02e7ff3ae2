//! Hardware counters of a running batch: used share of memory bandwidth and of the time of the arithmetic units.

use std::time::{Duration, Instant};

use anyhow::Context;
use nvml_wrapper::Nvml;
use nvml_wrapper::enums::gpm::GpmMetricId;
use nvml_wrapper::gpm::gpm_metrics_get;
use orchard_gpu::GpuBatch;

use orchard_program::rows::Row;

/// Counters: metric, name in a row, description.
const COUNTED: [(GpmMetricId, &str, &str); 5] = [
    (GpmMetricId::DramBwUtil, "dram", "of the memory's bandwidth"),
    (GpmMetricId::Fp32Util, "fp32", "of the time the f32 units are active"),
    (GpmMetricId::IntegerUtil, "integer", "of the time the integer units are active"),
    (GpmMetricId::SmUtil, "multiprocessors", "of the time a multiprocessor has at least one warp"),
    (GpmMetricId::SmOccupancy, "warps", "of the largest number of resident warps"),
];
/// Counting interval; intervals below 0.1 s are inexact.
const COUNTED_TIME: Duration = Duration::from_secs(2);
/// Frames of one request.
const FRAMES: u32 = 60;
/// The counters are in percent.
const PERCENT: f64 = 100.0;

/// The driver's performance monitor.
pub struct Counters {
    nvml: Nvml,
    device: u32,
}

impl Counters {
    /// Opens the monitor of the named adapter. The error gives the reason why it is missing.
    pub fn open(adapter: &str) -> Result<Self, String> {
        // The driver package has no library link without the version number.
        let nvml = Nvml::builder().lib_path("libnvidia-ml.so.1".as_ref()).init().or_else(|_| Nvml::init());
        let nvml = nvml.map_err(|e| e.to_string())?;
        let has_name = |index: &u32| {
            let device = nvml.device_by_index(*index);
            device.and_then(|device| device.name()).is_ok_and(|name| name == adapter)
        };
        let devices = nvml.device_count().map_err(|e| e.to_string())?;
        let device = (0..devices).find(has_name).ok_or_else(|| format!("NVML does not list {adapter}"))?;
        let is_supported = nvml.device_by_index(device).and_then(|device| device.gpm_support());
        match is_supported {
            Ok(true) => Ok(Self { nvml, device }),
            Ok(false) => Err(format!("{adapter} has no performance counters")),
            Err(e) => Err(e.to_string()),
        }
    }

    /// The rows of the counters of a batch, if there are counters; says why not on the error stream.
    pub fn rows_of(counters: Option<&Self>, name: &str, batch: &mut GpuBatch) -> Vec<Row> {
        let Some(counters) = counters else { return Vec::new() };
        counters.rows(name, batch).unwrap_or_else(|why| {
            eprintln!("NO COUNTERS of {name}: {why:#}");
            Vec::new()
        })
    }

    /// Runs a batch for two seconds and returns the rows of the counters.
    fn rows(&self, name: &str, batch: &mut GpuBatch) -> anyhow::Result<Vec<Row>> {
        let device = self.nvml.device_by_index(self.device)?;
        batch.advance(FRAMES);
        batch.wait()?;
        let before = device.gpm_sample()?;
        let start = Instant::now();
        while start.elapsed() < COUNTED_TIME {
            batch.advance(FRAMES);
            batch.wait()?;
        }
        let after = device.gpm_sample()?;
        let found = gpm_metrics_get(&self.nvml, &before, &after, &COUNTED.map(|(metric, ..)| metric))
            .context("reading the counters")?;
        let rows = COUNTED.iter().zip(found).map(|((_, short, about), found)| {
            let share = found.map_or(f64::NAN, |found| found.value / PERCENT);
            let row = Row::measured(&format!("{name}.{short}"), share, "1");
            Row { note: Some(format!("hardware counter: share {about}")), ..row }
        });
        Ok(rows.collect())
    }
}
