//! Plots of contact force and fruit over time.

use eframe::egui::{Ui, Vec2b};
use egui_plot::{Corner, Legend, Line, Plot, PlotPoints};
use orchard_play::{Sample, Trace, colour};

use super::looks::shade;

/// Shows both plots side by side, of a height [points].
pub fn show(trace: &Trace, ui: &mut Ui, height: f32) {
    let width = 0.5 * ui.available_width() - 4.0;
    let points = |figure: fn(&Sample) -> f64| -> PlotPoints<'_> {
        trace.samples().map(|sample| [sample.time, figure(sample)]).collect()
    };
    ui.horizontal(|ui| {
        let plot = |name: &str| {
            Plot::new(name.to_owned())
                .width(width)
                .height(height)
                .show_background(false)
                .legend(Legend::default().position(Corner::LeftTop))
                .allow_drag(Vec2b::FALSE)
                .allow_zoom(Vec2b::FALSE)
                .allow_scroll(Vec2b::FALSE)
                .allow_boxed_zoom(false)
                .include_y(0.0)
                .include_y(1.0)
        };
        plot("force").show(ui, |plot| {
            let line = |name: &str, figure: fn(&Sample) -> f64, tint| {
                Line::new(name.to_owned(), points(figure)).color(shade(tint))
            };
            plot.line(line("force on wood, N", |sample| sample.on_wood, colour::RED));
            plot.line(line("force in the hand, N", |sample| sample.in_hand, colour::BLUE));
        });
        plot("fruit").show(ui, |plot| {
            let line = |name: &str, figure: fn(&Sample) -> f64, tint| {
                Line::new(name.to_owned(), points(figure)).color(shade(tint))
            };
            plot.line(line("fruit in the bucket", |sample| f64::from(sample.picked), colour::GREEN));
            plot.line(line("fruit on the ground", |sample| f64::from(sample.dropped), colour::ORANGE));
        });
    });
}
