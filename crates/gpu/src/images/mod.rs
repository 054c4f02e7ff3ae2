//! Exact depth images of many scenes at once.

mod buffers;
mod errors;
mod into;
mod kept;
mod mask;
mod pictures;
pub(crate) mod pipelines;
mod solids;

use std::ops::Range;
use std::sync::Arc;

use orchard_camera::{Exposure, Frame, Item, Label, MovingScene, NO_INSTANCE, Scene};
use orchard_geometry::{DepthImage, Image, Pose};
use rayon::prelude::*;

use crate::device::{Gpu, GpuError};
use crate::layout::QUAD;
use buffers::{BODY_BYTES, Buffers, Groups, Header, PIXEL_BYTES, SOLID_BYTES, Sizes, record};
pub use errors::Look;
use into::Rows;
use kept::Kept;
pub use mask::DepthMask;
pub use pictures::{Lit, PictureBatch};
use pipelines::{BOUND_THREADS, TILE};
use solids::{MOST_BODIES, MOST_MESHES, Meshes, WORDS};

/// Views that a thread packs at once, our own choice.
const PACKED: usize = 32;
/// Bytes of the largest buffer that is drawn at once, our own choice: what is more is drawn in parts.
const AT_ONCE: usize = 1 << 30;
/// Columns and rows that an image may have: their numbers have 16 bits.
const LONGEST: usize = 0xffff;

/// An image to be drawn.
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    /// The scene in front of the camera.
    pub subject: Subject<'a>,
    /// Camera, its pose, and the range of depths.
    pub exposure: Exposure,
}

/// The scene of an image: one that is sent with it, or one that the device has.
#[derive(Debug, Clone, Copy)]
pub enum Subject<'a> {
    /// A scene, which is sent to the device.
    Scene(&'a Scene),
    /// A scene that the device has ([`ImageBatch::keep`]); only the poses of its bodies are sent.
    Kept {
        /// Place where it is kept.
        place: usize,
        /// Pose of each body in the world.
        x_world_body: &'a [Pose],
    },
}

/// Draws exact depth images of many scenes at once, each as [`orchard_camera::render`] does, in f32.
///
/// Depths are those of the nearest surface along the ray of each pixel, to about 1e-6 of the depth; pixels at silhouettes may show the surface beside. Of surfaces whose depths differ by less
/// than 1e-6 the earliest item of the scene is shown. An image has the same bits in any company and from run to run on one device.
#[derive(Debug)]
pub struct ImageBatch {
    gpu: Gpu,
    buffers: Option<Buffers>,
    /// Bindings of the latest call.
    bound: Option<wgpu::BindGroup>,
    groups: Groups,
    /// Solids in the frames of bodies.
    kept: Kept<[u32; WORDS]>,
    meshes: Meshes,
    /// Number of meshes that the device has.
    meshes_sent: usize,
    errors: errors::Errors,
}

/// Solids and bodies of some successive views.
struct Packed {
    solids: Vec<[u32; WORDS]>,
    bodies: Vec<[[f32; QUAD]; 2]>,
    /// Numbers of solids and of bodies of each view.
    counts: Vec<(usize, usize)>,
}

impl ImageBatch {
    /// Makes a batch without memory; it grows with what is drawn.
    pub fn new(gpu: &Gpu) -> Self {
        Self {
            gpu: gpu.clone(),
            buffers: None,
            bound: None,
            groups: Groups::default(),
            kept: Kept::default(),
            meshes: Meshes::default(),
            meshes_sent: 0,
            errors: errors::Errors::default(),
        }
    }

    /// Keeps a scene at a place, instead of the one that is there. It is sent to the device when it is drawn next; if it is there already, nothing happens.
    pub fn keep(&mut self, place: usize, scene: &Arc<MovingScene>) {
        self.kept.put(place, scene);
    }

    /// Memory on the device \[bytes\].
    pub fn bytes(&self) -> usize {
        self.buffers.as_ref().map_or(0, |buffers| buffers.sizes.bytes()) + self.errors.bytes()
    }

    /// Draws images with labels and instances, in the order of the views.
    ///
    /// # Errors
    /// An image is larger than the device allows; the device has no room, or was lost.
    ///
    /// # Panics
    /// A view shows a place where nothing is kept, or has not a pose for every body of what is kept there.
    pub fn frames(&mut self, views: &[View<'_>]) -> Result<Vec<Frame>, GpuError> {
        self.draw(views, true, |kept, view, depths, items| {
            let (width, height) = size_of_view(view);
            let all: &[Item] = match view.subject {
                Subject::Scene(scene) => &scene.items,
                Subject::Kept { place, .. } => kept.items(place),
            };
            let shown = |item: &u32| all.get(*item as usize);
            let label = items.iter().map(|item| shown(item).map_or(Label::None, |item| item.label));
            let instance = items.iter().map(|item| shown(item).map_or(NO_INSTANCE, |item| item.instance));
            Frame {
                depth: image(width, height, depths.to_vec()),
                label: image(width, height, label.collect()),
                instance: image(width, height, instance.collect()),
            }
        })
    }

    /// Draws depth images \[m\], 0 where nothing is in range, in the order of the views.
    ///
    /// # Errors
    /// As [`Self::frames`].
    pub fn depths(&mut self, views: &[View<'_>]) -> Result<Vec<DepthImage>, GpuError> {
        self.draw(views, false, |_, view, depths, _| {
            let (width, height) = size_of_view(view);
            image(width, height, depths.to_vec())
        })
    }

    /// Draws the views of the latest call again, a number of times, and waits for the device; nothing is sent or read. It tells the speed of the device alone.
    ///
    /// # Errors
    /// The device was lost.
    pub fn draw_again(&self, times: usize) -> Result<(), GpuError> {
        let Some(bound) = &self.bound else { return Ok(()) };
        let pipelines = self.gpu.image_pipelines();
        for _ in 0..times {
            let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
            record(&mut encoder, pipelines, bound, self.groups);
            self.errors.record_again(&mut encoder);
            self.gpu.queue.submit([encoder.finish()]);
        }
        self.gpu.wait()
    }

    /// Draws images in as many calls of the device as its buffers need; `make` turns the depths and items of each image into a result.
    fn draw<T: Send>(
        &mut self,
        views: &[View<'_>],
        wants_items: bool,
        make: impl Fn(&Kept<[u32; WORDS]>, &View<'_>, &[f32], &[u32]) -> T + Sync,
    ) -> Result<Vec<T>, GpuError> {
        let mut made = Vec::with_capacity(views.len());
        self.in_parts(views, usize::MAX, |batch, range, most| {
            let now = &views[range];
            let submitted = batch.submit(now, wants_items, most, None)?;
            batch.read(now, wants_items, submitted, &make, &mut made)
        })?;
        Ok(made)
    }

    /// Calls `draw` for the ranges of views that are drawn at once, at most some, with the bytes that a buffer may have.
    fn in_parts(
        &mut self,
        views: &[View<'_>],
        most_views: usize,
        mut draw: impl FnMut(&mut Self, Range<usize>, usize) -> Result<(), GpuError>,
    ) -> Result<(), GpuError> {
        let limits = self.gpu.device.limits();
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size / 2) as usize;
        let most_views = most_views.min(limits.max_compute_workgroups_per_dimension as usize);
        self.kept.unpacked().for_each(|scene| self.meshes.add(scene.items()));
        self.kept.pack(|scene| (solids::of_bodies(scene, &self.meshes), 0));
        let mut done = 0;
        while done < views.len() {
            // An item has one solid but for hulls and uneven ground, which the limit checked below allows for.
            let bytes = |view: &View<'_>| {
                let pixels = self.pixels_shown(view).max(pixels_of_view(view));
                (PIXEL_BYTES * pixels).max(SOLID_BYTES * self.solids_of(view))
            };
            let sums = views[done..].iter().scan(0, |sum, view| {
                *sum += bytes(view);
                Some(*sum)
            });
            let count = sums.take(most_views).take_while(|sum| *sum <= AT_ONCE.min(most)).count().max(1);
            draw(self, done..done + count, most)?;
            done += count;
        }
        Ok(())
    }

    /// Sends views to the device and draws them, into the rows of an array if they are given.
    fn submit(
        &mut self,
        views: &[View<'_>],
        wants_items: bool,
        most: usize,
        into: Option<Rows<'_>>,
    ) -> Result<wgpu::SubmissionIndex, GpuError> {
        for view in views {
            if let Subject::Scene(scene) = view.subject {
                self.meshes.add(&scene.items);
            }
        }
        let (kept, meshes) = (&self.kept, &self.meshes);
        let packed: Vec<Packed> = views.par_chunks(PACKED).map(|views| pack(views, kept, meshes)).collect();
        let mut sizes = Sizes {
            views: views.len(),
            solids: kept.room(),
            corners: solids::CORNERS * meshes.len(),
            ..Sizes::default()
        };
        // Images to be measured are drawn aside.
        let drawn_into = into.filter(|_| self.errors.pixels().is_none());
        let mut headers = Vec::with_capacity(views.len());
        let counts = packed.iter().flat_map(|packed| &packed.counts);
        for (k, (view, (solids, bodies))) in views.iter().zip(counts).enumerate() {
            let size = pixels_of_view(view);
            let (first, count) = match view.subject {
                Subject::Scene(_) => (sizes.solids, *solids),
                Subject::Kept { place, .. } => (kept.first(place), kept.len(place)),
            };
            headers.push(Header {
                first: first as u32,
                count: count as u32,
                pixels: drawn_into.map_or(sizes.pixels, |into| size * into.rows[k]) as u32,
                ..header(view, wants_items, sizes)
            });
            sizes.solids += solids;
            sizes.posed += count;
            sizes.bodies += bodies;
            sizes.pixels += if drawn_into.is_none() { size } else { 0 };
        }
        // What is read may have more pixels than what is drawn.
        let shown = views.iter().map(|view| self.pixels_shown(view));
        let shown: usize = if into.is_none() { shown.sum() } else { 0 };
        let places: Vec<u32> = headers.iter().map(|header| header.pixels).collect();
        sizes.pixels = sizes.pixels.max(shown);
        sizes.items = sizes.pixels;
        sizes.read = 2 * sizes.pixels;
        self.check(views, sizes, most)?;
        let pipelines = self.gpu.image_pipelines();
        let fitting = self.buffers.take().filter(|buffers| buffers.sizes.hold(sizes));
        let is_new = fitting.is_none();
        let buffers = match fitting {
            Some(buffers) => buffers,
            None => {
                let roomy = sizes.with_room();
                Buffers::new(&self.gpu, pipelines, if roomy.largest() <= most { roomy } else { sizes })?
            }
        };
        let queue = &self.gpu.queue;
        if is_new || self.meshes_sent != self.meshes.len() {
            queue.write_buffer(&buffers.corners, 0, bytemuck::cast_slice(&self.meshes.corners()));
            self.meshes_sent = self.meshes.len();
        }
        self.kept.send(queue, &buffers.solids, 0, is_new);
        queue.write_buffer(&buffers.views, 0, bytemuck::cast_slice(&headers));
        let firsts = packed.iter().scan((self.kept.room(), 0), |(solids, bodies), packed| {
            let first = (*solids, *bodies);
            (*solids, *bodies) = (*solids + packed.solids.len(), *bodies + packed.bodies.len());
            Some(first)
        });
        let firsts: Vec<(usize, usize)> = firsts.collect();
        packed.par_iter().zip(firsts).for_each(|(packed, (solids, bodies))| {
            let (solids, bodies) = ((SOLID_BYTES * solids) as u64, (BODY_BYTES * bodies) as u64);
            queue.write_buffer(&buffers.solids, solids, bytemuck::cast_slice(&packed.solids));
            queue.write_buffer(&buffers.bodies, bodies, bytemuck::cast_slice(&packed.bodies));
        });
        let most_solids = headers.iter().map(|header| header.count as usize).max().unwrap_or(0);
        let tiles = views.iter().map(|view| tiles(size_of_view(view))).max().unwrap_or(0);
        self.groups = Groups { views: views.len(), bound: most_solids.div_ceil(BOUND_THREADS), tiles };
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let bound = match drawn_into {
            Some(into) => buffers.bind(&self.gpu, pipelines, &into.array.buffer),
            None => buffers.bindings.clone(),
        };
        record(&mut encoder, pipelines, &bound, self.groups);
        self.bound = Some(bound);
        let measured = self.errors.record(&self.gpu, &buffers.depths, &places, into, &mut encoder)?;
        let bytes = (PIXEL_BYTES * shown) as u64;
        encoder.copy_buffer_to_buffer(measured.unwrap_or(&buffers.depths), 0, &buffers.staging, 0, bytes);
        if wants_items {
            encoder.copy_buffer_to_buffer(&buffers.items, 0, &buffers.staging, bytes, bytes);
        }
        let submitted = queue.submit([encoder.finish()]);
        self.buffers = Some(buffers);
        Ok(submitted)
    }

    /// Reads what was drawn.
    fn read<T: Send>(
        &self,
        views: &[View<'_>],
        wants_items: bool,
        submitted: wgpu::SubmissionIndex,
        make: impl Fn(&Kept<[u32; WORDS]>, &View<'_>, &[f32], &[u32]) -> T + Sync,
        made: &mut Vec<T>,
    ) -> Result<(), GpuError> {
        let Some(buffers) = &self.buffers else { return Ok(()) };
        let pixels: usize = views.iter().map(|view| self.pixels_shown(view)).sum();
        let kinds = if wants_items { 2 } else { 1 };
        let empty: &[u32] = &[];
        if pixels == 0 {
            made.extend(views.iter().map(|view| make(&self.kept, view, &[], empty)));
            return self.gpu.wait_for(Some(submitted));
        }
        let slice = buffers.staging.slice(..(kinds * PIXEL_BYTES * pixels) as u64);
        // A lost device is reported by the wait.
        slice.map_async(wgpu::MapMode::Read, |_| {});
        self.gpu.wait_for(Some(submitted))?;
        let mapped = slice.get_mapped_range().map_err(|e| GpuError::Lost(e.to_string()))?;
        let (depths, items) = mapped.split_at(PIXEL_BYTES * pixels);
        let (depths, items): (&[f32], &[u32]) = (bytemuck::cast_slice(depths), bytemuck::cast_slice(items));
        let firsts = views.iter().scan(0, |end, view| {
            let first = *end;
            *end += self.pixels_shown(view);
            Some(first..*end)
        });
        let ranges: Vec<_> = firsts.collect();
        let drawn = views.par_iter().zip(ranges).map(|(view, range)| {
            let items = if wants_items { &items[range.clone()] } else { empty };
            make(&self.kept, view, &depths[range], items)
        });
        made.extend(drawn.collect::<Vec<T>>());
        drop(mapped);
        buffers.staging.unmap();
        Ok(())
    }

    /// Pixels of the image that a view becomes: a measured image may have others than the exact one.
    fn pixels_shown(&self, view: &View<'_>) -> usize {
        self.errors.pixels().unwrap_or_else(|| pixels_of_view(view))
    }

    /// Solids of a view, but for hulls and uneven ground of a scene that is sent.
    fn solids_of(&self, view: &View<'_>) -> usize {
        match view.subject {
            Subject::Scene(scene) => scene.items.len(),
            Subject::Kept { place, .. } => self.kept.len(place),
        }
    }

    /// Checks sizes against the limits of the adapter.
    fn check(&self, views: &[View<'_>], sizes: Sizes, most: usize) -> Result<(), GpuError> {
        let longest =
            views.iter().map(size_of_view).map(|(width, height)| width.max(height)).max().unwrap_or(0);
        let most_groups = self.gpu.device.limits().max_compute_workgroups_per_dimension as usize;
        let bodies = views.iter().map(|view| bodies_of(view).len()).max().unwrap_or(0);
        let groups = views.iter().map(|view| tiles(size_of_view(view))).max().unwrap_or(0);
        let solids = views.iter().map(|view| self.solids_of(view)).max().unwrap_or(0);
        let limits = [
            ("bytes in one buffer", sizes.largest(), most),
            ("shapes of leaves", self.meshes.len(), MOST_MESHES),
            ("bodies in a view", bodies, MOST_BODIES),
            ("columns or rows of an image", longest, LONGEST),
            ("tiles of an image", groups, most_groups),
            ("solids of a scene", solids, most_groups * BOUND_THREADS),
        ];
        check(&self.gpu, views.len(), &limits)
    }
}

/// Refuses what a number of views needs beyond what the adapter has.
fn check(gpu: &Gpu, views: usize, limits: &[(&'static str, usize, usize)]) -> Result<(), GpuError> {
    let beyond = limits.iter().find(|(_, needed, has)| needed > has);
    beyond.map_or(Ok(()), |&(what, needed, has)| {
        Err(GpuError::TooLarge {
            worlds: views,
            what,
            needed: needed as u64,
            adapter: gpu.info().name.clone(),
            has: has as u64,
            fits: if views == 1 { 0 } else { views * has / needed },
        })
    })
}

fn pack(views: &[View<'_>], kept: &Kept<[u32; WORDS]>, meshes: &Meshes) -> Packed {
    let mut packed = Packed { solids: Vec::new(), bodies: Vec::new(), counts: Vec::new() };
    for view in views {
        let exposure = &view.exposure;
        let before = packed.bodies.len();
        let solids = match view.subject {
            Subject::Scene(scene) => {
                packed.bodies.push(solids::pose_quads(&Pose::identity()));
                solids::push(&mut packed.solids, scene, exposure, meshes)
            }
            Subject::Kept { place, x_world_body } => {
                assert!(
                    x_world_body.len() >= kept.bodies(place),
                    "a scene with {} bodies was given {} poses",
                    kept.bodies(place),
                    x_world_body.len()
                );
                let x_camera_world = exposure.x_world_camera.inverse();
                packed.bodies.extend(x_world_body.iter().map(|x| solids::pose_quads(&(x_camera_world * x))));
                0
            }
        };
        packed.counts.push((solids, packed.bodies.len() - before));
    }
    packed
}

/// Header of a view, which comes behind others of some sizes.
fn header(view: &View<'_>, wants_items: bool, before: Sizes) -> Header {
    let k = &view.exposure.intrinsics;
    Header {
        first: 0,
        count: 0,
        posed: before.posed as u32,
        bodies: before.bodies as u32,
        pixels: before.pixels as u32,
        size: (k.width | k.height << 16) as u32,
        wants: u32::from(wants_items),
        kept_count: u32::MAX,
        focal: [k.fx as f32, k.fy as f32],
        axis: [k.cx as f32, k.cy as f32],
        near: view.exposure.near as f32,
        // Infinity has no place in a kernel.
        far: view.exposure.far.min(f64::from(f32::MAX)) as f32,
        loose_first: 0,
        // Bodies are posed before the camera.
        world_pose: u32::MAX,
    }
}

fn bodies_of<'a>(view: &View<'a>) -> &'a [Pose] {
    match view.subject {
        Subject::Scene(_) => &[],
        Subject::Kept { x_world_body, .. } => x_world_body,
    }
}

fn size_of_view(view: &View<'_>) -> (usize, usize) {
    (view.exposure.intrinsics.width, view.exposure.intrinsics.height)
}

fn pixels_of_view(view: &View<'_>) -> usize {
    let (width, height) = size_of_view(view);
    width * height
}

/// Tiles of an image.
fn tiles((width, height): (usize, usize)) -> usize {
    width.div_ceil(TILE.0) * height.div_ceil(TILE.1)
}

fn image<T>(width: usize, height: usize, pixels: Vec<T>) -> Image<T> {
    Image::from_pixels(width, height, pixels)
        .unwrap_or_else(|| unreachable!("the ranges are those of the images"))
}
