//! Marks of the overlays over the present state of a world.

use orchard_fruit::Phase;
use orchard_geometry::{Pose, Vec3, math, transform};
use orchard_picker::{Event, Goal, State};
use orchard_world::World;

use crate::marks::{Marks, colour};
use crate::overlay::{Overlay, Overlays};
use crate::paint::load_colour;
use crate::session::Session;
use crate::trace::contacts;

/// Length of an arrow over its force [m/N], and the longest arrow \[m\].
const FORCE_SCALE: f64 = 0.01;
const LONGEST: f64 = 0.8;
/// Radius of an arrow's shaft \[m\].
const SHAFT: f64 = 0.006;
/// Radius of the line along a stem \[m\].
const STEM: f64 = 0.007;

/// Radius of the sphere about a target over the target's.
const AROUND: f64 = 1.15;

/// A sphere that the detector found in the latest image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen {
    /// Centre \[m\], world.
    pub p_world: Vec3,
    /// Radius \[m\].
    pub radius: f64,
    /// Probability that it is a fruit, as the detector judges.
    pub score: f64,
}

/// A controller's target: centre \[m\], world, and radius \[m\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    /// Centre \[m\], world.
    pub p_world: Vec3,
    /// Radius \[m\].
    pub radius: f64,
}

/// The target that a controller has committed to, from its log.
pub fn target(session: &Session) -> Option<Target> {
    let events = &session.controller()?.record().events;
    let open = events.iter().rev().find_map(|event| match event {
        Event::AttemptStarted { p_odom, radius, .. } => Some(Some((*p_odom, *radius))),
        Event::AttemptEnded { .. } => Some(None),
        _ => None,
    })?;
    let (p_odom, radius) = open?;
    Some(Target { p_world: transform(&session.world().x_world_odom(), &p_odom), radius })
}

/// A line of text for an event of a controller's log.
pub fn line(event: &Event) -> String {
    match event {
        Event::StateChanged { time, state } => format!("{time:6.1} s  {}", state_name(*state)),
        Event::AttemptStarted { time, id, .. } => format!("{time:6.1} s  attempt {id}: target"),
        Event::Grasped { time, id, width } => {
            format!("{time:6.1} s  attempt {id}: grasped, {:.0} mm", width * 1e3)
        }
        Event::StemGaveWay { time, id, pull } => {
            format!("{time:6.1} s  attempt {id}: stem gave way, {pull:.0} N")
        }
        Event::Yielded { time, id, force } => format!("{time:6.1} s  attempt {id}: gave way, {force:.0} N"),
        Event::AttemptEnded { time, id, end } => format!("{time:6.1} s  attempt {id}: {}", ended(end)),
        Event::GaveUp { time, .. } => format!("{time:6.1} s  gave up"),
        Event::Alarm { time, alarm } => format!("{time:6.1} s  ALARM: {}", words(alarm)),
        Event::AlarmEnded { time, alarm } => format!("{time:6.1} s  alarm over: {}", words(alarm)),
    }
}

/// Words for the end of an attempt.
fn ended(end: &orchard_picker::AttemptEnd) -> String {
    match end {
        orchard_picker::AttemptEnd::Deposited => "deposited".to_owned(),
        orchard_picker::AttemptEnd::Failed(reason) => words(reason),
    }
}

/// Words for a reason or an alarm: `NoFruitAtDetection` as "no fruit at detection".
fn words(reason: &impl std::fmt::Debug) -> String {
    let name = format!("{reason:?}");
    let words = name.chars().enumerate().flat_map(|(k, letter)| {
        let space = (k > 0 && letter.is_uppercase()).then_some(' ');
        space.into_iter().chain(letter.to_lowercase())
    });
    words.collect()
}

/// Name of a controller's state.
pub fn state_name(state: State) -> &'static str {
    match state {
        State::Scan => "scan",
        State::Align => "align",
        State::Reach => "reach",
        State::Grasp => "grasp",
        State::Pull => "pull",
        State::Deposit => "deposit",
        State::Retreat => "retreat",
        State::Safe => "safe",
    }
}

/// Adds the marks of all overlays that are on, and of the hand's pull.
pub fn annotate(marks: &mut Marks, session: &Session, overlays: &Overlays, seen: &[Seen]) {
    marks.clear();
    let world = session.world();
    if let Some(pull) = session.pull() {
        let (p, target) = (Vec3::from(pull.p_world), Vec3::from(pull.p_world_target));
        marks.arrow(&p, &(target - p), SHAFT, colour::ORANGE);
    }
    if overlays.has(Overlay::Contacts) {
        for contact in contacts(world) {
            let way = contact.force_world * FORCE_SCALE;
            let way = if way.norm() > LONGEST { way.normalize() * LONGEST } else { way };
            marks.arrow(&contact.p_world, &way, SHAFT, colour::RED);
        }
    }
    if overlays.has(Overlay::Detections) {
        for Seen { p_world, radius, score } in seen {
            // Surer detections are denser.
            marks.ball(p_world, radius * 1.04, colour::BLUE, 0.25 + 0.5 * *score as f32);
        }
    }
    if overlays.has(Overlay::Plan) {
        plan(marks, session);
    }
    if overlays.has(Overlay::Reach) {
        let (p_world, radius) = reach(world);
        marks.ball(&p_world, radius, colour::SKY, 0.16);
    }
    if overlays.has(Overlay::Stems) {
        stems(marks, world);
    }
    if overlays.has(Overlay::Frames) {
        let (handle, data) = (world.handle(), world.data());
        marks.frame(&Pose::identity(), 0.5);
        marks.frame(&handle.x_world_base(data), 0.4);
        marks.frame(&handle.x_world_tcp(data), 0.15);
        marks.frame(&handle.x_world_camera(data), 0.15);
    }
}

/// A line along the stem of each fruit that hangs, in the colour of its load over its strength.
fn stems(marks: &mut Marks, world: &World) {
    let (fruit, data) = (world.fruit(), world.data());
    for (i, apple) in fruit.fruit.iter().enumerate() {
        if world.fruit_lives().phase(i) != Phase::Hanging {
            continue;
        }
        let x_world_segment = data.x_world_body(world.tree().bodies[apple.segment]);
        let p_anchor = transform(x_world_segment, &apple.p_segment);
        let p_fruit = data.point_p_world[fruit.points[i].index()];
        let share = fruit.stem_load_share(world.model(), data, i);
        marks.line(&p_anchor, &p_fruit, STEM, load_colour(share));
        // It is seen past the fruit from all sides.
        marks.ball(&p_anchor, 2.0 * STEM, load_colour(share), 1.0);
    }
}

/// Adds the goal of a task that a person demonstrates: a sphere about the fruit, or an arrow whose tip is the point and whose way is the side to come from.
pub fn mark_goal(marks: &mut Marks, world: &World, goal: &Goal) {
    /// Length of the arrow \[m\].
    const WAY: f64 = 0.3;
    let x_world_odom = world.x_world_odom();
    match goal {
        Goal::Grasp { p_odom, radius } => {
            let p_world = transform(&x_world_odom, p_odom);
            marks.ball(&p_world, radius * AROUND, colour::BLUE, 0.45);
            // From above: leaves may hide the ball.
            let above = Vec3::new(0.0, 0.0, WAY + radius * AROUND);
            marks.arrow(&(p_world + above), &Vec3::new(0.0, 0.0, -WAY), SHAFT, colour::BLUE);
        }
        Goal::Reach { p_odom, heading_odom } => {
            let (sin, cos) = math::sin_cos(*heading_odom);
            let way = x_world_odom.rotation * Vec3::new(cos, sin, 0.0) * WAY;
            marks.arrow(&(transform(&x_world_odom, p_odom) - way), &way, SHAFT, colour::BLUE);
        }
    }
}

/// A goal as a sentence for the person who demonstrates it.
pub fn goal_sentence(goal: &Goal) -> &'static str {
    match goal {
        Goal::Grasp { .. } => {
            "hold the fruit below the blue arrow between the fingers, then keep the demonstration"
        }
        Goal::Reach { .. } => "bring the hand along the blue arrow to its tip, then keep the demonstration",
    }
}

/// The target, the way to it, and the commanded pose of the hand.
fn plan(marks: &mut Marks, session: &Session) {
    let world = session.world();
    let (handle, data) = (world.handle(), world.data());
    let p_hand = handle.x_world_tcp(data).translation.vector;
    if let Some(target) = target(session) {
        marks.ball(&target.p_world, target.radius * AROUND, colour::YELLOW, 0.45);
        marks.line(&p_hand, &target.p_world, 0.7 * SHAFT, colour::YELLOW);
    }
    if let Some(command) = session.command() {
        let x_base_tcp = world.robot().kinematics().tcp(&command.arm_q.vector());
        marks.frame(&(handle.x_world_base(data) * x_base_tcp), 0.1);
    }
}

/// The reach sphere: its centre, the origin of the arm's second joint \[m\], world, and its radius \[m\].
pub fn reach(world: &World) -> (Vec3, f64) {
    let own = world.robot().config().reach.as_ref().map(|reach| &reach.radius);
    let radius = own.unwrap_or(&world.spec().episode.reach_radius).si();
    (world.data().x_world_body(world.handle().arm[1]).translation.vector, radius)
}

#[cfg(test)]
mod tests {
    use super::*;
    use orchard_picker::{AttemptEnd, FailureReason};

    #[test]
    fn log_lines_are_words() {
        let end = AttemptEnd::Failed(FailureReason::NoFruitAtDetection);
        assert_eq!(
            line(&Event::AttemptEnded { time: 12.34, id: 3, end }),
            "  12.3 s  attempt 3: no fruit at detection"
        );
        assert_eq!(line(&Event::StateChanged { time: 1.0, state: State::Scan }), "   1.0 s  scan");
    }
}
