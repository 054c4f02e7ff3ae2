//! Buffers of images on the device, which grow with what is drawn.

use wgpu::BufferUsages;

use super::pipelines::ImagePipelines;
use super::solids::WORDS;
use crate::buffers::{allocated, create_buffer};
use crate::device::{Gpu, GpuError};
use crate::layout::QUAD;

/// A view, as `kernels/image.wgsl` reads it.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct Header {
    pub first: u32,
    pub count: u32,
    pub posed: u32,
    pub bodies: u32,
    pub pixels: u32,
    pub size: u32,
    pub wants: u32,
    pub kept_count: u32,
    pub focal: [f32; 2],
    pub axis: [f32; 2],
    pub near: f32,
    pub far: f32,
    pub loose_first: u32,
    pub world_pose: u32,
}

/// Bytes of a pixel's depth, and of its item.
pub(super) const PIXEL_BYTES: usize = 4;
/// Bytes of a corner of a unit blade, along and across, and of a body's pose.
const CORNER_BYTES: usize = 2 * 4 * QUAD;
pub(super) const BODY_BYTES: usize = 2 * 4 * QUAD;
/// Bytes of a solid, and of its rectangle of pixels.
pub(super) const SOLID_BYTES: usize = 4 * WORDS;
const RECTANGLE_BYTES: usize = 8;
/// Views that fill a step of the offsets of a binding.
pub(super) const VIEWS_ALIGNED: usize = 256 / size_of::<Header>();
/// Room beyond what is needed now, our own choice: a share, so that slowly growing needs do not allocate each time.
pub(super) const MORE: usize = 4;

/// Numbers of what is drawn at once.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Sizes {
    pub views: usize,
    /// Solids in the frames of bodies.
    pub solids: usize,
    /// Solids before cameras.
    pub posed: usize,
    pub corners: usize,
    pub bodies: usize,
    /// Pixels with a depth, and those with an item.
    pub pixels: usize,
    pub items: usize,
    /// Words that are read.
    pub read: usize,
}

impl Sizes {
    fn all(self) -> [usize; 8] {
        let Self { views, solids, posed, corners, bodies, pixels, items, read } = self;
        [views, solids, posed, corners, bodies, pixels, items, read]
    }

    fn from(all: [usize; 8]) -> Self {
        let [views, solids, posed, corners, bodies, pixels, items, read] = all;
        Self { views, solids, posed, corners, bodies, pixels, items, read }
    }

    /// Bytes of the largest buffer.
    pub fn largest(self) -> usize {
        let of_solids = SOLID_BYTES * self.solids.max(self.posed);
        of_solids.max(PIXEL_BYTES * self.pixels).max(BODY_BYTES * self.bodies)
    }

    /// True if there is room for others.
    pub fn hold(self, other: Self) -> bool {
        self.all().iter().zip(other.all()).all(|(has, needs)| *has >= needs)
    }

    /// Somewhat more.
    pub fn with_room(self) -> Self {
        Self::from(self.all().map(|n| n + n / MORE))
    }

    /// Memory on the device \[bytes\].
    pub fn bytes(self) -> usize {
        self.views * size_of::<Header>()
            + self.solids * SOLID_BYTES
            + self.posed * (SOLID_BYTES + RECTANGLE_BYTES)
            + self.corners * CORNER_BYTES
            + self.bodies * BODY_BYTES
            + (self.pixels + self.items + self.read) * PIXEL_BYTES
    }
}

/// Workgroups that draw some views: of the kernels `bound` and `draw`, for each view as many as the largest one needs.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Groups {
    pub views: usize,
    pub bound: usize,
    pub tiles: usize,
}

/// One buffer for each binding, and one to read from.
#[derive(Debug)]
pub(super) struct Buffers {
    pub sizes: Sizes,
    pub views: wgpu::Buffer,
    pub solids: wgpu::Buffer,
    pub corners: wgpu::Buffer,
    pub bodies: wgpu::Buffer,
    posed: wgpu::Buffer,
    rectangles: wgpu::Buffer,
    pub depths: wgpu::Buffer,
    pub items: wgpu::Buffer,
    /// Memory from which the processor reads: depths and then items of images, or the bytes of pictures.
    pub staging: wgpu::Buffer,
    /// Bindings of these buffers.
    pub bindings: wgpu::BindGroup,
}

impl Buffers {
    /// Allocates them.
    ///
    /// # Errors
    /// The device has no room.
    pub fn new(gpu: &Gpu, pipelines: &ImagePipelines, sizes: Sizes) -> Result<Self, GpuError> {
        let part = |n: usize, some: usize| (n as u128 * some as u128).div_ceil(sizes.views.max(1) as u128);
        allocated(gpu, sizes.views, sizes.bytes() / sizes.views.max(1), |some| {
            Self::allocate(gpu, pipelines, Sizes::from(sizes.all().map(|n| part(n, some) as usize)))
        })
    }

    fn allocate(gpu: &Gpu, pipelines: &ImagePipelines, sizes: Sizes) -> Self {
        let written = BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::COPY_SRC;
        let buffer = |label, bytes| create_buffer(gpu, label, bytes, written);
        let views = buffer("views", sizes.views * size_of::<Header>());
        let solids = buffer("solids", sizes.solids * SOLID_BYTES);
        let corners = buffer("corners", sizes.corners * CORNER_BYTES);
        let bodies = buffer("bodies", sizes.bodies * BODY_BYTES);
        let posed = buffer("posed", sizes.posed * SOLID_BYTES);
        let rectangles = buffer("rectangles", sizes.posed * RECTANGLE_BYTES);
        let depths = buffer("depths", sizes.pixels * PIXEL_BYTES);
        let items = buffer("items", sizes.items * PIXEL_BYTES);
        let read = BufferUsages::MAP_READ | BufferUsages::COPY_DST;
        let staging = create_buffer(gpu, "images", sizes.read * PIXEL_BYTES, read);
        let bindings =
            bind(gpu, pipelines, [&views, &solids, &corners, &bodies, &posed, &rectangles, &depths, &items]);
        Self { sizes, views, solids, corners, bodies, posed, rectangles, depths, items, staging, bindings }
    }

    /// Binds the buffers, with the views from one on that begins a step of the offsets of a binding ([`VIEWS_ALIGNED`]).
    pub fn bind_from(&self, gpu: &Gpu, pipelines: &ImagePipelines, first: usize) -> wgpu::BindGroup {
        let Self { views, solids, corners, bodies, posed, rectangles, depths, items, .. } = self;
        let offset = (first * size_of::<Header>()) as u64;
        let views = wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer: views, offset, size: None });
        let rest = [solids, corners, bodies, posed, rectangles, depths, items];
        bind_all(gpu, pipelines, std::iter::once(views).chain(rest.map(wgpu::Buffer::as_entire_binding)))
    }

    /// Binds the buffers that lit pictures read, with others in the places of what they do not need, and another for the items if it is given.
    pub fn bind_lit(
        &self,
        gpu: &Gpu,
        pipelines: &ImagePipelines,
        [table, colours]: [&wgpu::Buffer; 2],
        packed: Option<&wgpu::Buffer>,
    ) -> wgpu::BindGroup {
        let Self { views, corners, bodies, posed, depths, items, .. } = self;
        let last = packed.unwrap_or(items);
        bind(gpu, pipelines, [views, table, corners, bodies, posed, colours, depths, last])
    }

    /// Binds the buffers, with others for the depths.
    pub fn bind(&self, gpu: &Gpu, pipelines: &ImagePipelines, depths: &wgpu::Buffer) -> wgpu::BindGroup {
        let Self { views, solids, corners, bodies, posed, rectangles, items, .. } = self;
        bind(gpu, pipelines, [views, solids, corners, bodies, posed, rectangles, depths, items])
    }
}

fn bind(gpu: &Gpu, pipelines: &ImagePipelines, buffers: [&wgpu::Buffer; 8]) -> wgpu::BindGroup {
    bind_all(gpu, pipelines, buffers.into_iter().map(wgpu::Buffer::as_entire_binding))
}

fn bind_all<'a>(
    gpu: &Gpu,
    pipelines: &ImagePipelines,
    resources: impl Iterator<Item = wgpu::BindingResource<'a>>,
) -> wgpu::BindGroup {
    let entries = (0..).zip(resources).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource });
    let (layout, entries) = (&pipelines.bindings, &entries.collect::<Vec<_>>());
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries })
}

/// Records the drawing of the views.
pub(super) fn record(
    encoder: &mut wgpu::CommandEncoder,
    pipelines: &ImagePipelines,
    bindings: &wgpu::BindGroup,
    groups: Groups,
) {
    for (kernel, count) in [(&pipelines.bound, groups.bound), (&pipelines.draw, groups.tiles)] {
        if count > 0 {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_bind_group(0, bindings, &[]);
            pass.set_pipeline(kernel);
            pass.dispatch_workgroups(count as u32, groups.views as u32, 1);
        }
    }
}
