//! The window.

use eframe::egui::{self, ViewportBuilder};
use eframe::{CreationContext, Frame, NativeOptions};
use orchard_play::Overlays;

use super::ViewError;
use super::device::{DITHERS, configuration, one_line};
use super::layout;
use super::viewer::Viewer;
use crate::stage::Stage;

/// A viewer in a window.
struct App {
    viewer: Viewer,
    #[cfg(feature = "gamepad")]
    gamepads: super::gamepad::Gamepads,
}

impl eframe::App for App {
    fn ui(&mut self, ui: &mut egui::Ui, frame: &mut Frame) {
        self.viewer.set_elapsed(f64::from(ui.input(|input| input.unstable_dt)));
        if let Some(time) = frame.info().cpu_usage {
            self.viewer.set_window_time(f64::from(time));
        }
        #[cfg(feature = "gamepad")]
        self.viewer.tell_pad(self.gamepads.events());
        layout::show(&mut self.viewer, ui);
        ui.ctx().request_repaint();
    }

    fn clear_color(&self, _: &egui::Visuals) -> [f32; 4] {
        super::looks::BEHIND.to_normalized_gamma_f32()
    }
}

/// Opens a window of a size \[points\], with a number of trees, and returns when it is closed.
///
/// # Errors
/// There is no screen or no graphics device.
pub fn open(stage: Stage, overlays: Overlays, size: [u32; 2], trees: u32) -> Result<(), ViewError> {
    let [width, height] = size.map(|side| side as f32);
    let options = NativeOptions {
        viewport: ViewportBuilder::default().with_inner_size([width, height]).with_title("OrchardBench"),
        wgpu_options: configuration(),
        dithering: DITHERS,
        ..NativeOptions::default()
    };
    let make = move |creation: &CreationContext<'_>| -> Result<Box<dyn eframe::App>, _> {
        let state = creation.wgpu_render_state.as_ref().ok_or("the window has no graphics device")?;
        super::looks::set(&creation.egui_ctx);
        let mut viewer = Viewer::new(stage, overlays, state);
        viewer.show_trees(trees)?;
        let app: Box<dyn eframe::App> = Box::new(App {
            viewer,
            #[cfg(feature = "gamepad")]
            gamepads: super::gamepad::Gamepads::find(),
        });
        Ok(app)
    };
    eframe::run_native("orchard-view", options, Box::new(make)).map_err(|e| {
        let line = one_line(&e.to_string());
        match e {
            eframe::Error::Winit(_) | eframe::Error::WinitEventLoop(_) => ViewError::NoScreen,
            eframe::Error::Wgpu(_) => ViewError::NoAdapter(line),
            eframe::Error::AppCreation(_) => ViewError::Device(line),
        }
    })
}
