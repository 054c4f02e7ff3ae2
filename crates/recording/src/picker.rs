//! Messages from controller events: state, target, detections.

use foxglove::messages::log::Level;
use foxglove::messages::{Log, SceneUpdate};
use orchard_geometry::Vec3;
use orchard_tasks::harvest::interface::ControllerEvent;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::clock::nanoseconds;
use crate::event::line;
use crate::scene::{Ball, balls};
use crate::transforms::ODOM;

/// Colours of the controller's detections and target, not in linear light: red, green, blue, opacity.
const DETECTION: [f64; 4] = [0.1, 0.7, 1.0, 0.45];
const TARGET: [f64; 4] = [1.0, 0.9, 0.0, 0.6];

/// A sphere estimated by a controller.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Sphere {
    /// Centre in odom, x (m).
    pub x: f64,
    /// Centre in odom, y (m).
    pub y: f64,
    /// Centre in odom, z (m).
    pub z: f64,
    /// Radius (m).
    pub radius: f64,
}

/// All detections of one depth image.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DetectionsMessage {
    /// Capture time of the image (ns).
    pub image_time: u64,
    /// The detections, in the controller's order.
    pub detections: Vec<Sphere>,
}

/// Attempt and state of the controller, written on every change.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PickerMessage {
    /// Event: `attempt_started`, `state_changed`, `grasped`, `stem_gave_way`, `yielded`, `attempt_ended`, `gave_up`, `alarm` or `alarm_ended`.
    pub event: String,
    /// Number of the attempt, from 1; 0 before the first.
    pub attempt: u32,
    /// True while an attempt is in progress.
    pub trying: bool,
    /// State of the controller; empty before the first `state_changed`.
    pub state: String,
    /// Width between the fingers (m), of `grasped`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "f64")]
    pub width: Option<f64>,
    /// Pull or resistance that the controller felt (N), of `stem_gave_way` and `yielded`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "f64")]
    pub force: Option<f64>,
    /// Reason, of `gave_up` and `attempt_ended`, or fault, of `alarm` and `alarm_ended`; left out where the controller reports that it placed the fruit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "String")]
    pub failure: Option<String>,
}

/// Messages for one controller event.
#[derive(Debug, Default)]
pub struct ControllerMessages {
    /// Detections, also as spheres for display.
    pub detections: Option<(DetectionsMessage, SceneUpdate)>,
    /// Attempt and state, with a line of the log.
    pub picker: Option<(PickerMessage, Log)>,
    /// Target as a sphere; no sphere clears it.
    pub target: Option<SceneUpdate>,
}

/// Builds messages from controller events; keeps the attempt and the state.
#[derive(Debug, Clone, Default)]
pub struct Notes {
    attempt: u32,
    trying: bool,
    state: String,
}

impl Notes {
    /// Builds the messages for an event; `depth_time` is the capture time of the observation's image (s).
    pub fn take(&mut self, log_time: u64, depth_time: f64, event: &ControllerEvent) -> ControllerMessages {
        let mut messages = ControllerMessages::default();
        let (mut width, mut force, mut why) = (None, None, None);
        let (name, level, text) = match event {
            ControllerEvent::Detected { p_odom, radius } => {
                messages.detections = Some(detections(log_time, depth_time, p_odom, radius));
                return messages;
            }
            ControllerEvent::AttemptStarted { p_odom_target, radius } => {
                self.attempt += 1;
                self.trying = true;
                let ball = Ball { p: *p_odom_target, radius: *radius, color: TARGET };
                messages.target = Some(balls(log_time, ODOM, "target", &[ball]));
                ("attempt_started", Level::Info, format!("attempt {} begins", self.attempt))
            }
            ControllerEvent::StateChanged { state } => {
                self.state.clone_from(state);
                ("state_changed", Level::Debug, format!("state {state}"))
            }
            ControllerEvent::Grasped { width: between } => {
                width = finite(*between);
                ("grasped", Level::Info, format!("holds something {:.0} mm wide", between * 1e3))
            }
            ControllerEvent::StemGaveWay { pull } => {
                force = finite(*pull);
                ("stem_gave_way", Level::Info, format!("the stem gave way at {pull:.1} N"))
            }
            ControllerEvent::Yielded { force: felt } => {
                force = finite(*felt);
                ("yielded", Level::Warning, format!("goes back from {felt:.1} N"))
            }
            ControllerEvent::AttemptEnded { failure } => {
                self.trying = false;
                messages.target = Some(balls(log_time, ODOM, "target", &[]));
                why.clone_from(failure);
                let text = |reason: &String| format!("attempt {} failed: {reason}", self.attempt);
                let placed = || format!("attempt {} ends: the fruit is placed", self.attempt);
                let level = if failure.is_some() { Level::Warning } else { Level::Info };
                ("attempt_ended", level, failure.as_ref().map_or_else(placed, text))
            }
            ControllerEvent::GaveUp { fault } => {
                why = Some(fault.clone());
                ("gave_up", Level::Error, format!("the controller gave up: {fault}"))
            }
            ControllerEvent::Alarm { alarm } => {
                why = Some(alarm.clone());
                ("alarm", Level::Error, format!("alarm: {alarm}"))
            }
            ControllerEvent::AlarmEnded { alarm } => {
                why = Some(alarm.clone());
                ("alarm_ended", Level::Info, format!("alarm over: {alarm}"))
            }
        };
        let message = PickerMessage {
            event: name.to_owned(),
            attempt: self.attempt,
            trying: self.trying,
            state: self.state.clone(),
            width,
            force,
            failure: why,
        };
        messages.picker = Some((message, line(log_time, "picker", level, text)));
        messages
    }
}

fn detections(
    log_time: u64,
    depth_time: f64,
    p_odom: &[Vec3],
    radius: &[f64],
) -> (DetectionsMessage, SceneUpdate) {
    let found = p_odom.iter().zip(radius);
    let spheres = found.clone().map(|(p, &radius)| Sphere { x: p.x, y: p.y, z: p.z, radius });
    let drawn: Vec<Ball> = found.map(|(p, &radius)| Ball { p: *p, radius, color: DETECTION }).collect();
    let message = DetectionsMessage { image_time: nanoseconds(depth_time), detections: spheres.collect() };
    (message, balls(log_time, ODOM, "detections", &drawn))
}

fn finite(x: f64) -> Option<f64> {
    x.is_finite().then_some(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn notes_carry_what_the_controller_is_at() {
        let mut notes = Notes::default();
        let mut take = |event| notes.take(7, 0.5, &event);
        let started = take(ControllerEvent::AttemptStarted { p_odom_target: Vec3::x(), radius: 0.04 });
        assert_eq!(started.target.unwrap().entities[0].spheres.len(), 1);
        let changed = take(ControllerEvent::StateChanged { state: "reach".into() }).picker.unwrap().0;
        assert_eq!((changed.attempt, changed.trying, changed.state.as_str()), (1, true, "reach"));
        let seen = take(ControllerEvent::Detected { p_odom: vec![Vec3::y()], radius: vec![0.03] });
        let (message, drawn) = seen.detections.unwrap();
        assert_eq!(message.image_time, 500_000_000);
        assert_eq!(message.detections, [Sphere { x: 0.0, y: 1.0, z: 0.0, radius: 0.03 }]);
        assert_eq!(drawn.entities[0].spheres[0].size.unwrap().x, 0.06);
        let ended = take(ControllerEvent::AttemptEnded { failure: Some("slipped".into()) });
        assert!(ended.target.unwrap().entities[0].spheres.is_empty());
        let ended = ended.picker.unwrap().0;
        assert_eq!(
            (ended.trying, ended.failure.as_deref(), ended.state.as_str()),
            (false, Some("slipped"), "reach")
        );
    }
}
