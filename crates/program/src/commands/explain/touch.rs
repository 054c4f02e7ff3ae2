//! Contacts of the robot with wood and fruit over the last frames, as causes of events.

use std::collections::VecDeque;

use orchard_geometry::Vec3;
use orchard_multibody::{BodyId, Owner};
use orchard_world::World;

/// Longest delay between a push and its effect \[frames\]: half a second.
const MEMORY: usize = 30;

/// Object that the robot touches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ContactPartner {
    Wood(usize),
    Fruit(usize),
}

/// A contact of the robot at the end of a frame.
#[derive(Debug, Clone, PartialEq)]
struct RobotContact {
    part: String,
    touched: ContactPartner,
    force: f64,
}

/// A stem that pulled while a finger was on its fruit.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Pull {
    fruit: usize,
    tension: f64,
}

/// Contacts and pulls of the last frames.
#[derive(Debug, Default)]
pub struct ContactHistory {
    frames: VecDeque<(Vec<RobotContact>, Vec<Pull>)>,
}

impl ContactHistory {
    /// Records the contacts at the end of a frame.
    pub fn note(&mut self, world: &World) {
        let touches = touches(world);
        let mut pulls: Vec<Pull> = Vec::new();
        for touch in &touches {
            let ContactPartner::Fruit(fruit) = touch.touched else { continue };
            if pulls.iter().all(|pull| pull.fruit != fruit) {
                let point = world.fruit().points[fruit];
                let tension = world.data().tether_spring_force(world.model(), point).norm();
                pulls.push(Pull { fruit, tension });
            }
        }
        self.frames.push_back((touches, pulls));
        while self.frames.len() > MEMORY {
            self.frames.pop_front();
        }
    }

    /// Robot contacts with the limb from a segment outwards, the largest force first.
    pub fn on_limb(&self, world: &World, segment: usize) -> String {
        let limb = world.tree().subtree(segment);
        let hangs = |fruit: usize| limb.contains(&world.fruit().fruit[fruit].segment);
        let mut causes: Vec<(f64, String)> = Vec::new();
        for (touches, pulls) in &self.frames {
            for touch in touches {
                let text = match touch.touched {
                    ContactPartner::Wood(wood) if limb.contains(&wood) => {
                        format!("{} on segment {wood}", touch.part)
                    }
                    _ => continue,
                };
                keep_larger(&mut causes, touch.force, text);
            }
            for pull in pulls.iter().filter(|pull| hangs(pull.fruit)) {
                keep_larger(&mut causes, pull.tension, format!("the stem of touched fruit {}", pull.fruit));
            }
        }
        describe(causes, "the robot did not touch the limb; it broke under its load or its swing")
    }

    /// Objects that pressed on the robot, the largest force first.
    pub fn on_robot(&self) -> String {
        let mut causes: Vec<(f64, String)> = Vec::new();
        for touch in self.frames.iter().flat_map(|(touches, _)| touches) {
            let text = match touch.touched {
                ContactPartner::Wood(wood) => format!("{} on segment {wood}", touch.part),
                ContactPartner::Fruit(fruit) => format!("{} on fruit {fruit}", touch.part),
            };
            keep_larger(&mut causes, touch.force, text);
        }
        describe(causes, "the robot touched nothing")
    }

    /// Robot contacts with a fruit and its branch, the largest force first.
    pub fn on_fruit(&self, world: &World, fruit: usize) -> String {
        let mut causes: Vec<(f64, String)> = Vec::new();
        for (touches, _) in &self.frames {
            for touch in touches.iter().filter(|touch| touch.touched == ContactPartner::Fruit(fruit)) {
                keep_larger(&mut causes, touch.force, format!("{} on it", touch.part));
            }
        }
        if causes.is_empty() {
            // The branch: the segment of the fruit and all segments between it and the trunk's base.
            let mut bearing = Some(world.fruit().fruit[fruit].segment);
            let mut limb = Vec::new();
            while let Some(segment) = bearing {
                limb.push(segment);
                bearing = world.tree().parent[segment];
            }
            for (touches, _) in &self.frames {
                for touch in touches {
                    let ContactPartner::Wood(wood) = touch.touched else { continue };
                    if limb.contains(&wood) {
                        keep_larger(
                            &mut causes,
                            touch.force,
                            format!("{} on its branch (segment {wood})", touch.part),
                        );
                    }
                }
            }
        }
        describe(causes, "the robot touched neither the fruit nor its branch: it was shaken off")
    }
}

fn keep_larger(causes: &mut Vec<(f64, String)>, force: f64, text: String) {
    match causes.iter_mut().find(|(_, known)| *known == text) {
        Some(known) => known.0 = known.0.max(force),
        None => causes.push((force, text)),
    }
}

/// The three largest forces as text, or `none`.
fn describe(mut causes: Vec<(f64, String)>, none: &str) -> String {
    causes.retain(|(force, _)| *force > 0.0);
    causes.sort_by(|a, b| b.0.total_cmp(&a.0).then_with(|| a.1.cmp(&b.1)));
    if causes.is_empty() {
        return none.to_owned();
    }
    let list: Vec<String> =
        causes.iter().take(3).map(|(force, text)| format!("{text} {force:.0} N")).collect();
    list.join(", ")
}

/// Contacts of the robot with wood and fruit; forces between the same two objects are added.
fn touches(world: &World) -> Vec<RobotContact> {
    let model = world.model();
    let mut found: Vec<(BodyId, ContactPartner, Vec3)> = Vec::new();
    for contact in &world.report().contacts {
        for (one, other) in [(contact.a, contact.b), (contact.b, contact.a)] {
            let Owner::Body(body) = model.collider(one).owner else { continue };
            if !world.handle().bodies.contains(&body) || contact.force_world == Vec3::zeros() {
                continue;
            }
            let touched = match model.collider(other).owner {
                Owner::Point(point) => {
                    world.fruit().points.iter().position(|p| *p == point).map(ContactPartner::Fruit)
                }
                Owner::Body(wood) => {
                    world.tree().bodies.iter().position(|b| *b == wood).map(ContactPartner::Wood)
                }
                Owner::World => None,
            };
            let Some(touched) = touched else { continue };
            match found.iter_mut().find(|(b, t, _)| *b == body && *t == touched) {
                Some((.., force)) => *force += contact.force_world,
                None => found.push((body, touched, contact.force_world)),
            }
        }
    }
    let named = |(body, touched, force): (BodyId, ContactPartner, Vec3)| RobotContact {
        part: part(world, body),
        touched,
        force: force.norm(),
    };
    found.into_iter().map(named).collect()
}

/// Name of a part of the robot.
fn part(world: &World, body: BodyId) -> String {
    let handle = world.handle();
    if handle.fingers.iter().any(|finger| finger.has(body)) {
        return "a finger".to_owned();
    }
    if body == handle.wrist() {
        return "the hand".to_owned();
    }
    match handle.arm.iter().position(|link| *link == body) {
        Some(link) => format!("arm link {}", link + 1),
        None => "chassis or bucket".to_owned(),
    }
}
