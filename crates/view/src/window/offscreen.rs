//! The window's picture without a window.

use std::time::Duration;

use eframe::egui::{self, Event, RawInput, Rect, pos2, vec2};
use eframe::egui_wgpu::{RenderState, ScreenDescriptor};
use orchard_geometry::Image;

use super::ViewError;
use super::clock::thread_time;
use super::device::{one_line, without_window};
use super::layout;
use super::viewer::Viewer;

/// Bytes to which rows of a copied texture are aligned.
const ROW: u32 = wgpu::COPY_BYTES_PER_ROW_ALIGNMENT;
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// Colour of the window before anything is drawn.
fn behind() -> wgpu::Color {
    let [r, g, b, a] = super::looks::BEHIND.to_normalized_gamma_f32().map(f64::from);
    wgpu::Color { r, g, b, a }
}

/// Draws what a window would show into a picture.
pub struct Offscreen {
    state: RenderState,
    context: egui::Context,
    size: [u32; 2],
    texture: wgpu::Texture,
    time: f64,
    /// Processor time of this thread for the latest picture, without the steps of the world.
    own_time: Duration,
}

impl Offscreen {
    /// A surface of a size \[px\].
    ///
    /// # Errors
    /// There is no graphics device, or it has no pictures of that size.
    pub fn new(size: [u32; 2]) -> Result<Self, ViewError> {
        let state = without_window()?;
        let largest = state.device.limits().max_texture_dimension_2d;
        if size.iter().any(|side| !(1..=largest).contains(side)) {
            let [width, height] = size;
            let line = format!("--size {width}x{height}: this device draws 1 to {largest} pixels a side");
            return Err(ViewError::Refused(line));
        }
        let texture = state.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("window"),
            size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: FORMAT,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let context = egui::Context::default();
        super::looks::set(&context);
        Ok(Self { state, context, size, texture, time: 0.0, own_time: Duration::ZERO })
    }

    /// The device, for a [`Viewer`].
    pub fn state(&self) -> &RenderState {
        &self.state
    }

    /// Name of the device and of its driver.
    pub fn device(&self) -> String {
        let info = self.state.adapter.get_info();
        format!("{}, {} {}", info.name, info.driver, info.driver_info)
    }

    /// Processor time of this thread for the latest picture, without the steps of the world. Where a driver in software draws, it does so on other threads.
    pub fn own_time(&self) -> Duration {
        self.own_time
    }

    /// Lets a viewer take input and draw, `elapsed` \[s\] after the last picture.
    pub fn draw(&mut self, viewer: &mut Viewer, elapsed: f64, events: Vec<Event>) {
        let start = thread_time();
        self.time += elapsed;
        let [width, height] = self.size.map(|side| side as f32);
        let input = RawInput {
            screen_rect: Some(Rect::from_min_size(pos2(0.0, 0.0), vec2(width, height))),
            time: Some(self.time),
            predicted_dt: elapsed as f32,
            focused: true,
            events,
            ..RawInput::default()
        };
        viewer.set_elapsed(elapsed);
        let mut output = self.context.run_ui(input, |ui| layout::show(viewer, ui));
        let jobs = self.context.tessellate(output.shapes, output.pixels_per_point);
        let screen =
            ScreenDescriptor { size_in_pixels: self.size, pixels_per_point: output.pixels_per_point };
        let (device, queue) = (&self.state.device, &self.state.queue);
        let mut renderer = self.state.renderer.write();
        for (id, delta) in
            output.textures_delta.set.iter().flat_map(|(id, all)| all.iter().map(move |one| (id, one)))
        {
            renderer.update_texture(device, queue, *id, delta);
        }
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let buffers = renderer.update_buffers(device, queue, &mut encoder, &jobs, &screen);
        let view = self.texture.create_view(&wgpu::TextureViewDescriptor::default());
        let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("window"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: wgpu::LoadOp::Clear(behind()), store: wgpu::StoreOp::Store },
            })],
            ..Default::default()
        });
        renderer.render(&mut pass.forget_lifetime(), &jobs, &screen);
        queue.submit(buffers.into_iter().chain([encoder.finish()]));
        let mut unused: Vec<_> = output.textures_delta.free.iter().copied().collect();
        unused.sort_unstable();
        unused.iter().for_each(|id| renderer.free_texture(id));
        output.textures_delta.clear();
        self.own_time = thread_time().saturating_sub(start).saturating_sub(viewer.costs().stepping_processor);
    }

    /// Waits for the device, as a window does before it shows a picture.
    ///
    /// # Errors
    /// The device failed.
    pub fn wait(&self) -> Result<(), ViewError> {
        let waited = self.state.device.poll(wgpu::PollType::wait_indefinitely());
        waited.map(drop).map_err(|e| ViewError::Device(one_line(&e.to_string())))
    }

    /// The latest picture.
    ///
    /// # Errors
    /// The device failed.
    pub fn picture(&self) -> Result<Image<[u8; 3]>, ViewError> {
        let [width, height] = self.size;
        let row = (4 * width).next_multiple_of(ROW);
        let device = &self.state.device;
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("picture"),
            size: u64::from(row) * u64::from(height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_texture_to_buffer(
            self.texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(row),
                    rows_per_image: None,
                },
            },
            self.texture.size(),
        );
        self.state.queue.submit([encoder.finish()]);
        buffer.map_async(wgpu::MapMode::Read, .., |_| {});
        self.wait()?;
        let failed = |e: &dyn std::fmt::Display| ViewError::Device(one_line(&e.to_string()));
        let bytes = buffer.get_mapped_range(..).map_err(|e| failed(&e))?;
        let mut image = Image::filled(width as usize, height as usize, [0; 3]);
        for v in 0..height as usize {
            let start = v * row as usize;
            for u in 0..width as usize {
                let at = start + 4 * u;
                image[(u, v)] = [bytes[at], bytes[at + 1], bytes[at + 2]];
            }
        }
        Ok(image)
    }
}
