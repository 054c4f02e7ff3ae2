//! The pointer over the scene: it turns the view, and pulls.

use eframe::egui::{self, Key, PointerButton, Rect, Ui};
use orchard_play::Reach;

use super::viewer::{TURN, Viewer, ZOOM};

impl Viewer {
    /// Turns, moves and zooms the view, and pulls.
    pub(super) fn point(&mut self, ui: &Ui, rect: Rect, response: &egui::Response) {
        let aspect = f64::from(rect.width() / rect.height().max(1.0));
        let place = |pos: egui::Pos2| {
            let at = (pos - rect.min) / rect.size();
            [f64::from(2.0 * at.x - 1.0), f64::from(1.0 - 2.0 * at.y)]
        };
        let (shift, escape) = ui.input(|input| (input.modifiers.shift, input.key_pressed(Key::Escape)));
        if response.drag_started_by(PointerButton::Primary) && !shift {
            let origin = ui.input(|input| input.pointer.press_origin());
            if let Some(origin) = origin.or(response.interact_pointer_pos()) {
                let (p, along) = self.orbit.ray(place(origin), aspect);
                let grabbed = self.stage.session_mut().grab(&p, &along, false, Reach::All);
                if grabbed.is_some() && self.refuses_pull() {
                    self.stage.session_mut().release();
                } else {
                    self.pull_depth = grabbed.map(|p_world| self.orbit.depth(&p_world));
                }
            }
        }
        let delta = response.drag_delta();
        let (right, up) = (f64::from(delta.x), f64::from(-delta.y));
        let height = f64::from(rect.height().max(1.0));
        match self.pull_depth {
            Some(depth) => {
                if let Some(pos) = response.interact_pointer_pos() {
                    let target = self.orbit.at(place(pos), aspect, depth);
                    self.stage.session_mut().pull_to(&target);
                }
                if self.stage.session().pull().is_none() {
                    self.pull_depth = None;
                }
            }
            None if response.dragged_by(PointerButton::Primary) && !shift => {
                self.orbit.turn(right * TURN[0], -up * TURN[0]);
            }
            None if response.dragged() => self.orbit.pan(right / height, up / height),
            None => {}
        }
        if response.drag_stopped() && self.pull_depth.take().is_some() || escape {
            self.stage.session_mut().release();
            self.pull_depth = None;
        }
        if response.hovered() {
            let (wheel, pinch) = ui.input(|input| (input.smooth_scroll_delta().y, input.zoom_delta()));
            let factor = orchard_geometry::math::exp(-ZOOM[0] * f64::from(wheel)) / f64::from(pinch);
            if factor != 1.0 {
                self.orbit.zoom(factor);
            }
        }
    }
}
