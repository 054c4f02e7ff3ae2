//! Ways to draw meshes.

use std::borrow::Cow;

use orchard_play::{INSTANCE_FLOATS, MESH_FLOATS};

use super::layer::{FLOAT, Look};

/// Format of the texture; sRGB values are written as they are, as egui does.
pub const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
pub const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// Ways to draw meshes.
pub struct Pipelines {
    /// Lit by the pixel.
    facets: wgpu::RenderPipeline,
    /// Lit by the corner.
    closed: wgpu::RenderPipeline,
    open: wgpu::RenderPipeline,
    level: wgpu::RenderPipeline,
    shadow_closed: wgpu::RenderPipeline,
    shadow_open: wgpu::RenderPipeline,
    /// Marks let through what is behind them.
    pub marks: wgpu::RenderPipeline,
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

impl Pipelines {
    /// Pipelines with a number of samples a pixel, for a layout of what shaders are told.
    pub fn new(device: &wgpu::Device, layout: &wgpu::BindGroupLayout, samples: u32) -> Self {
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("scene"),
            source: wgpu::ShaderSource::Wgsl(Cow::Borrowed(include_str!("scene.wgsl"))),
        });
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("scene"),
            bind_group_layouts: &[Some(layout)],
            immediate_size: 0,
        });
        let make = |shaders: [&str; 2], back: Option<wgpu::Face>, blends: bool| {
            pipeline(device, &module, &layout, shaders, back, blends, samples)
        };
        let hidden = Some(wgpu::Face::Back);
        Self {
            facets: make(["vertex", "fragment"], None, false),
            closed: make(["closed_vertex", "lit_fragment"], hidden, false),
            open: make(["open_vertex", "lit_fragment"], None, false),
            level: make(["level_vertex", "level_fragment"], hidden, false),
            // Light comes from above, as the view does: what the sun does not see, the eye does not see of a shadow.
            shadow_closed: make(["shadow_vertex", "shadow_fragment"], hidden, false),
            shadow_open: make(["shadow_vertex", "shadow_fragment"], None, false),
            marks: make(["vertex", "mark_fragment"], None, true),
        }
    }

    /// Draws a mesh itself.
    pub fn solid(&self, look: Look) -> &wgpu::RenderPipeline {
        match look {
            Look::Closed => &self.closed,
            Look::Open => &self.open,
            Look::Facets => &self.facets,
        }
    }

    /// Draws level ground.
    pub fn level(&self) -> &wgpu::RenderPipeline {
        &self.level
    }

    /// Draws a mesh's shadow on level ground.
    pub fn shadow(&self, look: Look) -> &wgpu::RenderPipeline {
        match look {
            Look::Closed => &self.shadow_closed,
            Look::Open | Look::Facets => &self.shadow_open,
        }
    }
}

fn pipeline(
    device: &wgpu::Device,
    module: &wgpu::ShaderModule,
    layout: &wgpu::PipelineLayout,
    [vertex, fragment]: [&str; 2],
    hidden: Option<wgpu::Face>,
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
        primitive: wgpu::PrimitiveState { cull_mode: hidden, ..Default::default() },
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
