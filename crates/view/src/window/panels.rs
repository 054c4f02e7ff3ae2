//! Panels beside and over the scene.

use eframe::egui::{
    self, Align2, Button, ComboBox, DragValue, FontId, Frame, Grid, Image, Panel, Rect, RichText, ScrollArea,
    Slider, Ui, pos2, vec2,
};
use orchard_geometry::Vec3;
use orchard_picker::Event;
use orchard_play::{Overlay, line, load_colour, state_name};

use super::keys::{self, Action};
use super::looks::{INK, shade};
use super::plots;
use super::viewer::{Viewer, WristPicture};
use crate::pace::SCALES;
use crate::pad::PAD;
use crate::stage::Dials;

/// Width of the panel of dials [points], and height of that of plots.
const LEFT: f32 = 264.0;
const BOTTOM: f32 = 140.0;
/// Width of a picture of the wrist camera [points].
const PICTURE: f32 = 232.0;
/// Lines of the controller's log.
const LINES: usize = 7;

/// Shows all panels.
pub fn show(viewer: &mut Viewer, ui: &mut Ui) {
    Panel::left("dials").exact_size(LEFT).resizable(false).show(ui, |ui| {
        ScrollArea::vertical().show(ui, |ui| {
            run(viewer, ui);
            ui.separator();
            dials(viewer, ui);
            ui.separator();
            switches(viewer, ui);
            if let Some([rate, own]) = viewer.rate {
                let (own, calls) = (own * 1e3, viewer.costs().draw_calls);
                ui.add_space(6.0);
                ui.weak(format!("{rate:.0} pictures a second, {own:.1} ms each, {calls} draw calls"));
            }
        });
    });
    if let Some(frames) = viewer.stage.recorded_frames() {
        Panel::bottom("recording").resizable(false).show(ui, |ui| scrub(viewer, ui, frames));
    }
    if viewer.overlays.has(Overlay::Plots) {
        Panel::bottom("plots").exact_size(BOTTOM).resizable(false).show(ui, |ui| {
            plots::show(&viewer.trace, ui, BOTTOM - 16.0);
        });
    }
}

/// The run: pause, step, pace, driver.
fn run(viewer: &mut Viewer, ui: &mut Ui) {
    let mut asked = None;
    ui.add_space(6.0);
    ui.horizontal(|ui| {
        let pause = if viewer.pace.paused { "Go on" } else { "Pause" };
        for (name, action) in [(pause, Action::Pause), ("Step", Action::Step), ("Reset", Action::Reset)] {
            if ui.button(name).clicked() {
                asked = Some(action);
            }
        }
        if ui.button("Picture").on_hover_text("writes a PNG to the present folder (P)").clicked() {
            asked = Some(Action::Screenshot);
        }
    });
    let mut scale = viewer.pace.scale();
    let slider = Slider::new(&mut scale, SCALES[0]..=SCALES[1]).logarithmic(true).text("x real time");
    if ui.add(slider).changed() {
        viewer.pace.set_scale(scale);
    }
    let drivers = viewer.stage.drivers();
    let before = viewer.stage.dials().driver.clone();
    let mut driver = before.clone();
    ComboBox::from_label("drives").selected_text(&driver).show_ui(ui, |ui| {
        for name in drivers {
            let text = name.clone();
            ui.selectable_value(&mut driver, name, text);
        }
    });
    if driver != before {
        viewer.message = viewer.stage.drive_by(&driver).err();
        viewer.dials.driver = viewer.stage.dials().driver.clone();
    }
    ui.horizontal(|ui| {
        let taken = viewer.stage.session().is_taken_over();
        let text = if taken { "Give back" } else { "Take over" };
        if ui.add(Button::new(text).selected(taken)).on_hover_text("drive by the keyboard (T)").clicked() {
            asked = Some(Action::TakeOver);
        }
        ui.toggle_value(&mut viewer.follows, "Follow").on_hover_text("the view moves with the robot (F)");
        ui.toggle_value(&mut viewer.shows_keys, "Keys");
    });
    if viewer.stage.has_shelf() {
        let driven = viewer.stage.demonstrated_frames().is_some();
        let text = if driven { "Keep the demonstration" } else { "Demonstrate" };
        let button = ui.add(Button::new(text).selected(driven));
        if button
            .on_hover_text("from the start of the world, kept in the folder of --demos (B); R gives it up")
            .clicked()
        {
            asked = Some(Action::Demonstrate);
        }
    }
    if let Some(action) = asked {
        viewer.act(ui, action);
    }
}

/// The frames of a recording, to go to any of them.
fn scrub(viewer: &mut Viewer, ui: &mut Ui, frames: u32) {
    let now = viewer.stage.session().world().frame();
    let mut frame = now.min(frames);
    ui.horizontal(|ui| {
        let width = ui.available_width() - 190.0;
        ui.spacing_mut().slider_width = width.max(100.0);
        let text = if viewer.stage.is_as_recorded() { "as recorded" } else { "changed; go to a frame" };
        let slider = ui.add(Slider::new(&mut frame, 0..=frames).text(text));
        if slider.changed() && frame != now {
            viewer.seek(frame);
        }
    });
}

/// Dials that grow another world.
fn dials(viewer: &mut Viewer, ui: &mut Ui) {
    let mut dials: Dials = viewer.dials.clone();
    let mut grows = false;
    let preset = viewer.stage.session().world().spec().preset.clone();
    let mut chosen = preset.clone();
    ComboBox::from_label("preset").selected_text(&chosen).show_ui(ui, |ui| {
        for name in orchard_scenario::presets() {
            ui.selectable_value(&mut chosen, name.to_owned(), name);
        }
    });
    if chosen != preset {
        dials = Dials { preset: Some(chosen), foliage: None, wind: None, ..dials };
        grows = true;
    }
    // A slider that is dragged grows the world when it is let go.
    let mut slide = |ui: &mut Ui, value: &mut Option<f64>, now: f64, range: [f64; 2], text: &str| {
        let mut shown = value.unwrap_or(now);
        let response = ui.add(Slider::new(&mut shown, range[0]..=range[1]).text(text));
        if response.changed() {
            *value = Some(shown);
        }
        grows |= response.drag_stopped() || response.changed() && !response.dragged();
    };
    let foliage = viewer.stage.session().world().spec().foliage.density.value();
    slide(ui, &mut dials.foliage, foliage, viewer.stage.foliage_range(), "foliage");
    slide(ui, &mut dials.wind, viewer.stage.wind(), [0.0, 12.0], "wind, m/s");
    slide(ui, &mut dials.randomisation, 0.0, [0.0, 1.0], "randomised");
    ui.horizontal(|ui| {
        ui.label("seed");
        let seed = ui.add(DragValue::new(&mut dials.seed));
        ui.label("tree");
        let index = ui.add(DragValue::new(&mut dials.index).range(0..=9999));
        for response in [seed, index] {
            grows |= response.drag_stopped() || response.lost_focus();
        }
        if ui.button("Next").on_hover_text("the next seed (N)").clicked() {
            dials.seed = viewer.stage.dials().seed.wrapping_add(1);
            grows = true;
        }
    });
    viewer.dials = dials;
    if grows && viewer.dials != *viewer.stage.dials() {
        let dials = viewer.dials.clone();
        viewer.turn(dials);
    }
}

/// A switch for each overlay.
fn switches(viewer: &mut Viewer, ui: &mut Ui) {
    Grid::new("overlays").num_columns(2).show(ui, |ui| {
        for (k, overlay) in Overlay::ALL.into_iter().enumerate() {
            let mut on = viewer.overlays.has(overlay);
            let text = format!("{} {}", keys::OVERLAYS[k].symbol_or_name(), overlay.name());
            if ui.checkbox(&mut on, text).on_hover_text(overlay.help()).changed() {
                viewer.overlays.switch(overlay);
            }
            if k % 2 == 1 {
                ui.end_row();
            }
        }
    });
    for (overlay, words) in
        [(Overlay::Moments, "bending moment / rupture moment"), (Overlay::Stems, "stem load / strength")]
    {
        if viewer.overlays.has(overlay) {
            legend(ui, words);
        }
    }
    if viewer.overlays.has(Overlay::Zones) {
        ui.label("zones: red above, green between,\nblue below; dense inside the rings")
            .on_hover_text(Overlay::Zones.help());
    }
}

/// The colours of a share.
fn legend(ui: &mut Ui, words: &str) {
    const STEPS: usize = 40;
    ui.label(words);
    let (rect, _) = ui.allocate_exact_size(vec2(LEFT - 40.0, 10.0), egui::Sense::hover());
    let width = rect.width() / STEPS as f32;
    for k in 0..STEPS {
        let left = rect.left() + k as f32 * width;
        let part = Rect::from_min_max(pos2(left, rect.top()), pos2(left + width + 0.5, rect.bottom()));
        ui.painter().rect_filled(part, 0.0, shade(load_colour((k as f64 + 0.5) / STEPS as f64)));
    }
    ui.horizontal(|ui| {
        ui.label("0");
        ui.add_space(LEFT - 96.0);
        ui.label("1: gives way");
    });
}

/// Texts and pictures over the scene.
pub fn over_scene(viewer: &Viewer, ui: &mut Ui, rect: Rect) {
    status(viewer, ui, rect);
    labels(viewer, ui, rect);
    let mut bottom = rect.bottom() - 8.0;
    for (overlay, picture) in [(Overlay::Depth, &viewer.depth), (Overlay::Colour, &viewer.colour)] {
        if let Some(picture) = picture.as_ref().filter(|_| viewer.overlays.has(overlay)) {
            bottom = picture_over(ui, rect, bottom, picture);
        }
    }
    if viewer.overlays.has(Overlay::Plan) {
        log(viewer, ui, rect);
    }
    if viewer.shows_keys || viewer.stage.session().is_taken_over() {
        key_list(viewer, ui, rect);
    }
}

/// Time, fruit, speed and costs in a line at the top, and the message under it.
fn status(viewer: &Viewer, ui: &Ui, rect: Rect) {
    let told = viewer.stage.session().told();
    let driver = match (viewer.stage.session().is_taken_over(), told.state) {
        (true, _) => "you drive".to_owned(),
        (false, Some(state)) => format!("{}: {}", viewer.stage.dials().driver, state_name(state)),
        (false, None) => viewer.stage.dials().driver.clone(),
    };
    let mut text = format!(
        "{:.1} s   {driver}   bucket {}   ground {}   on the tree {}   snapped {}",
        told.time, told.picked, told.dropped, told.hanging, told.snapped
    );
    if let Some(frames) = viewer.stage.demonstrated_frames() {
        text += &format!("   demonstration {:.1} s", frames as f64 * viewer.frame_time());
    }
    if !viewer.pace.paused && viewer.speed < 0.95 * viewer.pace.scale() {
        text += &format!("   {:.1} x real time is all this machine can", viewer.speed);
    }
    let at = rect.left_top() + vec2(10.0, 8.0);
    let shown = plate(ui, at, Align2::LEFT_TOP, &text, 14.0);
    let problem =
        told.fault.map(|fault| format!("the world stands still: {fault}; reset it, or take another seed"));
    if let Some(message) = problem.as_ref().or(viewer.message.as_ref()) {
        plate(ui, shown.left_bottom() + vec2(4.0, 8.0), Align2::LEFT_TOP, message, 14.0);
    }
}

/// A text on a light plate.
fn plate(ui: &Ui, at: egui::Pos2, anchor: Align2, text: &str, size: f32) -> Rect {
    let painter = ui.painter();
    let galley = painter.layout_no_wrap(text.to_owned(), FontId::proportional(size), INK);
    let rect = anchor.anchor_size(at, galley.size());
    painter.rect_filled(rect.expand(4.0), 3.0, egui::Color32::from_white_alpha(215));
    painter.galley(rect.min, galley, INK);
    rect.expand(4.0)
}

/// The size of the pull, and the scores of detections, at their places.
fn labels(viewer: &Viewer, ui: &Ui, rect: Rect) {
    if let Some(pull) = viewer.stage.session().pull()
        && let Some(at) = viewer.place(&Vec3::from(pull.p_world_target), rect)
    {
        plate(ui, at + vec2(10.0, -10.0), Align2::LEFT_BOTTOM, &format!("{:.0} N", pull.force), 14.0);
    }
    if viewer.overlays.has(Overlay::Detections) {
        for seen in &viewer.seen {
            if let Some(at) = viewer.place(&seen.p_world, rect) {
                plate(ui, at + vec2(6.0, -6.0), Align2::LEFT_BOTTOM, &format!("{:.2}", seen.score), 11.0);
            }
        }
    }
}

/// A picture of the wrist camera at the right; returns the top of its frame.
fn picture_over(ui: &mut Ui, rect: Rect, bottom: f32, picture: &WristPicture) -> f32 {
    let size = picture.texture.size_vec2();
    let size = size * (PICTURE.min(0.4 * rect.width()) / size.x.max(1.0));
    let min = pos2(rect.right() - 8.0 - size.x, bottom - size.y);
    let place = Rect::from_min_size(min, size);
    ui.painter().rect_filled(place.expand(2.0), 2.0, egui::Color32::WHITE);
    ui.put(place, Image::new((picture.texture.id(), size)));
    min.y - 8.0
}

/// The last lines of the controller's log, at the left.
fn log(viewer: &Viewer, ui: &Ui, rect: Rect) {
    let Some(controller) = viewer.stage.session().controller() else { return };
    let events = &controller.record().events;
    let first = events.len().saturating_sub(LINES);
    let lines: Vec<String> = events.iter().skip(first).map(|event: &Event| line(event)).collect();
    if !lines.is_empty() {
        plate(ui, rect.left_bottom() + vec2(12.0, -12.0), Align2::LEFT_BOTTOM, &lines.join("\n"), 12.0);
    }
}

/// Keys: all, or those of a person who drives.
fn key_list(viewer: &Viewer, ui: &Ui, rect: Rect) {
    // Below the lines over the scene.
    let top = if viewer.message.is_some() { 72.0 } else { 44.0 };
    let area = egui::Area::new(egui::Id::unique("keys")).fixed_pos(rect.left_top() + vec2(10.0, top));
    area.interactable(false).show(ui.ctx(), |ui| {
        Frame::popup(ui.style()).show(ui, |ui| {
            let row = |ui: &mut Ui, key: &str, words: &str| {
                ui.label(RichText::new(key).strong());
                ui.label(words);
                ui.end_row();
            };
            Grid::new("key list").num_columns(2).show(ui, |ui| {
                for (key, words) in keys::DRIVING {
                    row(ui, key, words);
                }
                row(ui, "C", "close or open the hand");
                row(ui, "T", "take over, give back");
                if cfg!(feature = "gamepad") && viewer.shows_keys {
                    PAD.iter().for_each(|(place, words)| row(ui, &format!("pad: {place}"), words));
                }
                if viewer.shows_keys {
                    for (key, action, words) in keys::ACTIONS {
                        if !matches!(action, Action::Hand | Action::TakeOver) {
                            row(ui, key.symbol_or_name(), words);
                        }
                    }
                    row(ui, "1 to 9, 0, Z, X", "overlays");
                    row(ui, "arrows, Page Up, Page Down", "turn the view, zoom");
                    row(ui, "drag a branch, a fruit, the robot", "pull it");
                    row(ui, "drag beside them", "turn the view; right or Shift: move it; wheel: zoom");
                }
            });
        });
    });
}
