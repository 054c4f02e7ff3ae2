//! Implements the benchmark's interfaces for the simulated world and the picker.

use orchard_geometry::{Pose, Vec3};
use orchard_multibody::Owner;
use orchard_picker::{AttemptEnd, Controller, Event, ImageReport};
use orchard_robot::io::{Command, Observation};
use orchard_world::{Status, World, WorldEvent};

use crate::harvest::interface::{
    BenchController, BenchWorld, ControllerEvent, FruitTruth, HandForces, VisibleFruit,
};

impl BenchWorld for World {
    fn observe(&mut self) -> Observation {
        World::observe(self)
    }

    fn step(&mut self, command: &Command) {
        World::step(self, command);
    }

    fn drain_events(&mut self) -> Vec<WorldEvent> {
        World::drain_events(self)
    }

    fn fruit(&self) -> Vec<FruitTruth> {
        self.fruit_truth()
    }

    fn visible_fruit(&self) -> Vec<VisibleFruit> {
        let views = self.camera_truth().map_or(&[][..], |truth| &truth.fruit);
        let seen = views.iter().filter(|view| view.visible_px > 0);
        seen.map(|view| VisibleFruit { fruit: view.instance, pixels: view.visible_px }).collect()
    }

    fn x_world_odom(&self) -> Pose {
        World::x_world_odom(self)
    }

    fn reachable(&self) -> Vec<bool> {
        World::reachable(self)
    }

    fn reachable_ik_count(&self) -> Option<u32> {
        Some(self.reachable_by_ik())
    }

    fn peak_stem_pull(&self) -> f64 {
        self.fruit_lives().peak_tension()
    }

    fn hand_forces(&self) -> HandForces {
        let handle = self.handle();
        let (mut fingers, mut wrist_world) = ([0.0; 2], Vec3::zeros());
        for contact in &self.report().contacts {
            for (collider, sign) in [(contact.a, 1.0), (contact.b, -1.0)] {
                let Owner::Body(body) = self.model().collider(collider).owner else { continue };
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
        Some(World::fruit_bruise(self, fruit as usize).peak_impact_energy)
    }

    fn bruise_volume(&self, fruit: u32) -> Option<f64> {
        World::fruit_bruise(self, fruit as usize).volume(&self.spec().fruit)
    }

    fn breaks_at_union(&self, segment: u32) -> bool {
        self.tree().union_fails[segment as usize]
    }

    fn quarantine(&self) -> Option<String> {
        match self.status() {
            Status::Running => None,
            Status::Quarantined { frame, reason } => Some(format!("frame {frame}: {reason}")),
        }
    }
}

/// A controller whose event log is read incrementally.
pub struct Recorded<C> {
    controller: C,
    events_read: usize,
    images_read: usize,
}

impl<C: Controller> Recorded<C> {
    /// Wraps a controller at the start of an episode.
    pub fn new(controller: C) -> Self {
        Self { controller, events_read: 0, images_read: 0 }
    }
}

impl<C: Controller> BenchController for Recorded<C> {
    fn act(&mut self, observation: &Observation) -> Command {
        self.controller.act(observation)
    }

    fn drain_log(&mut self) -> Vec<ControllerEvent> {
        let record = self.controller.record();
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
        Event::Grasped { width, .. } => ControllerEvent::Grasped { width: *width },
        Event::Yielded { force, .. } => ControllerEvent::Yielded { force: *force },
        Event::StemGaveWay { pull, .. } => ControllerEvent::StemGaveWay { pull: *pull },
    }
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
}
