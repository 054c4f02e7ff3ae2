//! Draws instances of small meshes into a texture.

use std::borrow::Cow;
use std::num::NonZeroU64;

use bytemuck::{Pod, Zeroable};
use eframe::egui_wgpu::RenderState;
use orchard_geometry::Vec3;
use orchard_play::{INSTANCE_FLOATS, MESH_FLOATS, Mesh};
use wgpu::util::DeviceExt;

use crate::orbit::Orbit;

/// Colour of the sky as sRGB, and direction to the sun: those of the page in a browser.
pub const SKY: [f32; 3] = [0.875, 0.91, 0.933];
const SUN: [f64; 3] = [0.42, -0.35, 0.84];
/// Samples a pixel where edges are smooth.
const SMOOTH: u32 = 4;
/// Place of level ground in the meshes of a picture, which casts no shadow.
const SQUARE: usize = 3;
const FLOAT: u64 = size_of::<f32>() as u64;
/// Format of the texture; sRGB values are written as they are, as egui does.
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct View {
    clip_world: [f32; 16],
    eye: [f32; 4],
    sun: [f32; 4],
    sky: [f32; 4],
}

/// A list of meshes on the device, with their instances.
struct Layer {
    meshes: Vec<(wgpu::Buffer, u32)>,
    instances: wgpu::Buffer,
    counts: Vec<u32>,
}

/// Lists of instances of meshes, as they are drawn.
pub struct Lists<'a> {
    /// The meshes.
    pub meshes: &'a [Mesh],
    /// The instances of each.
    pub instances: &'a [Vec<f32>],
}

/// Textures of a size.
struct Target {
    size: [u32; 2],
    /// Several samples a pixel; none where `shown` itself is drawn on.
    colour: Option<wgpu::TextureView>,
    depth: wgpu::TextureView,
    shown: wgpu::TextureView,
}

/// Draws a world and its marks.
pub struct Renderer {
    device: wgpu::Device,
    queue: wgpu::Queue,
    view: wgpu::Buffer,
    group: wgpu::BindGroup,
    solid: wgpu::RenderPipeline,
    shadow: wgpu::RenderPipeline,
    marks: wgpu::RenderPipeline,
    world: Layer,
    over: Layer,
    target: Option<Target>,
    /// Samples a pixel.
    samples: u32,
    draw_calls: u32,
}

fn vertex_attributes() -> [wgpu::VertexAttribute; 4] {
    [0, 1, 2, 3].map(|k| wgpu::VertexAttribute {
        format: wgpu::VertexFormat::Float32x3,
        offset: u64::from(k) * 3 * FLOAT,
        shader_location: k,
    })
}

fn instance_attributes() -> [wgpu::VertexAttribute; 5] {
    use wgpu::VertexFormat::{Float32, Float32x3, Float32x4};
    let formats = [(Float32x3, 0), (Float32x4, 3), (Float32x3, 7), (Float32x3, 10), (Float32, 13)];
    let mut location = 3;
    formats.map(|(format, first)| {
        location += 1;
        wgpu::VertexAttribute { format, offset: first * FLOAT, shader_location: location }
    })
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
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("scene"),
            source: wgpu::ShaderSource::Wgsl(Cow::Borrowed(include_str!("scene.wgsl"))),
        });
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
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("scene"),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let make = |vertex: &str, fragment: &str, blends: bool| {
            pipeline(&device, &module, &pipeline_layout, [vertex, fragment], blends, samples)
        };
        let solid = make("vertex", "fragment", false);
        let shadow = make("shadow_vertex", "shadow_fragment", false);
        let marks = make("vertex", "mark_fragment", true);
        let layer =
            || Layer { meshes: Vec::new(), instances: instance_buffer(&device, 1), counts: Vec::new() };
        let (world, over) = (layer(), layer());
        let queue = state.queue.clone();
        Self {
            device,
            queue,
            view,
            group,
            solid,
            shadow,
            marks,
            world,
            over,
            target: None,
            samples,
            draw_calls: 0,
        }
    }

    /// Forgets the meshes of the world: another one follows.
    pub fn forget_world(&mut self) {
        self.world.meshes.clear();
    }

    /// Draw calls of the latest picture.
    pub fn draw_calls(&self) -> u32 {
        self.draw_calls
    }

    /// Draws the world and its marks, and returns the texture; the second value is true if it is another one than last time.
    pub fn draw(
        &mut self,
        size: [u32; 2],
        orbit: &Orbit,
        world: &Lists<'_>,
        marks: &Lists<'_>,
    ) -> (&wgpu::TextureView, bool) {
        let size = size.map(|pixels| pixels.max(1));
        let is_new = self.target.as_ref().is_none_or(|target| target.size != size);
        if is_new {
            self.target = Some(Target::new(&self.device, size, self.samples));
        }
        self.write_view(orbit, f64::from(size[0]) / f64::from(size[1]));
        self.world.load(&self.device, &self.queue, world);
        self.over.load(&self.device, &self.queue, marks);
        let Some(target) = &self.target else { unreachable!("it was made above") };
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("scene"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: target.colour.as_ref().unwrap_or(&target.shown),
                depth_slice: None,
                resolve_target: target.colour.as_ref().map(|_| &target.shown),
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
        // Shadows on terrain would need another way.
        let level = self.world.counts.get(SQUARE).is_some_and(|count| *count > 0);
        pass.set_pipeline(&self.solid);
        self.draw_calls = self.world.draw(&mut pass, |_| true);
        if level {
            pass.set_pipeline(&self.shadow);
            self.draw_calls += self.world.draw(&mut pass, |mesh| mesh != SQUARE);
        }
        pass.set_pipeline(&self.marks);
        self.draw_calls += self.over.draw(&mut pass, |_| true);
        drop(pass);
        self.queue.submit([encoder.finish()]);
        (&target.shown, is_new)
    }

    fn write_view(&self, orbit: &Orbit, aspect: f64) {
        let of = |v: &Vec3| [v.x as f32, v.y as f32, v.z as f32, 0.0];
        let view = View {
            clip_world: orbit.clip_world(aspect),
            eye: of(&orbit.eye()),
            sun: of(&Vec3::from(SUN).normalize()),
            sky: [SKY[0], SKY[1], SKY[2], 1.0],
        };
        self.queue.write_buffer(&self.view, 0, bytemuck::bytes_of(&view));
    }
}

fn pipeline(
    device: &wgpu::Device,
    module: &wgpu::ShaderModule,
    layout: &wgpu::PipelineLayout,
    [vertex, fragment]: [&str; 2],
    blends: bool,
    samples: u32,
) -> wgpu::RenderPipeline {
    let (of_vertex, of_instance) = (vertex_attributes(), instance_attributes());
    let buffer = |floats: usize, step_mode, attributes| {
        Some(wgpu::VertexBufferLayout { array_stride: floats as u64 * FLOAT, step_mode, attributes })
    };
    let buffers = [
        buffer(MESH_FLOATS, wgpu::VertexStepMode::Vertex, &of_vertex[..]),
        buffer(INSTANCE_FLOATS, wgpu::VertexStepMode::Instance, &of_instance[..]),
    ];
    let blend = blends.then_some(wgpu::BlendState::ALPHA_BLENDING);
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(fragment),
        layout: Some(layout),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some(vertex),
            compilation_options: Default::default(),
            buffers: &buffers,
        },
        primitive: Default::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(!blends),
            depth_compare: Some(wgpu::CompareFunction::Less),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: wgpu::MultisampleState { count: samples, ..Default::default() },
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some(fragment),
            compilation_options: Default::default(),
            targets: &[Some(wgpu::ColorTargetState {
                format: FORMAT,
                blend,
                write_mask: wgpu::ColorWrites::ALL,
            })],
        }),
        multiview_mask: None,
        cache: None,
    })
}

fn instance_buffer(device: &wgpu::Device, floats: usize) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("instances"),
        size: floats.max(1).next_power_of_two() as u64 * FLOAT,
        usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

impl Layer {
    /// Brings meshes that are not there yet and all instances to the device.
    fn load(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, lists: &Lists<'_>) {
        for mesh in lists.meshes.iter().skip(self.meshes.len()) {
            let buffer = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("mesh"),
                contents: bytemuck::cast_slice(&mesh.floats),
                usage: wgpu::BufferUsages::VERTEX,
            });
            self.meshes.push((buffer, 3 * mesh.triangles() as u32));
        }
        let floats: usize = lists.instances.iter().map(Vec::len).sum();
        if self.instances.size() < floats as u64 * FLOAT {
            self.instances = instance_buffer(device, floats);
        }
        let mut offset = 0;
        for list in lists.instances.iter().filter(|list| !list.is_empty()) {
            queue.write_buffer(&self.instances, offset, bytemuck::cast_slice(list));
            offset += list.len() as u64 * FLOAT;
        }
        self.counts = lists.instances.iter().map(|list| (list.len() / INSTANCE_FLOATS) as u32).collect();
    }

    /// Draws the instances of all meshes that are wanted; returns the number of draw calls.
    fn draw(&self, pass: &mut wgpu::RenderPass<'_>, wanted: impl Fn(usize) -> bool) -> u32 {
        let (mut offset, mut calls) = (0, 0);
        for (mesh, (count, (buffer, vertices))) in self.counts.iter().zip(&self.meshes).enumerate() {
            if *count > 0 && *vertices > 0 && wanted(mesh) {
                pass.set_vertex_buffer(0, buffer.slice(..));
                pass.set_vertex_buffer(1, self.instances.slice(offset..));
                pass.draw(0..*vertices, 0..*count);
                calls += 1;
            }
            offset += u64::from(*count) * INSTANCE_FLOATS as u64 * FLOAT;
        }
        calls
    }
}

impl Target {
    fn new(device: &wgpu::Device, size: [u32; 2], samples: u32) -> Self {
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
        Self {
            size,
            colour: (samples > 1).then(|| texture(FORMAT, samples, drawn)),
            depth: texture(DEPTH, samples, drawn),
            shown: texture(FORMAT, 1, drawn | wgpu::TextureUsages::TEXTURE_BINDING),
        }
    }
}
