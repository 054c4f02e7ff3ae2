//! Implements the benchmark's interfaces for the simulated world and the picker.

use orchard_geometry::{Pose, Vec3};
use orchard_multibody::Owner;
use orchard_perception::Sighting;
use orchard_picker::{AttemptEnd, Controller, Event, ImageReport, Record};
use orchard_robot::io::{Command, Observation};
use orchard_world::{Status, World, WorldEvent};
use serde::de::DeserializeOwned;

use crate::harvest::interface::{
    BenchController, BenchWorld, ControllerEvent, FruitTruth, HandForces, VisibleFruit,
};

/// A simulated world that is stepped in some way.
pub trait Simulated {
    /// The world.
    fn world(&self) -> &World;
    /// The world, to read its sensors and events.
    fn world_mut(&mut self) -> &mut World;
    /// Advances it one frame under a command.
    fn advance(&mut self, command: &Command);
}

impl Simulated for World {
    fn world(&self) -> &World {
        self
    }

    fn world_mut(&mut self) -> &mut World {
        self
    }

    fn advance(&mut self, command: &Command) {
        World::step(self, command);
    }
}

impl<S: Simulated> BenchWorld for S {
    fn observe(&mut self) -> Observation {
        self.world_mut().observe()
    }

    fn step(&mut self, command: &Command) {
        self.advance(command);
    }

    fn drain_events(&mut self) -> Vec<WorldEvent> {
        self.world_mut().drain_events()
    }

    fn fruit(&self) -> Vec<FruitTruth> {
        self.world().fruit_truth()
    }

    fn visible_fruit(&self) -> Vec<VisibleFruit> {
        let views = self.world().camera_truth().map_or(&[][..], |truth| truth.fruit());
        let seen = views.iter().filter(|view| view.visible_px > 0);
        seen.map(|view| VisibleFruit { fruit: view.instance, pixels: view.visible_px }).collect()
    }

    fn x_world_odom(&self) -> Pose {
        self.world().x_world_odom()
    }

    fn reachable(&self) -> Vec<bool> {
        self.world().reachable()
    }

    fn reachable_ik_count(&self) -> Option<u32> {
        Some(self.world().reachable_by_ik())
    }

    fn peak_stem_pull(&self) -> f64 {
        self.world().fruit_lives().peak_tension()
    }

    fn hand_forces(&self) -> HandForces {
        let world = self.world();
        let handle = world.handle();
        let (mut fingers, mut wrist_world) = ([0.0; 2], Vec3::zeros());
        for contact in &world.report().contacts {
            for (collider, sign) in [(contact.a, 1.0), (contact.b, -1.0)] {
                let Owner::Body(body) = world.model().collider(collider).owner else { continue };
                let side = handle.fingers.iter().position(|finger| finger.has(body));
                if side.is_some() || body == handle.wrist() {
                    wrist_world += contact.force_world * sign;
                }
                if let Some(side) = side {
                    fingers[side] += contact.force_world.dot(&contact.n_world).abs();
                }
            }
        }
        HandForces { finger: fingers[0].max(fingers[1]), wrist: wrist_world.norm() }
    }

    fn fruit_bruise(&self, fruit: u32) -> Option<f64> {
        Some(self.world().fruit_bruise(fruit as usize).peak_impact_energy)
    }

    fn bruise_volume(&self, fruit: u32) -> Option<f64> {
        self.world().fruit_bruise(fruit as usize).volume(&self.world().spec().fruit)
    }

    fn stem_strength(&self, fruit: u32) -> Option<f64> {
        let (set, spec) = (self.world().fruit(), &self.world().spec().fruit);
        // A tether gives way above a multiple of the pull that detaches its fruit.
        let factor = if spec.stem.is_some() { 1.0 } else { spec.tension_factor.si() };
        set.fruit.get(fruit as usize).map(|fruit| fruit.detach_force * factor)
    }

    fn breaks_at_union(&self, segment: u32) -> bool {
        self.world().tree().union_fails[segment as usize]
    }

    fn quarantine(&self) -> Option<String> {
        match self.world().status() {
            Status::Running => None,
            Status::Quarantined { frame, reason } => Some(format!("frame {frame}: {reason}")),
        }
    }
}

/// Reads the log of a controller incrementally.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct LogReader {
    events_read: usize,
    images_read: usize,
}

impl LogReader {
    /// Returns what is new in a record since the last read, images first.
    pub fn read(&mut self, record: &Record) -> Vec<ControllerEvent> {
        let detected = |image: &ImageReport| ControllerEvent::Detected {
            p_odom: image.detections.iter().map(|d| d.p_odom).collect(),
            radius: image.detections.iter().map(|d| d.radius).collect(),
        };
        let mut log: Vec<ControllerEvent> =
            since(&record.images, &mut self.images_read).iter().map(detected).collect();
        log.extend(since(&record.events, &mut self.events_read).iter().map(logged));
        log
    }
}

/// A controller whose event log is read incrementally.
pub struct Recorded<C> {
    controller: C,
    reader: LogReader,
}

impl<C: Controller> Recorded<C> {
    /// Wraps a controller at the start of an episode.
    pub fn new(controller: C) -> Self {
        Self { controller, reader: LogReader::default() }
    }
}

impl<C: Controller> BenchController for Recorded<C> {
    fn act(&mut self, observation: &Observation) -> Command {
        self.controller.act(observation)
    }

    fn run_ends_at(&mut self, time: f64) {
        self.controller.run_ends_at(time);
    }

    fn drain_log(&mut self) -> Vec<ControllerEvent> {
        self.reader.read(self.controller.record())
    }
}

/// Returns the new items of a list since the last read; none if it has become shorter.
fn since<'a, T>(list: &'a [T], read: &mut usize) -> &'a [T] {
    let new = list.get(*read..).unwrap_or_default();
    *read = list.len();
    new
}

fn logged(event: &Event) -> ControllerEvent {
    match event {
        Event::AttemptStarted { p_odom, radius, .. } => {
            ControllerEvent::AttemptStarted { p_odom_target: *p_odom, radius: *radius }
        }
        Event::StateChanged { state, .. } => ControllerEvent::StateChanged { state: name(state) },
        Event::AttemptEnded { end: AttemptEnd::Deposited, .. } => {
            ControllerEvent::AttemptEnded { failure: None }
        }
        Event::AttemptEnded { end: AttemptEnd::Failed(reason), .. } => {
            ControllerEvent::AttemptEnded { failure: Some(name(reason)) }
        }
        Event::GaveUp { fault, .. } => ControllerEvent::GaveUp { fault: name(fault) },
        Event::Alarm { alarm, .. } => ControllerEvent::Alarm { alarm: name(alarm) },
        Event::AlarmEnded { alarm, .. } => ControllerEvent::AlarmEnded { alarm: name(alarm) },
        Event::Grasped { width, .. } => ControllerEvent::Grasped { width: *width },
        Event::Yielded { force, .. } => ControllerEvent::Yielded { force: *force },
        Event::StemGaveWay { pull, .. } => ControllerEvent::StemGaveWay { pull: *pull },
    }
}

impl ControllerEvent {
    /// Adds the event to a controller's record, as the inverse of [`Recorded`]'s reading; `time` is that of the observation \[s\].
    ///
    /// # Errors
    /// A state or reason that has no such name, detections with another number of centres than of radii, or an event of an attempt before
    /// the first one.
    pub fn note_in(&self, record: &mut Record, time: f64) -> Result<(), String> {
        let starts =
            record.events.iter().filter(|e| matches!(e, Event::AttemptStarted { .. })).count() as u32;
        let attempt =
            || starts.checked_sub(1).ok_or("an event of an attempt before the first AttemptStarted");
        let event = match self {
            Self::Detected { p_odom, radius } if p_odom.len() != radius.len() => {
                return Err(format!("{} centres and {} radii of detections", p_odom.len(), radius.len()));
            }
            Self::Detected { p_odom, radius } => {
                let sighting = |(p_odom, radius): (&Vec3, &f64)| Sighting {
                    p_odom: *p_odom,
                    radius: *radius,
                    score: 1.0,
                };
                let detections = p_odom.iter().zip(radius).map(sighting).collect();
                record.images.push(ImageReport { time, detections });
                return Ok(());
            }
            Self::AttemptStarted { p_odom_target, radius } => {
                Event::AttemptStarted { time, id: starts, p_odom: *p_odom_target, radius: *radius }
            }
            Self::StateChanged { state } => Event::StateChanged { time, state: named("state", state)? },
            Self::AttemptEnded { failure } => {
                let reason = failure.as_deref().map(|reason| named("reason", reason)).transpose()?;
                let end = reason.map_or(AttemptEnd::Deposited, AttemptEnd::Failed);
                Event::AttemptEnded { time, id: attempt()?, end }
            }
            Self::GaveUp { fault } => Event::GaveUp { time, fault: named("fault", fault)? },
            Self::Alarm { alarm } => Event::Alarm { time, alarm: named("alarm", alarm)? },
            Self::AlarmEnded { alarm } => Event::AlarmEnded { time, alarm: named("alarm", alarm)? },
            Self::Grasped { width } => Event::Grasped { time, id: attempt()?, width: *width },
            Self::Yielded { force } => Event::Yielded { time, id: attempt()?, force: *force },
            Self::StemGaveWay { pull } => Event::StemGaveWay { time, id: attempt()?, pull: *pull },
        };
        record.events.push(event);
        Ok(())
    }
}

/// The state or reason of a name.
fn named<T: DeserializeOwned>(what: &str, name: &str) -> Result<T, String> {
    serde_json::from_value(name.into()).map_err(|e| format!("{what} {name}: {e}"))
}

/// The serialised name of a state or reason.
fn name(value: &impl serde::Serialize) -> String {
    match serde_json::to_value(value) {
        Ok(serde_json::Value::String(name)) => name,
        other => unreachable!("a unit variant serialises to its name, not {other:?}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_noted_in_a_record_are_read_from_it() {
        struct Told(Record);
        impl Controller for Told {
            fn act(&mut self, seen: &Observation) -> Command {
                Command::still(seen)
            }
            fn record(&self) -> &Record {
                &self.0
            }
        }
        let p = Vec3::new(0.1 + 0.2, -1.0, 1.5);
        let events = [
            ControllerEvent::Detected { p_odom: vec![p, -p], radius: vec![0.03, 0.04] },
            ControllerEvent::StateChanged { state: "scan".into() },
            ControllerEvent::AttemptStarted { p_odom_target: p, radius: 0.035 },
            ControllerEvent::Grasped { width: 0.07 },
            ControllerEvent::Yielded { force: 3.0 },
            ControllerEvent::StemGaveWay { pull: 21.5 },
            ControllerEvent::AttemptEnded { failure: None },
            ControllerEvent::AttemptStarted { p_odom_target: -p, radius: 0.03 },
            ControllerEvent::AttemptEnded { failure: Some("slipped".into()) },
            ControllerEvent::GaveUp { fault: "no_action".into() },
        ];
        let mut record = Record::default();
        for event in &events {
            event.note_in(&mut record, 0.5).unwrap();
        }
        assert!(matches!(record.events[6], Event::AttemptStarted { id: 1, time: 0.5, .. }));
        assert_eq!(Recorded::new(Told(record.clone())).drain_log(), events);
        let refused = |event: ControllerEvent, record: &mut Record| event.note_in(record, 0.0).unwrap_err();
        let e = refused(ControllerEvent::StateChanged { state: "nap".into() }, &mut record);
        assert!(e.starts_with("state nap: unknown variant"), "{e}");
        let e = refused(ControllerEvent::Grasped { width: 0.1 }, &mut Record::default());
        assert!(e.contains("before the first"), "{e}");
        let none = ControllerEvent::Detected { p_odom: vec![p], radius: vec![] };
        assert_eq!(refused(none, &mut record), "1 centres and 0 radii of detections");
    }

    #[test]
    fn a_list_is_told_once_and_may_lose_what_was_told() {
        let (mut list, mut read) = (vec![1, 2], 0);
        assert_eq!(since(&list, &mut read), [1, 2]);
        list.push(3);
        assert_eq!(since(&list, &mut read), [3]);
        assert!(since(&list, &mut read).is_empty());
        // A controller that clears its record.
        list.truncate(1);
        assert!(since(&list, &mut read).is_empty());
        list.push(4);
        assert_eq!(since(&list, &mut read), [4]);
    }

    /// A tether bears a multiple of the pull that detaches its fruit, a stem its own strength; a fruit that is not there has none.
    #[test]
    fn strengths_are_those_of_tethers_and_stems() {
        let scenario = orchard_scenario::Scenario::of(&[]).unwrap().on_protocol("field");
        let harvest = crate::harvest::Harvest::new(scenario).unwrap();
        for (condition, factor) in [("nominal", 1.2), ("tall-spindle", 1.0)] {
            let world = harvest.scenario_of(condition).unwrap().world(1, 0, 0).unwrap();
            assert_eq!(world.spec().fruit.stem.is_some(), factor == 1.0);
            for (i, fruit) in world.fruit().fruit.iter().enumerate() {
                let strength = world.stem_strength(i as u32).unwrap();
                assert!((strength / fruit.detach_force - factor).abs() < 1e-12, "{condition} {i}");
            }
            assert_eq!(world.stem_strength(world.fruit().fruit.len() as u32), None);
        }
    }
}
