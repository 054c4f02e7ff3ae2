//! An attempt as a strip of pictures: for each moment the view from outside above the view of the wrist camera.

use orchard_camera::picture::{PictureStyle, ShadowMaps, Studio, look_at};
use orchard_camera::{Label, Scene};
use orchard_geometry::{Image, Intrinsics, Pose, Vec3, transform};
use orchard_multibody::BodyId;
use orchard_robot::Finger;
use orchard_tasks::harvest::episode::{AttemptRecord, EpisodeRecord, HeldEnd};
use orchard_world::World;

use super::marks::{BELIEF, HARMED, Marked, SEEN, TRUTH};
use super::replay::{CausedEvent, Shot};
use super::story::{span, verdict, words};
use crate::commands::gallery::caption;
use crate::picture_file::paste;

/// A moment that gets a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Moment {
    /// Frame.
    pub frame: u32,
    /// Caption of the moment.
    pub caption: String,
    /// Fruit knocked off and segments at whose base a branch snaps.
    pub harmed: Vec<CausedEvent>,
}

/// Size of a view \[px\].
const WIDTH: usize = 384;
const HEIGHT: usize = 288;
/// Pictures per row of a strip.
const COLUMNS: usize = 5;
/// Gap between the pictures \[px\], and its colour.
const GAP: usize = 4;
const PAPER: [u8; 3] = [250, 249, 246];
/// Letters of 7 px that fit above a picture.
const LETTERS: usize = WIDTH / 7;
/// Moments closer together than this share a picture \[frames\].
const SAME: u32 = 3;

/// The moments of an attempt, in the order of time.
pub fn moments(record: &EpisodeRecord, attempt: &AttemptRecord) -> Vec<Moment> {
    let (start, until) = span(record, attempt);
    let within = |frame: u32| frame > start && frame <= until;
    let frame_of = |time: f64| (time / frame_length(record)).round() as u32;
    let mut found: Vec<(u32, String, Option<CausedEvent>)> =
        attempt.states.iter().map(|s| (frame_of(s.time), s.state.to_uppercase(), None)).collect();
    let belief = &attempt.belief;
    if let Some(time) = belief.grasp_time {
        let width = belief.grasp_width_m.map_or_else(String::new, |w| format!(" ({:.0} mm)", 1e3 * w));
        found.push((frame_of(time), format!("believes it holds fruit{width}"), None));
    }
    for yielding in &belief.yielded {
        found.push((frame_of(yielding.time), "retreats".to_owned(), None));
    }
    for event in record.fruit_detached.iter().filter(|e| within(e.frame)) {
        let knocked = attempt.knocked_off.iter().any(|k| k.fruit == event.fruit);
        let what = if knocked { "KNOCKED OFF" } else { "off its stem" };
        let harmed = knocked.then_some(CausedEvent::Stem(event.fruit));
        found.push((event.frame, format!("fruit {} {what}", event.fruit), harmed));
    }
    for held in &attempt.held {
        let what = match held.end {
            HeldEnd::InHand => continue,
            HeldEnd::LetGo => "let go",
            HeldEnd::Lost => "SLIPS",
        };
        found.push((held.to_frame, format!("fruit {} {what}", held.fruit), None));
    }
    for event in record.branches_snapped.iter().filter(|e| within(e.frame)) {
        let harmed = Some(CausedEvent::Branch(event.segment));
        found.push((event.frame, format!("branch SNAPS ({})", event.segment), harmed));
    }
    let end = attempt.failure_reason.as_deref().map_or_else(|| "placed".to_owned(), words);
    found.push((attempt.end_frame, format!("END: {end}"), None));
    found.sort_by_key(|(frame, ..)| *frame);
    let mut moments: Vec<Moment> = Vec::new();
    for (frame, caption, harmed) in found {
        match moments.last_mut() {
            Some(last) if frame <= last.frame.saturating_add(SAME) => {
                last.caption += &format!(", {caption}");
                last.harmed.extend(harmed);
            }
            _ => moments.push(Moment { frame, caption, harmed: harmed.into_iter().collect() }),
        }
    }
    moments
}

/// Length of a frame \[s\], from the record's time and frame count.
fn frame_length(record: &EpisodeRecord) -> f64 {
    record.duration_s / f64::from(record.frames.max(1))
}

/// The pictures and texts of a moment.
pub struct Panel {
    /// Time and event.
    pub caption: String,
    /// Text with the distances from the fingers to the fruit.
    pub distances: String,
    /// The view from outside.
    pub outside: Image<[u8; 3]>,
    /// The wrist camera's view.
    pub wrist: Image<[u8; 3]>,
}

/// Draws every moment that has a snapshot; `size` is that of a view \[px\].
pub fn panels(
    record: &EpisodeRecord,
    attempt: &AttemptRecord,
    moments: &[Moment],
    shots: &[Shot],
    size: [usize; 2],
) -> Vec<Panel> {
    let panel = |moment: &Moment| {
        let shot = shots.binary_search_by_key(&moment.frame, |shot| shot.frame).ok()?;
        let view = View::of(attempt, &shots[shot], &moment.harmed);
        let time = f64::from(moment.frame) * frame_length(record);
        let [outside, wrist] = view.pictures(size);
        let caption = format!("{time:.1} s {}", moment.caption);
        Some(Panel { caption, distances: view.distances(), outside, wrist })
    };
    moments.iter().filter_map(panel).collect()
}

/// Title of a strip.
pub fn title(record: &EpisodeRecord, attempt: &AttemptRecord) -> String {
    let key = &record.key;
    format!(
        "{}, seed {}, tree {}, attempt {}: {}",
        key.scenario.controller,
        key.seed,
        key.world,
        attempt.id,
        verdict(attempt)
    )
}

/// Draws the strip.
pub fn draw(
    record: &EpisodeRecord,
    attempt: &AttemptRecord,
    moments: &[Moment],
    shots: &[Shot],
) -> Image<[u8; 3]> {
    let panels = panels(record, attempt, moments, shots, [WIDTH, HEIGHT]);
    let columns = panels.len().clamp(1, COLUMNS);
    let rows = panels.len().div_ceil(COLUMNS).max(1);
    let row_height = 2 * caption::HEIGHT + 2 * (HEIGHT + GAP);
    let head = caption::HEIGHT;
    let mut sheet = Image::filled(columns * (WIDTH + GAP) + GAP, head + rows * row_height + GAP, PAPER);
    caption::write(&mut sheet, &title(record, attempt), 2 * GAP, 0);
    for (i, panel) in panels.iter().enumerate() {
        let (left, top) = (GAP + (i % COLUMNS) * (WIDTH + GAP), head + (i / COLUMNS) * row_height);
        let first: String = panel.caption.chars().take(LETTERS).collect();
        caption::write(&mut sheet, &first, left, top);
        caption::write(&mut sheet, &panel.distances, left, top + caption::HEIGHT - 6);
        let below = top + 2 * caption::HEIGHT;
        paste(&mut sheet, &panel.outside, left, below);
        paste(&mut sheet, &panel.wrist, left, below + HEIGHT + GAP);
    }
    sheet
}

/// Everything drawn for one moment.
struct View<'a> {
    shot: &'a Shot,
    /// Centre and radius of the target fruit, if there is one.
    fruit: Option<(Vec3, f64)>,
    /// The target as committed.
    p_world_target: Vec3,
    p_world_tcp: Vec3,
    /// Horizontal direction towards the robot's position at the commitment.
    towards_robot: Vec3,
    /// Spheres around the fruit and branches harmed at this moment.
    harmed: Vec<(Vec3, f64)>,
}

impl<'a> View<'a> {
    fn of(attempt: &AttemptRecord, shot: &'a Shot, harmed: &[CausedEvent]) -> Self {
        let world = &shot.world;
        let target = attempt.fruit.or(attempt.gripped.first().copied());
        let fruit = target.and_then(|fruit| place_of(world, CausedEvent::Stem(fruit)));
        let p_world_target = transform(&world.x_world_odom(), &Vec3::from(attempt.p_odom_target));
        let base = world.handle().x_world_base(world.data()).translation.vector;
        let away = base - p_world_target;
        Self {
            shot,
            fruit,
            p_world_target,
            p_world_tcp: world.handle().x_world_tcp(world.data()).translation.vector,
            harmed: harmed.iter().filter_map(|happened| place_of(world, *happened)).collect(),
            towards_robot: Vec3::new(away.x, away.y, 0.0).try_normalize(1e-9).unwrap_or_else(Vec3::x),
        }
    }

    /// Text with the distances from the fingers to the true and the believed fruit position.
    fn distances(&self) -> String {
        let millimetres = |p: &Vec3| 1e3 * (self.p_world_tcp - p).norm();
        let fruit = self.fruit.map_or_else(|| "-".to_owned(), |(p, _)| format!("{:.0} mm", millimetres(&p)));
        let world = &self.shot.world;
        if world.handle().cup.is_some() {
            return format!("cup, to fruit {fruit}");
        }
        let opening = |finger: &Finger<BodyId>| {
            let q: f64 = world.data().q[world.model().qs(finger.drive)].iter().sum();
            finger.opening.at(q)
        };
        let open: f64 = world.handle().fingers.iter().map(opening).sum();
        format!("fingers {:.0} mm open, to fruit {fruit}", 1e3 * open.abs())
    }

    /// The outside view and the wrist view.
    fn pictures(&self, [width, height]: [usize; 2]) -> [Image<[u8; 3]>; 2] {
        let world = &self.shot.world;
        let style = PictureStyle {
            supersampling: 2,
            shadows: ShadowMaps { sun: 1024, sky: 128 },
            ..PictureStyle::default()
        };
        let whole = world.picture_scene();
        let (x_world_eye, fov) = self.eye();
        let outside_intrinsics = Intrinsics::from_vertical_fov(width, height, fov);
        let focus = self.focus();
        let open = without_foreground(&whole, &x_world_eye.translation.vector, &focus);
        let mut outside = Studio::new(&open, &style).picture(&outside_intrinsics, &x_world_eye);
        self.mark(&mut outside, &outside_intrinsics, &x_world_eye, false);

        let x_world_camera = world.x_world_camera();
        let view = world.spec().camera.view();
        let wrist_intrinsics = Intrinsics::from_vertical_fov(width, height, view.vertical_fov.si());
        let mut wrist = Studio::new(&whole, &style).picture(&wrist_intrinsics, &x_world_camera);
        self.mark(&mut wrist, &wrist_intrinsics, &x_world_camera, true);
        [outside, wrist]
    }

    /// True if the hand is within 0.5 m of the target.
    fn is_near(&self) -> bool {
        (self.p_world_tcp - self.p_world_target).norm() < 0.5
    }

    /// Point that the outside view looks at, in the world frame.
    fn focus(&self) -> Vec3 {
        if self.is_near() {
            self.p_world_target + self.towards_robot * 0.08
        } else {
            let robot = self.shot.world.handle().x_world_base(self.shot.world.data()).translation.vector;
            (self.p_world_target + robot) * 0.5 + Vec3::z() * 0.35
        }
    }

    /// Pose of the outside camera and its vertical field of view: across the arm, a little from above.
    fn eye(&self) -> (Pose, f64) {
        let across = Vec3::z().cross(&self.towards_robot);
        // From the side that is farther from the trunk, and a little from behind the hand.
        let outwards = Vec3::new(self.p_world_target.x, self.p_world_target.y, 0.0);
        let side = if across.dot(&outwards) >= 0.0 { 1.0 } else { -1.0 };
        let direction = (across * (0.85 * side) + self.towards_robot * 0.5 + Vec3::z() * 0.35).normalize();
        let (distance, fov) = if self.is_near() { (0.95, 0.62) } else { (2.9, 0.7) };
        let focus = self.focus();
        (look_at(&(focus + direction * distance), &focus), fov)
    }

    fn mark(&self, image: &mut Image<[u8; 3]>, intrinsics: &Intrinsics, x_world_camera: &Pose, seen: bool) {
        let mut marked = Marked { image, intrinsics, x_world_camera };
        if let Some((p_world, radius)) = &self.fruit {
            marked.ball(p_world, *radius, TRUTH);
        }
        for (p_world, radius) in &self.harmed {
            marked.ball(p_world, *radius, HARMED);
        }
        marked.cross(&self.p_world_target, BELIEF);
        if seen {
            let x_world_odom = self.shot.world.x_world_odom();
            for p_odom in &self.shot.p_odom_detected {
                marked.dot(&transform(&x_world_odom, p_odom), SEEN);
            }
        }
    }
}

/// Sphere around a fruit, or around the base of a segment.
fn place_of(world: &World, happened: CausedEvent) -> Option<(Vec3, f64)> {
    const ABOUT_A_BREAK: f64 = 0.02;
    match happened {
        CausedEvent::Stem(fruit) => {
            world.fruit_truth().get(fruit as usize).map(|truth| (truth.p_world, truth.radius))
        }
        CausedEvent::Branch(segment) => {
            let body = *world.tree().bodies.get(segment as usize)?;
            Some((world.data().x_world_body(body).translation.vector, ABOUT_A_BREAK))
        }
        CausedEvent::End { .. } => None,
    }
}

/// Returns the scene without the leaves between the camera and its focus.
fn without_foreground(scene: &Scene, eye: &Vec3, focus: &Vec3) -> Scene {
    let way = focus - eye;
    let length = way.norm();
    let direction = way / length;
    let hides = |p: &Vec3| {
        let along = (p - eye).dot(&direction);
        let aside = ((p - eye) - direction * along).norm();
        // A tube about the line of sight, a little wider than the hand.
        along < length + 0.03 && aside < 0.2
    };
    let items = scene
        .items
        .iter()
        .filter(|item| item.label != Label::Leaf || !hides(&item.x_world_item.translation.vector));
    Scene { items: items.cloned().collect() }
}
