//! Draws instances of small meshes into a texture.

use std::num::NonZeroU64;

use bytemuck::{Pod, Zeroable};
use eframe::egui_wgpu::RenderState;
use orchard_geometry::Vec3;
use orchard_play::{Coarse, Drawing, Marks, Mesh};

use super::blit::{Blit, Shown};
use super::detail::{Sight, Sorted};
use super::layer::{Layer, Look};
use super::pipelines::{DEPTH, FORMAT, Pipelines};
use crate::orbit::Orbit;
use crate::stand::Stand;

/// Colour of the sky as sRGB, and direction to the sun: those of the page in a browser.
pub const SKY: [f32; 3] = [0.875, 0.91, 0.933];
const SUN: [f64; 3] = [0.42, -0.35, 0.84];
/// Samples a pixel where edges are smooth.
const SMOOTH: u32 = 4;
/// Place of level ground in the meshes of a picture, which casts no shadow.
const SQUARE: usize = 3;

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct View {
    clip_world: [f32; 16],
    eye: [f32; 4],
    sun: [f32; 4],
    sky: [f32; 4],
    ground: [f32; 4],
}

/// Everything that is drawn.
pub struct Scene<'a> {
    /// The world.
    pub drawing: &'a Drawing,
    /// Trees beside it that stand still, with their leaves or without.
    pub stand: Option<&'a Stand>,
    pub leaves: bool,
    /// The marks.
    pub mark_meshes: &'a [Mesh],
    pub marks: &'a Marks,
}

/// Textures of a size.
struct Target {
    size: [u32; 2],
    /// Several samples a pixel; none where `picture` itself is drawn on.
    colour: Option<wgpu::TextureView>,
    depth: wgpu::TextureView,
    picture: wgpu::TextureView,
    shown: Shown,
}

/// Draws a world and its marks.
pub struct Renderer {
    device: wgpu::Device,
    queue: wgpu::Queue,
    view: wgpu::Buffer,
    group: wgpu::BindGroup,
    pipelines: Pipelines,
    blit: Blit,
    sorted: Sorted,
    /// The world, but for instances that are small on the screen, which are in `coarse`; and all that casts a shadow of few triangles.
    world: Layer,
    coarse: Layer,
    shadows: Layer,
    /// Trees that stand still, brought to the device once.
    stand: Layer,
    over: Layer,
    target: Option<Target>,
    /// Samples a pixel.
    samples: u32,
    draw_calls: u32,
}

impl Renderer {
    /// True if a device draws smooth edges without taking long: not if it draws in software, where they take about as long again.
    pub fn is_fast(state: &RenderState) -> bool {
        state.adapter.get_info().device_type != wgpu::DeviceType::Cpu
    }

    /// A renderer without meshes on the device of a window.
    pub fn new(state: &RenderState, is_smooth: bool) -> Self {
        let samples = if is_smooth { SMOOTH } else { 1 };
        let device = state.device.clone();
        let view = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("view"),
            size: size_of::<View>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("view"),
            entries: &[wgpu::BindGroupLayoutEntry {
                binding: 0,
                visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
                ty: wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Uniform,
                    has_dynamic_offset: false,
                    min_binding_size: NonZeroU64::new(size_of::<View>() as u64),
                },
                count: None,
            }],
        });
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("view"),
            layout: &layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: view.as_entire_binding() }],
        });
        let pipelines = Pipelines::new(&device, &layout, samples);
        let [world, coarse, shadows, stand, over] = [(); 5].map(|()| Layer::new(&device));
        Self {
            queue: state.queue.clone(),
            device,
            view,
            group,
            pipelines,
            blit: Blit::new(&state.device, state.target_format),
            sorted: Sorted::default(),
            world,
            coarse,
            shadows,
            stand,
            over,
            target: None,
            samples,
            draw_calls: 0,
        }
    }

    /// Forgets the meshes of the world: another one follows.
    pub fn forget_world(&mut self) {
        [&mut self.world, &mut self.coarse, &mut self.shadows].into_iter().for_each(Layer::forget);
    }

    /// Forgets the trees that stand still: others follow.
    pub fn forget_stand(&mut self) {
        self.stand.forget();
    }

    /// Draw calls of the latest picture.
    pub fn draw_calls(&self) -> u32 {
        self.draw_calls
    }

    /// Brings what a view sees to the device.
    fn load(&mut self, size: [u32; 2], orbit: &Orbit, scene: &Scene<'_>) {
        let Scene { drawing, marks, .. } = scene;
        let (device, queue) = (&self.device, &self.queue);
        let (instances, coarse) = (drawing.instances(), drawing.coarse());
        let level = instances.get(SQUARE).is_some_and(|list| !list.is_empty());
        let sight = Sight::new(orbit, size, &SUN.into());
        self.sorted.sort(&sight, instances, coarse, level);
        let fine = instances.iter().enumerate().map(|(mesh, list)| match coarse.get(mesh) {
            Some(Some(_)) => &self.sorted.fine[mesh][..],
            _ => &list[..],
        });
        self.world.load(device, queue, drawing.meshes(), &fine.collect::<Vec<_>>());
        let none = Mesh::default();
        let meshes = || coarse.iter().map(|coarse| coarse.as_ref().map_or(&none, |Coarse { mesh, .. }| mesh));
        self.coarse.load(device, queue, meshes(), &slices(&self.sorted.coarse));
        self.shadows.load(device, queue, meshes(), &slices(&self.sorted.shadows));
        if let Some(stand) = scene.stand.filter(|_| self.stand.is_empty()) {
            self.stand.load(device, queue, meshes(), &slices(stand.instances()));
        }
        self.over.load(device, queue, scene.mark_meshes, &slices(marks.instances()));
    }

    /// Draws the world and its marks for a part of the window of this size \[px\].
    pub fn draw(&mut self, size: [u32; 2], orbit: &Orbit, scene: &Scene<'_>) -> Shown {
        let size = size.map(|pixels| pixels.max(1));
        if self.target.as_ref().is_none_or(|target| target.size != size) {
            self.target = Some(Target::new(&self.device, &self.blit, size, self.samples));
        }
        self.write_view(orbit, f64::from(size[0]) / f64::from(size[1]), scene.drawing.extent());
        self.load(size, orbit, scene);
        let Some(target) = &self.target else { unreachable!("it was made above") };
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("scene"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: target.colour.as_ref().unwrap_or(&target.picture),
                depth_slice: None,
                resolve_target: target.colour.as_ref().map(|_| &target.picture),
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color {
                        r: f64::from(SKY[0]),
                        g: f64::from(SKY[1]),
                        b: f64::from(SKY[2]),
                        a: 1.0,
                    }),
                    // With several samples only their mean is kept.
                    store: match target.colour {
                        Some(_) => wgpu::StoreOp::Discard,
                        None => wgpu::StoreOp::Store,
                    },
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &target.depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(1.0),
                    store: wgpu::StoreOp::Discard,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_bind_group(0, &self.group, &[]);
        let pipelines = &self.pipelines;
        // The ground comes last: most of it lies behind something, and what is hidden is not lit. Shadows on terrain would need another way.
        self.draw_calls =
            self.world.draw(&mut pass, |mesh, look| (mesh != SQUARE).then(|| pipelines.solid(look)));
        self.draw_calls += self.coarse.draw(&mut pass, |_, look| Some(pipelines.solid(look)));
        let stands = |look| scene.leaves || look != Look::Open;
        self.draw_calls += self.stand.draw(&mut pass, |_, look| stands(look).then(|| pipelines.solid(look)));
        if self.world.count(SQUARE) > 0 {
            let coarse = scene.drawing.coarse();
            let casts = |mesh: usize| mesh != SQUARE && coarse.get(mesh).is_none_or(Option::is_none);
            self.draw_calls +=
                self.world.draw(&mut pass, |mesh, look| casts(mesh).then(|| pipelines.shadow(look)));
            self.draw_calls += self.shadows.draw(&mut pass, |_, look| Some(pipelines.shadow(look)));
            self.draw_calls +=
                self.stand.draw(&mut pass, |_, look| stands(look).then(|| pipelines.shadow(look)));
            self.draw_calls +=
                self.world.draw(&mut pass, |mesh, _| (mesh == SQUARE).then(|| pipelines.level()));
        }
        self.draw_calls += self.over.draw(&mut pass, |_, _| Some(&pipelines.marks));
        drop(pass);
        self.queue.submit([encoder.finish()]);
        target.shown.clone()
    }

    fn write_view(&self, orbit: &Orbit, aspect: f64, extent: f64) {
        let of = |v: &Vec3| [v.x as f32, v.y as f32, v.z as f32, 0.0];
        let view = View {
            clip_world: orbit.clip_world(aspect),
            eye: of(&orbit.eye()),
            sun: of(&Vec3::from(SUN).normalize()),
            sky: [SKY[0], SKY[1], SKY[2], 1.0],
            ground: [extent as f32; 4],
        };
        self.queue.write_buffer(&self.view, 0, bytemuck::bytes_of(&view));
    }
}

fn slices(lists: &[Vec<f32>]) -> Vec<&[f32]> {
    lists.iter().map(Vec::as_slice).collect()
}

impl Target {
    fn new(device: &wgpu::Device, blit: &Blit, size: [u32; 2], samples: u32) -> Self {
        let texture = |format, sample_count, usage| {
            let texture = device.create_texture(&wgpu::TextureDescriptor {
                label: Some("scene"),
                size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage,
                view_formats: &[],
            });
            texture.create_view(&wgpu::TextureViewDescriptor::default())
        };
        let drawn = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let picture = texture(FORMAT, 1, drawn | wgpu::TextureUsages::TEXTURE_BINDING);
        Self {
            size,
            colour: (samples > 1).then(|| texture(FORMAT, samples, drawn)),
            depth: texture(DEPTH, samples, drawn),
            shown: blit.show(device, &picture),
            picture,
        }
    }
}
