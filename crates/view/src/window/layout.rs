//! A picture of the whole window: panels around the scene, and what lies over it.

use eframe::egui::{CentralPanel, Ui};

use super::panels;
use super::viewer::Viewer;

/// Lets a viewer take input, step its world and show everything.
pub fn show(viewer: &mut Viewer, ui: &mut Ui) {
    viewer.advance(ui);
    panels::show(viewer, ui);
    CentralPanel::no_frame().show(ui, |ui| {
        let rect = ui.max_rect();
        viewer.show_scene(ui, rect);
        panels::over_scene(viewer, ui, rect);
    });
}
