//! Graphics adapters: choice, limits and errors.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use wgpu::{
    Backends, DeviceDescriptor, DeviceType, Features, InstanceDescriptor, InstanceFlags, Limits,
    PowerPreference,
};

use crate::BatchError;
use crate::images::pipelines::ImagePipelines;
use crate::laws::Laws;
use crate::layout::LANES;
use crate::pipelines::{Pipelines, is_software};
use crate::robots::pipelines::RobotPipelines;
use crate::schedule::WARPS;
use crate::worlds::pipelines::{QuadPipelines, WorldPipelines};

/// Number of storage buffers that the kernels bind, and of uniform buffers, which are storage buffers on a device in software.
const STORAGE_BUFFERS: u32 = 8;
const UNIFORMS: u32 = 2;

/// Error of a graphics device.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum GpuError {
    /// There is no adapter.
    #[error(
        "no graphics adapter was found ({0}); on Debian the package mesa-vulkan-drivers provides one in software. The CPU backend needs none"
    )]
    NoAdapter(String),
    /// The adapter cannot be opened, or its limits are too low.
    #[error("{adapter} cannot be used: {why}")]
    Unusable {
        /// Name of the adapter.
        adapter: String,
        /// Reason.
        why: String,
    },
    /// The batch exceeds a limit of the adapter.
    #[error("{worlds} worlds need {needed} {what}, {adapter} has {has}; {fits} worlds like these would fit")]
    TooLarge {
        /// Number of worlds requested.
        worlds: usize,
        /// Limit that is exceeded.
        what: &'static str,
        /// Amount needed.
        needed: u64,
        /// Name of the adapter.
        adapter: String,
        /// Amount that the adapter allows.
        has: u64,
        /// Number of worlds that would fit.
        fits: usize,
    },
    /// The device's memory is full.
    #[error(
        "{adapter} has no memory left for {worlds} worlds of {each} bytes each; {fits} worlds like these would fit"
    )]
    OutOfMemory {
        /// Name of the adapter.
        adapter: String,
        /// Number of worlds requested.
        worlds: usize,
        /// Memory of one world \[bytes\].
        each: usize,
        /// Number of worlds for which there was room.
        fits: usize,
    },
    /// Other programs' interfaces cannot see the device's memory.
    #[error("{adapter} cannot share its memory: {why}")]
    Unshared {
        /// Name of the adapter.
        adapter: String,
        /// Reason.
        why: orchard_tensor::ExportError,
    },
    /// The device stopped working; everything computed since the last read is lost.
    #[error("the graphics device was lost: {0}. Nothing was read from it; create the batch again")]
    Lost(String),
    /// The device has no kernels for the errors of a camera.
    #[error(
        "a graphics device has no kernels for the errors of the camera {camera}; Sensor::measure adds them on the processor"
    )]
    NoKernels {
        /// Name of the camera's kind.
        camera: &'static str,
    },
    /// The worlds cannot form a batch.
    #[error(transparent)]
    Batch(#[from] BatchError),
}

/// Choice of an adapter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Choice {
    /// The fastest adapter.
    #[default]
    Any,
    /// An adapter in software: slow, and available everywhere.
    Software,
}

/// Name and limits of an adapter.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GpuInfo {
    /// Name.
    pub name: String,
    /// Interface: Vulkan, Metal or DX12.
    pub backend: String,
    /// Driver, with its version.
    pub driver: String,
    /// True if it runs in software on the processor.
    pub is_software: bool,
    /// True if it is a card with memory of its own.
    pub is_discrete: bool,
    /// True if it has subgroup operations. The kernels need none.
    pub has_subgroups: bool,
    /// Largest workgroup memory \[bytes\].
    pub workgroup_storage: u32,
    /// Largest storage buffer that a kernel can bind \[bytes\].
    pub storage_binding: u64,
    /// Shape of a workgroup in words: warps, each of which steps a part of every tree, times worlds.
    pub kernel: String,
}

/// An open graphics device. Clones share it.
#[derive(Debug, Clone)]
pub struct Gpu {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    info: GpuInfo,
    lost: Arc<Mutex<Option<String>>>,
    pipelines: Arc<OnceLock<Arc<Pipelines>>>,
    robot_pipelines: Arc<OnceLock<RobotPipelines>>,
    world_pipelines: Arc<[OnceLock<WorldPipelines>; 4]>,
    quad_pipelines: Arc<OnceLock<QuadPipelines>>,
    image_pipelines: Arc<OnceLock<ImagePipelines>>,
}

impl Gpu {
    /// Opens the chosen adapter.
    ///
    /// # Errors
    /// There is no such adapter, or its limits are too low for the kernels.
    pub fn open(choice: Choice) -> Result<Self, GpuError> {
        Self::open_with(choice, u64::MAX)
    }

    /// As [`Self::open`], with a largest buffer size [bytes].
    pub(crate) fn open_with(choice: Choice, largest_buffer: u64) -> Result<Self, GpuError> {
        let descriptor = InstanceDescriptor {
            backends: Backends::VULKAN | Backends::METAL | Backends::DX12,
            // Without the lines of the kernels' source: in builds that are not optimised wgpu counts them anew for every instruction, a quarter of all
            // the time of the tests. `WGPU_DEBUG=1` brings them.
            flags: InstanceFlags::default().difference(InstanceFlags::DEBUG).with_env(),
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
        let (info, has) = (info_of(&adapter), adapter.limits());
        let unusable = |why: String| GpuError::Unusable { adapter: info.name.clone(), why };
        let storage_buffers = STORAGE_BUFFERS + if info.is_software { UNIFORMS } else { 0 };
        for (what, needed, has) in [
            ("storage buffers for a kernel", storage_buffers, has.max_storage_buffers_per_shader_stage),
            ("threads in a workgroup", (LANES * WARPS) as u32, has.max_compute_invocations_per_workgroup),
        ] {
            if has < needed {
                return Err(unusable(format!("it has {has} {what}; {needed} are needed")));
            }
        }
        let required_limits = Limits {
            max_storage_buffer_binding_size: has.max_storage_buffer_binding_size.min(largest_buffer),
            max_buffer_size: has.max_buffer_size.min(largest_buffer),
            max_storage_buffers_per_shader_stage: storage_buffers,
            max_compute_invocations_per_workgroup: (LANES * WARPS) as u32,
            ..Limits::downlevel_defaults()
        };
        // Times of kernels, where the adapter has a clock.
        let required_features = adapter.features() & Features::TIMESTAMP_QUERY;
        let descriptor = DeviceDescriptor { required_limits, required_features, ..Default::default() };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|e| unusable(one_line(&e.to_string())))?;
        let lost = Arc::new(Mutex::new(None));
        let note = lost.clone();
        device.set_device_lost_callback(move |reason, text| {
            *note.lock().unwrap_or_else(PoisonError::into_inner) =
                Some(format!("{reason:?}: {}", one_line(&text)));
        });
        // Calls on a lost device fail. The error is kept for the next read; without this handler wgpu would panic.
        let note = lost.clone();
        device.on_uncaptured_error(Arc::new(move |e: wgpu::Error| {
            let mut lost = note.lock().unwrap_or_else(PoisonError::into_inner);
            lost.get_or_insert_with(|| one_line(&e.to_string()));
        }));
        Ok(Self {
            device,
            queue,
            info,
            lost,
            pipelines: Arc::default(),
            robot_pipelines: Arc::default(),
            world_pipelines: Arc::default(),
            quad_pipelines: Arc::default(),
            image_pipelines: Arc::default(),
        })
    }

    /// Compiled kernels, shared by all batches of the device.
    pub(crate) fn pipelines(&self) -> Arc<Pipelines> {
        self.pipelines.get_or_init(|| Arc::new(Pipelines::new(&self.device))).clone()
    }

    /// Compiled kernels of robots, shared by all batches of the device.
    pub(crate) fn robot_pipelines(&self) -> &RobotPipelines {
        self.robot_pipelines.get_or_init(|| RobotPipelines::new(&self.device))
    }

    /// Compiled kernels of whole worlds under the laws of their trees, shared by all batches of the device.
    pub(crate) fn world_pipelines(&self, laws: Laws) -> &WorldPipelines {
        let own = usize::from(laws.stems) + 2 * usize::from(laws.wind);
        self.world_pipelines[own].get_or_init(|| WorldPipelines::new(&self.device, laws))
    }

    /// Compiled kernels that move quads.
    pub(crate) fn quad_pipelines(&self) -> &QuadPipelines {
        self.quad_pipelines.get_or_init(|| QuadPipelines::new(&self.device))
    }

    /// Compiled kernels of images.
    pub(crate) fn image_pipelines(&self) -> &ImagePipelines {
        self.image_pipelines.get_or_init(|| ImagePipelines::new(&self.device))
    }

    /// Name and limits of the adapter.
    pub fn info(&self) -> &GpuInfo {
        &self.info
    }

    /// True if the device stopped working, as far as is known.
    pub fn is_lost(&self) -> bool {
        self.check().is_err()
    }

    /// Waits until all submitted work is done.
    ///
    /// # Errors
    /// The device was lost.
    pub fn wait(&self) -> Result<(), GpuError> {
        self.wait_for(None)
    }
}

impl Gpu {
    /// Waits until a submission is done; `None`: until all are.
    ///
    /// # Errors
    /// The device was lost.
    pub(crate) fn wait_for(&self, submission_index: Option<wgpu::SubmissionIndex>) -> Result<(), GpuError> {
        self.check()?;
        let waited = self.device.poll(wgpu::PollType::Wait { submission_index, timeout: None });
        self.check()?;
        waited.map(|_| ()).map_err(|e| GpuError::Lost(one_line(&e.to_string())))
    }

    fn check(&self) -> Result<(), GpuError> {
        match &*self.lost.lock().unwrap_or_else(PoisonError::into_inner) {
            Some(why) => Err(GpuError::Lost(why.clone())),
            None => Ok(()),
        }
    }
}

fn info_of(adapter: &wgpu::Adapter) -> GpuInfo {
    let (info, limits) = (adapter.get_info(), adapter.limits());
    GpuInfo {
        name: info.name,
        backend: format!("{:?}", info.backend),
        driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
        is_software: is_software(info.device_type),
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
