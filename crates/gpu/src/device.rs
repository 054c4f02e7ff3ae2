//! The graphics device: which there is, what it can do, and its errors.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use wgpu::{Backends, DeviceDescriptor, DeviceType, Features, InstanceDescriptor, Limits, PowerPreference};

use crate::BatchError;
use crate::layout::LANES;
use crate::pipelines::Pipelines;
use crate::schedule::WARPS;

/// Storage buffers that the kernels bind.
const STORAGE_BUFFERS: u32 = 8;

/// A device that cannot be had, or fails.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum GpuError {
    /// There is none.
    #[error(
        "no graphics adapter was found ({0}); on Debian the package mesa-vulkan-drivers has one in software. The CPU backend needs none"
    )]
    NoAdapter(String),
    /// It does not let itself be opened.
    #[error("{adapter} cannot be used: {why}")]
    Unusable {
        /// Name.
        adapter: String,
        /// Why.
        why: String,
    },
    /// The batch is too large for it.
    #[error("{worlds} worlds need {needed} {what}, {adapter} has {has}; {fits} worlds like these would fit")]
    TooLarge {
        /// Worlds asked for.
        worlds: usize,
        /// Of what there is too little.
        what: &'static str,
        /// How much is needed.
        needed: u64,
        /// Name.
        adapter: String,
        /// How much there may be.
        has: u64,
        /// Worlds that would fit.
        fits: usize,
    },
    /// Its memory is full.
    #[error(
        "{adapter} has no memory left for {worlds} worlds of {each} bytes each; {fits} worlds like these would fit"
    )]
    OutOfMemory {
        /// Name.
        adapter: String,
        /// Worlds asked for.
        worlds: usize,
        /// Bytes of a world.
        each: usize,
        /// Worlds for which there was room.
        fits: usize,
    },
    /// It stopped working; what was computed since the last read is lost.
    #[error("the graphics device was lost: {0}. Nothing was read from it; make the batch anew")]
    Lost(String),
    /// The worlds make no batch.
    #[error(transparent)]
    Batch(#[from] BatchError),
}

/// Which adapter to take.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Choice {
    /// The fastest, whatever it is.
    #[default]
    Any,
    /// One in software: slow, and the same everywhere.
    Software,
}

/// What an adapter is and can do.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GpuInfo {
    /// Its name.
    pub name: String,
    /// Vulkan, Metal or DX12.
    pub backend: String,
    /// Driver, with its version.
    pub driver: String,
    /// Whether it is a program on the CPU.
    pub is_software: bool,
    /// Whether it is a card with memory of its own.
    pub is_discrete: bool,
    /// Whether it has subgroup operations. The kernels need none.
    pub has_subgroups: bool,
    /// Memory that a workgroup shares [bytes].
    pub workgroup_storage: u32,
    /// Largest buffer that a kernel can bind [bytes].
    pub storage_binding: u64,
    /// Threads of a workgroup: a warp of worlds for each part of a tree.
    pub kernel: String,
}

/// An open device.
#[derive(Debug, Clone)]
pub struct Gpu {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    info: GpuInfo,
    lost: Arc<Mutex<Option<String>>>,
    pipelines: Arc<OnceLock<Arc<Pipelines>>>,
}

impl Gpu {
    /// Opens an adapter.
    ///
    /// # Errors
    /// There is none, or it cannot do what the kernels need.
    pub fn open(choice: Choice) -> Result<Self, GpuError> {
        Self::open_with(choice, u64::MAX)
    }

    /// The same with no buffer larger than so many bytes.
    pub(crate) fn open_with(choice: Choice, largest_buffer: u64) -> Result<Self, GpuError> {
        let descriptor = InstanceDescriptor {
            backends: Backends::VULKAN | Backends::METAL | Backends::DX12,
            ..InstanceDescriptor::new_without_display_handle()
        };
        let instance = wgpu::Instance::new(descriptor);
        let options = wgpu::RequestAdapterOptions {
            power_preference: PowerPreference::HighPerformance,
            force_fallback_adapter: choice == Choice::Software,
            ..Default::default()
        };
        let adapter = pollster::block_on(instance.request_adapter(&options))
            .map_err(|e| GpuError::NoAdapter(one_line(&e.to_string())))?;
        let (info, has) = (told(&adapter), adapter.limits());
        let unusable = |why: String| GpuError::Unusable { adapter: info.name.clone(), why };
        for (what, needed, has) in [
            ("storage buffers for a kernel", STORAGE_BUFFERS, has.max_storage_buffers_per_shader_stage),
            ("threads in a workgroup", (LANES * WARPS) as u32, has.max_compute_invocations_per_workgroup),
        ] {
            if has < needed {
                return Err(unusable(format!("it has {has} {what}, {needed} are needed")));
            }
        }
        let required_limits = Limits {
            max_storage_buffer_binding_size: has.max_storage_buffer_binding_size.min(largest_buffer),
            max_buffer_size: has.max_buffer_size.min(largest_buffer),
            ..Limits::downlevel_defaults()
        };
        let required_limits = Limits {
            max_storage_buffers_per_shader_stage: STORAGE_BUFFERS,
            max_compute_invocations_per_workgroup: (LANES * WARPS) as u32,
            ..required_limits
        };
        let descriptor = DeviceDescriptor { required_limits, ..Default::default() };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|e| unusable(one_line(&e.to_string())))?;
        let lost = Arc::new(Mutex::new(None));
        let note = lost.clone();
        device.set_device_lost_callback(move |reason, text| {
            *note.lock().unwrap_or_else(PoisonError::into_inner) =
                Some(format!("{reason:?}: {}", one_line(&text)));
        });
        // What is asked of a device that is gone fails; the next read tells why, where the library would panic.
        let note = lost.clone();
        device.on_uncaptured_error(Arc::new(move |e: wgpu::Error| {
            let mut lost = note.lock().unwrap_or_else(PoisonError::into_inner);
            lost.get_or_insert_with(|| one_line(&e.to_string()));
        }));
        Ok(Self { device, queue, info, lost, pipelines: Arc::default() })
    }

    /// The kernels, which all batches of a device share.
    pub(crate) fn pipelines(&self) -> Arc<Pipelines> {
        self.pipelines.get_or_init(|| Arc::new(Pipelines::new(&self.device))).clone()
    }

    /// What it is.
    pub fn info(&self) -> &GpuInfo {
        &self.info
    }

    /// Waits until everything is done that was asked for.
    ///
    /// # Errors
    /// The device was lost.
    pub fn wait(&self) -> Result<(), GpuError> {
        self.check()?;
        let waited = self.device.poll(wgpu::PollType::wait_indefinitely());
        self.check()?;
        waited.map(|_| ()).map_err(|e| GpuError::Lost(one_line(&e.to_string())))
    }
}

impl Gpu {
    fn check(&self) -> Result<(), GpuError> {
        match &*self.lost.lock().unwrap_or_else(PoisonError::into_inner) {
            Some(why) => Err(GpuError::Lost(why.clone())),
            None => Ok(()),
        }
    }
}

fn told(adapter: &wgpu::Adapter) -> GpuInfo {
    let (info, limits) = (adapter.get_info(), adapter.limits());
    GpuInfo {
        name: info.name,
        backend: format!("{:?}", info.backend),
        driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
        is_software: info.device_type == DeviceType::Cpu,
        is_discrete: info.device_type == DeviceType::DiscreteGpu,
        has_subgroups: adapter.features().contains(Features::SUBGROUP),
        workgroup_storage: limits.max_compute_workgroup_storage_size,
        storage_binding: limits.max_storage_buffer_binding_size,
        kernel: format!("{WARPS} warps x {LANES} worlds, through storage buffers"),
    }
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
