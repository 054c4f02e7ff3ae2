//! Colours and sizes of panels.

use eframe::egui::{self, Color32, Context};
use orchard_play::Colour;

/// Sets them once: a light look, as the scene is light.
pub fn set(context: &Context) {
    context.set_theme(egui::Theme::Light);
}

/// A colour of marks and instances for panels.
pub fn colour(colour: Colour) -> Color32 {
    let [r, g, b] = colour.map(|channel| (channel.clamp(0.0, 1.0) * 255.0).round() as u8);
    Color32::from_rgb(r, g, b)
}
