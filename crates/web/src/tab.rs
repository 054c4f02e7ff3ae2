//! A session as a page shows it: with overlays over the world, and the pictures of its wrist camera.

use orchard_geometry::Image;
use orchard_perception::DetectorConfig;
use orchard_play::wrist::{self, Circle};
use orchard_play::{
    Drawing, FrameDigest, INSTANCE_FLOATS, Marks, Mesh, Overlay, Overlays, Paint, Seen, Session, Told, Trace,
    WoodPaint, annotate, line, target,
};
use serde::Serialize;

/// Overlays that are on when a page opens.
pub(crate) const OVERLAYS: &str = "leaves,depth,detections";

/// Lines of the controller's log that a page shows.
const LINES: usize = 5;

/// A session with the overlays of a page. They change no bit of the world.
pub struct Tab {
    session: Session,
    detector: DetectorConfig,
    notes: Vec<String>,
    overlays: Overlays,
    drawing: Drawing,
    marks: Marks,
    trace: Trace,
    seen: Vec<Seen>,
    /// Frame of the image in which `seen` was found.
    seen_frame: Option<u32>,
    /// Frame and overlays of the latest view of the wrist camera that was given away.
    given: Option<(u32, Overlays)>,
}

/// Figures of the present state, with what the controller is about.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TabTold {
    /// Figures of the world.
    #[serde(flatten)]
    pub told: Told,
    /// True while a person drives.
    pub taken_over: bool,
    /// Distance from the hand to the controller's target \[m\]; `None` without one.
    pub target_distance: Option<f64>,
    /// The last lines of the controller's log, oldest first; empty without the overlay `plan`.
    pub log: Vec<String>,
}

/// A detection in an image of the wrist camera.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Found {
    /// Its outline.
    #[serde(flatten)]
    pub circle: Circle,
    /// Probability that it is a fruit, as the detector judges.
    pub score: f64,
}

/// The latest image of the wrist camera, and what is found in it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WristView {
    /// Frame of the world in which it was taken.
    pub frame: u32,
    /// Columns and rows of the depth image \[px\]; circles are given in them.
    pub size: [usize; 2],
    /// Columns and rows of the picture that is shown \[px\].
    pub picture: [usize; 2],
    /// Detections, empty without the overlay `detections` and in colour.
    pub found: Vec<Found>,
    /// The controller's target; `None` without one, behind the camera, and without the overlay `plan` and in colour.
    pub target: Option<Circle>,
    /// Red, green, blue and opacity of every dot of the picture, row by row.
    #[serde(skip)]
    pub dots: Vec<u8>,
}

/// Instances of a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Instances {
    /// Numbers of all instances: those of the world, then those of marks.
    pub numbers: Vec<f32>,
    /// Number of instances of each mesh, in the order of [`Tab::meshes`].
    pub counts: Vec<usize>,
}

impl Tab {
    /// A tab of a session, whose images the detector looks through, with notes on its tree's file.
    pub(crate) fn new(session: Session, detector: DetectorConfig, notes: Vec<String>) -> Self {
        let mut tab = Self {
            drawing: session.drawing(),
            session,
            detector,
            notes,
            overlays: Overlays::parse(OVERLAYS).unwrap_or_default(),
            marks: Marks::default(),
            trace: Trace::default(),
            seen: Vec::new(),
            seen_frame: None,
            given: None,
        };
        tab.draw();
        tab
    }

    /// Switches on the overlays of these names, with commas between, and no others.
    ///
    /// # Errors
    /// An unknown name, or one that a page does not have; then nothing has changed.
    pub fn show(&mut self, names: &str) -> Result<(), String> {
        let overlays = Overlays::parse(names)?;
        if overlays.has(Overlay::Zones) && names != "all" {
            return Err(
                "overlay `zones`: this page has none of the benchmark's zones; `orchard view` has".to_owned()
            );
        }
        self.overlays = overlays;
        Ok(())
    }

    /// Advances one frame.
    pub fn step(&mut self) {
        self.session.step();
        self.trace.take(&self.session);
    }

    /// Advances one frame and returns its digest.
    pub fn step_watched(&mut self) -> FrameDigest {
        let digest = self.session.step_watched();
        self.trace.take(&self.session);
        digest
    }

    /// Brings the world and the driver back to the start.
    pub fn reset(&mut self) {
        self.session.reset();
        self.trace.clear();
        (self.seen, self.seen_frame, self.given) = (Vec::new(), None, None);
    }

    /// The session.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// The session, to pull and to drive.
    pub fn session_mut(&mut self) -> &mut Session {
        &mut self.session
    }

    /// Assumptions made when the tree's file was read, one sentence each.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Figures over time.
    pub fn trace(&self) -> &Trace {
        &self.trace
    }

    /// The figures of the present state.
    pub fn told(&self) -> TabTold {
        let world = self.session.world();
        let p_hand = world.handle().x_world_tcp(world.data()).translation.vector;
        let log = match (self.session.controller(), self.overlays.has(Overlay::Plan)) {
            (Some(controller), true) => {
                let events = &controller.record().events;
                events.iter().skip(events.len().saturating_sub(LINES)).map(line).collect()
            }
            _ => Vec::new(),
        };
        TabTold {
            told: self.session.told(),
            taken_over: self.session.is_taken_over(),
            target_distance: target(&self.session).map(|target| (target.p_world - p_hand).norm()),
            log,
        }
    }

    fn draw(&mut self) {
        let wood = if self.overlays.has(Overlay::Moments) { WoodPaint::Load } else { WoodPaint::Plain };
        let paint = Paint { leaves: self.overlays.has(Overlay::Leaves), wood };
        self.session.draw(&mut self.drawing, &paint);
        annotate(&mut self.marks, &self.session, &self.overlays, &self.seen);
    }

    /// The meshes of the world, then those of marks. A picture may need more of them than the one before.
    pub fn meshes(&self) -> Vec<Mesh> {
        self.drawing.meshes().iter().cloned().chain(Marks::meshes()).collect()
    }

    /// The picture of the present state.
    pub fn picture(&mut self) -> Instances {
        self.look();
        self.draw();
        let lists = || self.drawing.instances().iter().chain(self.marks.instances());
        Instances {
            numbers: lists().flatten().copied().collect(),
            counts: lists().map(|list| list.len() / INSTANCE_FLOATS).collect(),
        }
    }

    /// Looks for fruit in the latest image, if detections are asked for and it is new.
    fn look(&mut self) {
        let frame = self.session.world().camera_truth().map(|truth| truth.sight.frame);
        if !self.overlays.has(Overlay::Detections) {
            (self.seen, self.seen_frame) = (Vec::new(), None);
        } else if self.seen_frame != frame {
            (self.seen, self.seen_frame) = (wrist::seen(self.session.world(), &self.detector), frame);
        }
    }

    /// The latest image of the wrist camera: in colour with the overlay `colour`, else its depth; `None` before the first image, if neither overlay
    /// is on, and if this view was given away before.
    pub fn wrist(&mut self) -> Option<WristView> {
        let [depth, colour] = [Overlay::Depth, Overlay::Colour].map(|overlay| self.overlays.has(overlay));
        let now =
            self.session.world().camera_truth().map(|truth| (truth.sight.frame, self.overlays.clone()))?;
        if !(depth || colour) || self.given.as_ref() == Some(&now) {
            return None;
        }
        self.look();
        let world = self.session.world();
        let picture: Image<[u8; 3]> =
            if colour { wrist::colour(world) } else { wrist::depth(world, &[], 1)? };
        // The colour picture is of the present, the detections are of the depth image.
        let found = self.seen.iter().filter(|_| !colour).filter_map(|seen| {
            Some(Found { circle: wrist::circle(world, &seen.p_world, seen.radius)?, score: seen.score })
        });
        let target = target(&self.session).filter(|_| self.overlays.has(Overlay::Plan) && !colour);
        let intrinsics = world.sense().intrinsics;
        let view = WristView {
            frame: now.0,
            size: [intrinsics.width, intrinsics.height],
            picture: [picture.width(), picture.height()],
            found: found.collect(),
            target: target.and_then(|target| wrist::circle(world, &target.p_world, target.radius)),
            dots: picture.pixels().iter().flat_map(|[r, g, b]| [*r, *g, *b, u8::MAX]).collect(),
        };
        self.given = Some(now);
        Some(view)
    }
}

#[cfg(test)]
#[path = "tab_tests.rs"]
mod tests;
