//! Colours and sizes of panels.

use eframe::egui::{self, Color32, Context};
use orchard_play::Colour;

/// Colour of a text over the scene.
pub const INK: Color32 = Color32::from_rgb(30, 30, 30);

/// Colour of the window before anything is drawn, which is that of panels.
pub const BEHIND: Color32 = Color32::from_gray(248);

/// Sets them once: a light look, as the scene is light. Panels are not filled: the window has their colour, and to fill them takes a driver in software a third of its time.
pub fn set(context: &Context) {
    context.set_theme(egui::Theme::Light);
    context.all_styles_mut(|style| style.visuals.panel_fill = Color32::TRANSPARENT);
}

/// A colour of marks and instances for panels.
pub fn shade(colour: Colour) -> Color32 {
    let [r, g, b] = colour.map(|channel| (channel.clamp(0.0, 1.0) * 255.0).round() as u8);
    Color32::from_rgb(r, g, b)
}
