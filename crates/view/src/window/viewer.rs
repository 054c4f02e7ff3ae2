//! The viewer: state, input, and the picture of the world.

use std::path::PathBuf;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

use eframe::egui::{self, Rect, Sense, TextureHandle, TextureOptions, Ui};
use eframe::egui_wgpu::{Callback, RenderState};
use orchard_geometry::{Image, Vec3};
use orchard_play::{
    Drawing, Marks, Mesh, Overlay, Overlays, Paint, Reach, Seen, Trace, Wish, WoodPaint, annotate,
    goal_sentence, mark_goal, wrist,
};

use super::clock::thread_time;
use super::file::{without_alpha, write_png};
use super::keys::{self, Action};
use super::renderer::{Renderer, Scene};
use crate::orbit::Orbit;
use crate::pace::Pace;
use crate::pad::{Pad, PadEvent};
use crate::stage::{Dials, Stage};
use crate::stand::Stand;

/// Longest time that the world may take between two pictures; what is left then is dropped, and the world runs slower than asked.
const STEPPING: Duration = Duration::from_millis(50);
/// Dots a pixel side of the depth picture.
const ENLARGED: usize = 2;
/// Turn of the view for a drag of one point, and by a key in a second \[rad\].
pub(super) const TURN: [f64; 2] = [0.006, 1.2];
/// Factor of the distance for a point of the wheel, and exponent by a key in a second.
pub(super) const ZOOM: [f64; 2] = [0.0015, 1.0];

/// Costs of a picture.
#[derive(Debug, Clone, Copy, Default)]
pub struct Costs {
    /// Time of the world's steps before it.
    pub stepping: Duration,
    /// Processor time of this thread for the steps.
    pub stepping_processor: Duration,
    /// Frames stepped.
    pub steps: u32,
    /// Draw calls of the scene.
    pub draw_calls: u32,
}

/// A picture of the wrist camera in the window.
pub(super) struct WristPicture {
    /// Frame of the world of the image that it shows, and the number of detections in it.
    key: (u32, usize),
    pub texture: TextureHandle,
}

/// The viewer of a stage.
pub struct Viewer {
    pub(super) stage: Stage,
    pub(super) overlays: Overlays,
    pub(super) pace: Pace,
    pub(super) orbit: Orbit,
    pub(super) follows: bool,
    pub(super) trace: Trace,
    pub(super) seen: Vec<Seen>,
    pub(super) depth: Option<WristPicture>,
    pub(super) colour: Option<WristPicture>,
    /// Dials as they stand in the panel.
    pub(super) dials: Dials,
    /// A sentence for the person, and whether it tells of a failure.
    pub(super) message: Option<String>,
    pub(super) closes: bool,
    pad: Pad,
    /// Events of gamepads that wait for the next picture.
    pad_events: Vec<PadEvent>,
    pub(super) shows_keys: bool,
    /// Rate of the world against the clock, smoothed.
    pub(super) speed: f64,
    /// Pictures a second, and time of the window's thread for one without the steps of the world \[s\], smoothed; `None` without a window.
    pub(super) rate: Option<[f64; 2]>,
    seen_frame: Option<u32>,
    drawing: Drawing,
    marks: Marks,
    mark_meshes: [Mesh; 3],
    renderer: Renderer,
    /// Number of trees with those that stand still beside the world's, and those.
    trees: u32,
    stand: Option<Stand>,
    /// Depth along the view at which the pointer pulls \[m\].
    pub(super) pull_depth: Option<f64>,
    p_base: Vec3,
    elapsed: f64,
    owed: u32,
    /// False where frames are stepped by [`Self::owe`] alone.
    has_clock: bool,
    costs: Costs,
    /// Answers of pictures that are written when the window gives them.
    answers: (Sender<String>, Receiver<String>),
}

impl Viewer {
    /// A viewer of a stage, on a device.
    pub fn new(stage: Stage, overlays: Overlays, state: &RenderState) -> Self {
        let p_base = base(&stage);
        Self {
            orbit: first_view(&stage),
            dials: stage.dials().clone(),
            drawing: stage.session().drawing(),
            stage,
            overlays,
            pace: Pace::default(),
            follows: false,
            trace: Trace::default(),
            seen: Vec::new(),
            depth: None,
            colour: None,
            message: None,
            closes: false,
            pad: Pad::default(),
            pad_events: Vec::new(),
            shows_keys: false,
            speed: 1.0,
            rate: None,
            seen_frame: None,
            marks: Marks::default(),
            mark_meshes: Marks::meshes(),
            renderer: Renderer::new(state, Renderer::is_fast(state)),
            trees: 1,
            stand: None,
            pull_depth: None,
            p_base,
            elapsed: 0.0,
            owed: 0,
            has_clock: true,
            costs: Costs::default(),
            answers: channel(),
        }
    }

    /// Draws smooth edges from now on, however long that takes. A device in software draws none otherwise.
    pub fn smooth(&mut self, state: &RenderState) {
        self.renderer = Renderer::new(state, true);
    }

    /// Shows so many trees in rows from now on: the world's, and the next of its seed, which stand still.
    ///
    /// # Errors
    /// A tree that cannot be grown; the message names it.
    pub fn show_trees(&mut self, trees: u32) -> Result<(), String> {
        self.trees = trees;
        self.grow_stand()
    }

    fn grow_stand(&mut self) -> Result<(), String> {
        let Dials { seed, index, .. } = *self.stage.dials();
        let grown = (self.trees > 1).then(|| Stand::grow(self.stage.scenario(), seed, index, self.trees));
        self.stand = None;
        let told = grown.transpose().map(|stand| self.stand = stand);
        self.renderer.forget_stand();
        self.begin();
        told
    }

    /// The stage.
    pub fn stage(&self) -> &Stage {
        &self.stage
    }

    /// The view.
    pub fn orbit_mut(&mut self) -> &mut Orbit {
        &mut self.orbit
    }

    /// Sets the time since the last picture \[s\].
    pub fn set_elapsed(&mut self, elapsed: f64) {
        self.elapsed = elapsed;
    }

    /// Tells the time that the window's thread took for the latest picture \[s\], the steps of the world included.
    pub fn set_window_time(&mut self, time: f64) {
        const NEW: f64 = 0.05;
        let own = (time - self.costs.stepping.as_secs_f64()).max(0.0);
        let [elapsed, mean] = self.rate.map_or([self.elapsed, own], |[rate, own]| [1.0 / rate, own]);
        let elapsed = elapsed + NEW * (self.elapsed - elapsed);
        self.rate = Some([1.0 / elapsed.max(1e-6), mean + NEW * (own - mean)]);
    }

    /// Length of a frame of the world \[s\].
    pub fn frame_time(&self) -> f64 {
        self.stage.session().world().spec().sim.frame()
    }

    /// Tells what a gamepad told since the latest picture.
    pub fn tell_pad(&mut self, events: impl IntoIterator<Item = PadEvent>) {
        self.pad_events.extend(events);
    }

    /// Steps so many frames before the next picture, and from now on no others, whatever the clock says.
    pub fn owe(&mut self, frames: u32) {
        (self.owed, self.has_clock) = (frames, false);
    }

    /// Costs of the latest picture.
    pub fn costs(&self) -> Costs {
        self.costs
    }

    /// Takes the keys, steps the world, and brings pictures of the wrist camera up to date.
    pub(super) fn advance(&mut self, ui: &Ui) {
        for event in std::mem::take(&mut self.pad_events) {
            if let Some(action) = self.pad.take(event) {
                self.act(ui, keys::of_pad(action));
            }
        }
        let (actions, wish, view) = if ui.ctx().egui_wants_keyboard_input() {
            Default::default()
        } else {
            ui.input(|input| (keys::actions(input), keys::wish(input), keys::view(input)))
        };
        actions.into_iter().for_each(|action| self.act(ui, action));
        let wish = Wish { closes: self.closes, ..wish };
        self.stage.session_mut().wish(self.pad.over(wish));
        let by_key = TURN[1] * self.elapsed;
        if view != [0.0; 3] {
            self.orbit.turn(-view[0] * by_key, view[1] * by_key);
            self.orbit.zoom(orchard_geometry::math::exp(view[2] * ZOOM[1] * self.elapsed));
        }
        if let Ok(answer) = self.answers.1.try_recv() {
            self.message = Some(answer);
        }
        self.step();
        self.follow();
        self.look_through_wrist(ui);
    }

    /// Steps the frames that are due.
    fn step(&mut self) {
        let frame = self.frame_time();
        let owed = std::mem::take(&mut self.owed);
        // Panels may be laid out twice for a picture; time passes once.
        let elapsed = std::mem::take(&mut self.elapsed);
        let due = if self.has_clock { self.pace.due(elapsed, frame) } else { owed };
        let (start, processor, mut steps) = (Instant::now(), thread_time(), 0);
        while steps < due && (!self.has_clock || start.elapsed() < STEPPING) {
            if !self.stage.step() {
                self.pace.paused = true;
                break;
            }
            self.trace.take(self.stage.session());
            steps += 1;
        }
        if steps > 0 || elapsed > 0.0 {
            (self.costs.stepping, self.costs.steps) = (start.elapsed(), steps);
            self.costs.stepping_processor = thread_time().saturating_sub(processor);
        }
        if self.has_clock && !self.pace.paused && elapsed > 0.0 {
            let now = f64::from(steps) * frame / elapsed;
            self.speed += 0.05 * (now - self.speed);
        }
    }

    fn follow(&mut self) {
        let p_base = base(&self.stage);
        if self.follows {
            self.orbit.carry(&(p_base - self.p_base));
        }
        self.p_base = p_base;
    }

    /// Brings detections and pictures of the wrist camera up to date with its latest image.
    fn look_through_wrist(&mut self, ui: &Ui) {
        let world = self.stage.session().world();
        let frame = world.camera_truth().map(|truth| truth.sight.frame);
        let wants_seen = self.overlays.has(Overlay::Detections);
        if !wants_seen {
            (self.seen_frame, self.seen) = (None, Vec::new());
        } else if self.seen_frame != frame {
            (self.seen_frame, self.seen) = (frame, wrist::seen(world, self.stage.scenario().detector()));
        }
        let Some(frame) = frame else {
            (self.depth, self.colour) = (None, None);
            return;
        };
        let key = (frame, self.seen.len());
        if self.overlays.has(Overlay::Depth) && self.depth.as_ref().is_none_or(|shown| shown.key != key) {
            let image = wrist::depth(world, &self.seen, ENLARGED);
            refresh(&mut self.depth, image, key, "depth", ui);
        }
        let key = (frame, 0);
        if self.overlays.has(Overlay::Colour) && self.colour.as_ref().is_none_or(|shown| shown.key != key) {
            refresh(&mut self.colour, Some(wrist::colour(world)), key, "colour", ui);
        }
    }

    /// Does what a key asks for.
    pub(super) fn act(&mut self, ui: &Ui, action: Action) {
        match action {
            Action::Pause => self.pace.paused = !self.pace.paused,
            Action::Step => self.pace.step_once(),
            Action::Reset => {
                self.stage.reset();
                self.begin();
            }
            Action::NextSeed => {
                let seed = self.stage.dials().seed.wrapping_add(1);
                self.turn(Dials { seed, ..self.stage.dials().clone() });
            }
            Action::TakeOver => self.take_over(),
            Action::Follow => self.follows = !self.follows,
            Action::Home => self.orbit = first_view(&self.stage),
            Action::Faster => self.pace.set_scale(self.pace.scale() * 2.0),
            Action::Slower => self.pace.set_scale(self.pace.scale() / 2.0),
            Action::Grab => self.grab_in_the_middle(),
            Action::Hand => self.closes = !self.closes,
            Action::Demonstrate => self.demonstrate(),
            Action::Screenshot => self.screenshot(ui),
            Action::Switch(overlay) => self.overlays.switch(overlay),
        }
    }

    /// Takes the robot over, or gives it back.
    pub(super) fn take_over(&mut self) {
        let session = self.stage.session_mut();
        // A hand that holds something stays closed.
        self.closes = session.hand_is_closed() && !session.is_taken_over();
        if session.is_taken_over() { session.give_back() } else { session.take_over() }
    }

    /// Begins a demonstration, or ends and keeps the one under way.
    fn demonstrate(&mut self) {
        if self.stage.demonstrated_frames().is_some() {
            let (Ok(sentence) | Err(sentence)) = self.stage.end_demonstration();
            self.message = Some(sentence);
            return;
        }
        self.message = self.stage.begin_demonstration().err();
        if self.message.is_none() {
            self.closes = false;
            self.begin();
            self.message = self.stage.goal().map(|goal| goal_sentence(goal).to_owned());
        }
    }

    /// True if a demonstration is under way, in which nobody pulls; then the person is told.
    pub(super) fn refuses_pull(&mut self) -> bool {
        let refuses = self.stage.demonstrated_frames().is_some();
        if refuses {
            self.message = Some("nobody pulls in a demonstration: the robot alone moves things".to_owned());
        }
        refuses
    }

    /// Grows the world of other dials.
    pub(super) fn turn(&mut self, dials: Dials) {
        let moved = dials.preset != self.stage.dials().preset;
        self.message = self.stage.turn(dials).err();
        self.dials = self.stage.dials().clone();
        if self.message.is_none() {
            self.message = self.grow_stand().err();
            if moved {
                self.orbit = first_view(&self.stage);
            }
        }
    }

    /// Goes to a frame of the recording.
    pub(super) fn seek(&mut self, frame: u32) {
        self.message = self.stage.seek(frame).err();
        self.begin();
    }

    /// Another world, or the same from another moment.
    fn begin(&mut self) {
        self.drawing = self.stage.session().drawing();
        if let Some(stand) = &self.stand {
            self.drawing.set_extent(stand.extent());
        }
        self.renderer.forget_world();
        self.trace.clear();
        (self.seen_frame, self.seen, self.depth, self.colour) = (None, Vec::new(), None, None);
        self.pull_depth = None;
        self.p_base = base(&self.stage);
    }

    fn grab_in_the_middle(&mut self) {
        if self.stage.session().pull().is_some() {
            return self.stage.session_mut().release();
        }
        if self.refuses_pull() {
            return;
        }
        let (p, along) = self.orbit.ray([0.0, 0.0], 1.0);
        if let Some(place) = self.stage.session_mut().grab(&p, &along, true, Reach::All) {
            // Towards the eye: the person sees at once that it pulls.
            self.stage.session_mut().pull_to(&(place - along * 0.2));
        }
    }

    /// Asks the window for its picture, which is written to the first free name when it comes.
    fn screenshot(&mut self, ui: &Ui) {
        let names = (1..).map(|number: u32| PathBuf::from(format!("orchard-view-{number:03}.png")));
        let Some(file) = names.into_iter().find(|file| !file.exists()) else { return };
        let answers = self.answers.0.clone();
        let callback = egui::ScreenshotCallback::new(move |image| {
            let answer = match write_png(&file, &without_alpha(&image)) {
                Ok(()) => format!("wrote {} in the present folder", file.display()),
                Err(e) => e.to_string(),
            };
            // The window may be closed meanwhile.
            let _ = answers.send(answer);
        });
        ui.ctx().send_viewport_cmd(egui::ViewportCommand::Screenshot(callback));
    }

    /// The picture of the world in a part of the window, with the pointer's grip on it.
    pub(super) fn show_scene(&mut self, ui: &mut Ui, rect: Rect) {
        let response = ui.interact(rect, ui.scope_id().with("scene"), Sense::click_and_drag());
        self.point(ui, rect, &response);
        self.draw(ui, rect);
    }

    fn draw(&mut self, ui: &Ui, rect: Rect) {
        let wood = if self.overlays.has(Overlay::Moments) { WoodPaint::Load } else { WoodPaint::Plain };
        let paint = Paint { leaves: self.overlays.has(Overlay::Leaves), wood };
        let session = self.stage.session();
        session.draw(&mut self.drawing, &paint);
        annotate(&mut self.marks, session, &self.overlays, &self.seen);
        if let Some(goal) = self.stage.goal() {
            mark_goal(&mut self.marks, session.world(), goal);
        }
        if self.overlays.has(Overlay::Zones) {
            self.stage.canopy().mark(&mut self.marks, session.world());
        }
        let pixels = ui.ctx().pixels_per_point();
        let size = [rect.width() * pixels, rect.height() * pixels].map(|side| side.round() as u32);
        let scene = Scene {
            drawing: &self.drawing,
            stand: self.stand.as_ref(),
            leaves: paint.leaves,
            mark_meshes: &self.mark_meshes,
            marks: &self.marks,
        };
        let shown = self.renderer.draw(size, &self.orbit, &scene);
        self.costs.draw_calls = self.renderer.draw_calls();
        ui.painter().add(Callback::new_paint_callback(rect, shown));
    }

    /// Place of a point of the world in a part of the window.
    pub(super) fn place(&self, p_world: &Vec3, rect: Rect) -> Option<egui::Pos2> {
        let [x, y] = self.orbit.place(p_world, f64::from(rect.width() / rect.height().max(1.0)))?;
        let share = egui::vec2(0.5 + 0.5 * x as f32, 0.5 - 0.5 * y as f32);
        let pos = rect.min + share * rect.size();
        rect.contains(pos).then_some(pos)
    }
}

/// Brings a picture of the wrist camera to the window.
fn refresh(
    shown: &mut Option<WristPicture>,
    image: Option<Image<[u8; 3]>>,
    key: (u32, usize),
    name: &str,
    ui: &Ui,
) {
    let Some(image) = image else {
        *shown = None;
        return;
    };
    let image = egui::ColorImage::from_rgb([image.width(), image.height()], image.pixels().as_flattened());
    match shown {
        Some(shown) => {
            shown.texture.set(image, TextureOptions::NEAREST);
            shown.key = key;
        }
        None => {
            let texture = ui.ctx().load_texture(name, image, TextureOptions::NEAREST);
            *shown = Some(WristPicture { key, texture });
        }
    }
}

fn base(stage: &Stage) -> Vec3 {
    let world = stage.session().world();
    world.handle().x_world_base(world.data()).translation.vector
}

fn first_view(stage: &Stage) -> Orbit {
    Orbit::beside(&base(stage), stage.session().world().spec().tree.height.si())
}
