//! The graphics device.

use eframe::egui_wgpu::{RenderState, RendererOptions, WgpuConfiguration, WgpuSetup, WgpuSetupCreateNew};

use super::ViewError;

/// Backends that this build has: no OpenGL, so that every picture comes from the same few drivers.
const BACKENDS: wgpu::Backends =
    wgpu::Backends::VULKAN.union(wgpu::Backends::METAL).union(wgpu::Backends::DX12);

/// False: panels have no ramps of colour, and each of their pixels would take longer.
pub const DITHERS: bool = false;

/// How a window finds its device.
pub fn configuration() -> WgpuConfiguration {
    let mut create = WgpuSetupCreateNew::without_display_handle();
    create.instance_descriptor.backends = BACKENDS;
    WgpuConfiguration { wgpu_setup: WgpuSetup::CreateNew(create), ..WgpuConfiguration::default() }
}

/// A device without a window.
///
/// # Errors
/// There is none.
pub fn without_window() -> Result<RenderState, ViewError> {
    let configuration = configuration();
    let state = async {
        let instance = configuration.wgpu_setup.new_instance().await;
        let options = RendererOptions { dithering: DITHERS, ..RendererOptions::default() };
        RenderState::create(&configuration, &instance, None, options).await
    };
    pollster::block_on(state).map_err(|e| ViewError::NoAdapter(one_line(&e.to_string())))
}

/// A message on one line.
pub fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
