//! Colour pictures of many scenes at once.

mod plan;
pub(super) mod table;

use std::ops::Range;
use std::sync::Arc;

use orchard_camera::picture::PictureStyle;
use orchard_camera::picture::recipe::Palette;
use orchard_camera::{MovingScene, Scene};
use orchard_geometry::{Image, Intrinsics, Pose};
use wgpu::BufferUsages;

use super::buffers::{Buffers, Groups, MORE, PIXEL_BYTES, SOLID_BYTES, record};
use super::kept::Kept;
use super::pipelines::PICTURE_THREADS;
use super::solids::{MOST_BODIES, MOST_MESHES, Meshes, WORDS, of_bodies};
use super::{LONGEST, check};
use crate::arrays::DeviceArray;
use crate::buffers::{allocated, create_buffer};
use crate::device::{Gpu, GpuError};
use plan::Plan;
use table::Words;

/// Bytes of the depths of pictures and shadow maps that are drawn at once, our own choice: what is more is drawn in parts.
const AT_ONCE: usize = 1 << 29;

/// A lit scene, and the cameras that see it.
#[derive(Debug, Clone, Copy)]
pub struct Lit<'a> {
    /// Place of a scene that the device keeps ([`PictureBatch::keep`]), and the pose of each of its bodies in the world; `None` if all is sent.
    pub kept: Option<(usize, &'a [Pose])>,
    /// Items that are sent, posed in the world. They come behind those of the kept scene.
    pub loose: &'a Scene,
    /// Light and image quality.
    pub style: PictureStyle,
    /// Cameras with their poses.
    pub cameras: &'a [(Intrinsics, Pose)],
}

/// Draws colour pictures of many scenes at once, each as [`orchard_camera::picture::Studio`] does, in f32: light, shadow, textures and display curve are the same. A pixel at a silhouette or at the edge of a shadow may
/// show what is beside it; others differ by a step or two of 255. A picture has the same bits in any company and from run to run on one device.
#[derive(Debug)]
pub struct PictureBatch {
    gpu: Gpu,
    meshes: Meshes,
    palette: Palette,
    /// Solids and items of scenes that the device keeps.
    solids: Kept<[u32; WORDS]>,
    items: Kept<Words>,
    buffers: Option<Buffers>,
    own: Option<Own>,
    /// Work of the latest call, for [`PictureBatch::draw_again`].
    recorded: Option<Recorded>,
}

/// Buffers of pictures alone.
#[derive(Debug)]
struct Own {
    /// Quads, pixels and words that they have room for.
    sizes: [usize; 3],
    table: wgpu::Buffer,
    colours: wgpu::Buffer,
    packed: wgpu::Buffer,
}

#[derive(Debug)]
struct Recorded {
    /// Bindings and workgroups that draw pictures, the sun's maps, and the sky's.
    drawn: [(wgpu::BindGroup, Groups); 3],
    light: wgpu::BindGroup,
    pack: wgpu::BindGroup,
    /// Pixels of the largest picture, and number of pictures.
    most: usize,
    shots: usize,
}

impl PictureBatch {
    /// Makes a batch without memory; it grows with what is drawn.
    pub fn new(gpu: &Gpu) -> Self {
        Self {
            gpu: gpu.clone(),
            meshes: Meshes::default(),
            palette: Palette::default(),
            solids: Kept::default(),
            items: Kept::default(),
            buffers: None,
            own: None,
            recorded: None,
        }
    }

    /// Keeps a scene at a place, instead of the one that is there. It is sent to the device when it is drawn next; if it is there already, nothing happens.
    pub fn keep(&mut self, place: usize, scene: &Arc<MovingScene>) {
        self.solids.put(place, scene);
        self.items.put(place, scene);
    }

    /// Draws the pictures of each scene (sRGB), in the order of its cameras.
    ///
    /// # Errors
    /// A picture or shadow map is larger than the device allows; the device has no room, or was lost.
    ///
    /// # Panics
    /// Nothing is kept at the place of a scene, or there is not a pose for every body of what is kept there.
    pub fn pictures(&mut self, lit: &[Lit<'_>]) -> Result<Vec<Vec<Image<[u8; 3]>>>, GpuError> {
        let mut made = Vec::with_capacity(lit.len());
        self.in_parts(lit, |batch, range| {
            let (plan, mut encoder) = batch.record(&lit[range.clone()])?;
            let bytes = (PIXEL_BYTES * plan.words) as u64;
            if let (Some(own), Some(buffers), true) = (&batch.own, &batch.buffers, bytes > 0) {
                encoder.copy_buffer_to_buffer(&own.packed, 0, &buffers.staging, 0, bytes);
            }
            let submitted = batch.gpu.queue.submit([encoder.finish()]);
            batch.read(&lit[range], &plan, submitted, &mut made)
        })?;
        Ok(made)
    }

    /// Draws the pictures of each scene into a row of arrays, one array for each camera of a scene, and returns at once: they have the bytes of [`Self::pictures`], and are there once the queue has come to it.
    ///
    /// # Errors
    /// As [`Self::pictures`].
    ///
    /// # Panics
    /// As [`Self::pictures`]; there is not a row for each scene and an array for each camera, or a picture has other bytes than a row, or a row has not whole words.
    pub fn pictures_into(
        &mut self,
        lit: &[Lit<'_>],
        arrays: &[&DeviceArray],
        rows: &[usize],
    ) -> Result<(), GpuError> {
        assert_eq!(lit.len(), rows.len(), "rows of pictures");
        self.in_parts(lit, |batch, range| {
            let (plan, mut encoder) = batch.record(&lit[range.clone()])?;
            if let Some(own) = &batch.own {
                let mut shots = plan.shots.iter();
                for (lit, row) in lit[range.clone()].iter().zip(&rows[range]) {
                    assert_eq!(lit.cameras.len(), arrays.len(), "arrays of pictures");
                    for (array, shot) in arrays.iter().zip(shots.by_ref()) {
                        array.assert_row(*row, shot.bytes);
                        let (from, to) = ((PIXEL_BYTES * shot.words) as u64, (row * shot.bytes) as u64);
                        encoder.copy_buffer_to_buffer(
                            &own.packed,
                            from,
                            &array.buffer,
                            to,
                            shot.bytes as u64,
                        );
                    }
                }
            }
            batch.gpu.queue.submit([encoder.finish()]);
            Ok(())
        })
    }

    /// Draws the pictures of the latest call again, or of its last part, a number of times, and waits for the device; nothing is sent or read. It tells the speed of the device alone. Returns the number of pictures.
    ///
    /// # Errors
    /// The device was lost.
    pub fn draw_again(&self, times: usize) -> Result<usize, GpuError> {
        let Some(recorded) = &self.recorded else { return Ok(0) };
        for _ in 0..times {
            let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
            recorded.record(&self.gpu, &mut encoder);
            self.gpu.queue.submit([encoder.finish()]);
        }
        self.gpu.wait()?;
        Ok(recorded.shots)
    }

    /// Calls `draw` for the ranges of scenes that are drawn at once.
    fn in_parts(
        &mut self,
        lit: &[Lit<'_>],
        mut draw: impl FnMut(&mut Self, Range<usize>) -> Result<(), GpuError>,
    ) -> Result<(), GpuError> {
        let limits = self.gpu.device.limits();
        let most = AT_ONCE.min(self.most_bytes());
        let most_views = limits.max_compute_workgroups_per_dimension as usize;
        self.solids.unpacked().for_each(|scene| self.meshes.add(scene.items()));
        self.solids.pack(|scene| plan::casters_first(scene.items(), of_bodies(scene, &self.meshes)));
        self.items.pack(|scene| table::items(&self.palette, scene.items()));
        let mut done = 0;
        while done < lit.len() {
            let sums = lit[done..].iter().scan([0; 3], |sums, lit| {
                let needs = plan::needs(lit, self);
                sums.iter_mut().zip(needs).for_each(|(sum, needs)| *sum += needs);
                Some(*sums)
            });
            let limits = [most, most, most_views];
            let fit = sums.take_while(|sums| sums.iter().zip(limits).all(|(sum, limit)| *sum <= limit));
            let count = fit.count().max(1);
            draw(self, done..done + count)?;
            done += count;
        }
        Ok(())
    }

    /// Bytes that a buffer may have.
    fn most_bytes(&self) -> usize {
        let limits = self.gpu.device.limits();
        limits.max_storage_buffer_binding_size.min(limits.max_buffer_size) as usize
    }

    /// Sends scenes to the device, and records what draws their pictures.
    fn record(&mut self, lit: &[Lit<'_>]) -> Result<(Plan, wgpu::CommandEncoder), GpuError> {
        lit.iter().for_each(|lit| self.meshes.add(&lit.loose.items));
        let plan = Plan::new(lit, self);
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        if plan.shots.is_empty() {
            self.recorded = None;
            return Ok((plan, encoder));
        }
        let most_groups = self.gpu.device.limits().max_compute_workgroups_per_dimension as usize;
        let groups = plan.kinds.map(|(_, groups)| groups);
        let largest = plan.shots.iter().map(|shot| shot.width * shot.height).max().unwrap_or(0);
        let limits = [
            (
                "bytes in one buffer",
                plan.sizes.largest().max(size_of::<Words>() * plan.table),
                self.most_bytes(),
            ),
            ("shapes of leaves", self.meshes.len(), MOST_MESHES),
            ("bodies in a view", plan.most_bodies, MOST_BODIES),
            ("columns or rows of an image", plan.longest, LONGEST),
            ("tiles of an image", groups.iter().map(|g| g.tiles).max().unwrap_or(0), most_groups),
            ("solids of a scene", groups.iter().map(|g| g.bound).max().unwrap_or(0), most_groups),
            ("pixels of a picture", largest, most_groups * PICTURE_THREADS),
            ("views of pictures", groups.iter().map(|g| g.views).max().unwrap_or(0), most_groups),
        ];
        check(&self.gpu, lit.len(), &limits)?;
        let [new_solids, new_table] = self.reserve(&plan)?;
        let (Some(buffers), Some(own)) = (&self.buffers, &self.own) else {
            unreachable!("they were reserved")
        };
        let (queue, pipelines) = (&self.gpu.queue, self.gpu.image_pipelines());
        queue.write_buffer(&buffers.corners, 0, bytemuck::cast_slice(&self.meshes.corners()));
        queue.write_buffer(&buffers.views, 0, bytemuck::cast_slice(&plan.headers));
        queue.write_buffer(&buffers.bodies, 0, bytemuck::cast_slice(&plan.bodies));
        self.solids.send(queue, &buffers.solids, 0, new_solids);
        let behind = (SOLID_BYTES * self.solids.room()) as u64;
        queue.write_buffer(&buffers.solids, behind, bytemuck::cast_slice(&plan.solids));
        let head = size_of::<Words>() * table::HEAD;
        self.items.send(queue, &own.table, head, new_table);
        let shots = table::HEAD + self.items.room();
        queue.write_buffer(&own.table, 0, bytemuck::cast_slice(&table::head(shots as u32)));
        let behind = (size_of::<Words>() * shots) as u64;
        queue.write_buffer(&own.table, behind, bytemuck::cast_slice(&plan.quads));
        let given = [&own.table, &own.colours];
        let recorded = Recorded {
            drawn: plan.kinds.map(|(first, groups)| (buffers.bind_from(&self.gpu, pipelines, first), groups)),
            light: buffers.bind_lit(&self.gpu, pipelines, given, None),
            pack: buffers.bind_lit(&self.gpu, pipelines, given, Some(&own.packed)),
            most: largest,
            shots: plan.shots.len(),
        };
        recorded.record(&self.gpu, &mut encoder);
        self.recorded = Some(recorded);
        Ok((plan, encoder))
    }

    /// Makes room for a plan, and tells whether the buffers of solids and of the table are new.
    fn reserve(&mut self, plan: &Plan) -> Result<[bool; 2], GpuError> {
        let (gpu, most) = (&self.gpu, self.most_bytes());
        let mut are_new = [false; 2];
        if self.buffers.as_ref().is_none_or(|buffers| !buffers.sizes.hold(plan.sizes)) {
            self.buffers = None;
            let roomy = plan.sizes.with_room();
            let sizes = if roomy.largest() <= most { roomy } else { plan.sizes };
            self.buffers = Some(Buffers::new(gpu, gpu.image_pipelines(), sizes)?);
            are_new[0] = true;
        }
        let needs = [plan.table, plan.pixels, plan.words];
        let holds = |own: &Own| own.sizes.iter().zip(needs).all(|(has, needs)| *has >= needs);
        if self.own.as_ref().is_none_or(|own| !holds(own)) {
            self.own = None;
            let bytes = [size_of::<Words>(), PIXEL_BYTES, PIXEL_BYTES];
            let roomy = needs.map(|n| n + n / MORE);
            let fits = roomy.iter().zip(bytes).all(|(n, bytes)| n * bytes <= most);
            let (sizes, shots) = (if fits { roomy } else { needs }, plan.shots.len());
            let each = sizes.iter().zip(bytes).map(|(n, bytes)| n * bytes).sum::<usize>() / shots;
            let made = allocated(gpu, shots, each, |some| {
                let part = sizes.map(|n| (n * some).div_ceil(shots));
                Own::new(gpu, part)
            });
            match made {
                Ok(own) => self.own = Some(own),
                Err(e) => {
                    // The other buffers are new and have no scenes: they are made again.
                    self.buffers = None;
                    return Err(e);
                }
            }
            are_new[1] = true;
        }
        Ok(are_new)
    }

    /// Reads what was drawn.
    fn read(
        &self,
        lit: &[Lit<'_>],
        plan: &Plan,
        submitted: wgpu::SubmissionIndex,
        made: &mut Vec<Vec<Image<[u8; 3]>>>,
    ) -> Result<(), GpuError> {
        let Some(buffers) = self.buffers.as_ref().filter(|_| plan.words > 0) else {
            made.extend(lit.iter().map(|lit| lit.cameras.iter().map(|(k, _)| empty(k)).collect()));
            return self.gpu.wait_for(Some(submitted));
        };
        let slice = buffers.staging.slice(..(PIXEL_BYTES * plan.words) as u64);
        // A lost device is reported by the wait.
        slice.map_async(wgpu::MapMode::Read, |_| {});
        self.gpu.wait_for(Some(submitted))?;
        let mapped = slice.get_mapped_range().map_err(|e| GpuError::Lost(e.to_string()))?;
        let mut shots = plan.shots.iter();
        for lit in lit {
            let of_scene = shots.by_ref().take(lit.cameras.len()).map(|shot| {
                let first = PIXEL_BYTES * shot.words;
                let pixels = mapped[first..first + shot.bytes].as_chunks::<3>().0.to_vec();
                super::image(shot.width, shot.height, pixels)
            });
            made.push(of_scene.collect());
        }
        drop(mapped);
        buffers.staging.unmap();
        Ok(())
    }
}

fn empty(k: &Intrinsics) -> Image<[u8; 3]> {
    Image::filled(k.width, k.height, [0; 3])
}

impl Own {
    fn new(gpu: &Gpu, sizes: [usize; 3]) -> Self {
        let written = BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::COPY_SRC;
        let [quads, pixels, words] = sizes;
        Self {
            sizes,
            table: create_buffer(gpu, "table of pictures", size_of::<Words>() * quads, written),
            colours: create_buffer(gpu, "colours", PIXEL_BYTES * pixels, written),
            packed: create_buffer(gpu, "packed colours", PIXEL_BYTES * words, written),
        }
    }
}

impl Recorded {
    fn record(&self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder) {
        let pipelines = gpu.image_pipelines();
        for (bound, groups) in self.drawn.iter().filter(|(_, groups)| groups.views > 0) {
            record(encoder, pipelines, bound, *groups);
        }
        let mut pass = encoder.begin_compute_pass(&Default::default());
        let words = (3 * self.most).div_ceil(PIXEL_BYTES);
        for (kernel, bound, threads) in
            [(&pipelines.light, &self.light, self.most), (&pipelines.pack, &self.pack, words)]
        {
            if threads > 0 {
                pass.set_pipeline(kernel);
                pass.set_bind_group(0, bound, &[]);
                pass.dispatch_workgroups(threads.div_ceil(PICTURE_THREADS) as u32, self.shots as u32, 1);
            }
        }
    }
}
