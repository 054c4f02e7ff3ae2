//! Second run of an episode: snapshots of the requested moments, and causes of events.

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::atomic::AtomicBool;

use indicatif::{ProgressBar, ProgressStyle};
use orchard_geometry::{Pose, Vec3, inverse_transform};
use orchard_robot::{Command, Observation};
use orchard_tasks::harvest::episode::EpisodeRecord;
use orchard_tasks::harvest::interface::{
    BenchController, BenchWorld, ControllerEvent, FruitTruth, HandForces, VisibleFruit,
};
use orchard_tasks::harvest::{WorldFactory, run_episode};
use orchard_world::{World, WorldEvent};

use super::input::Input;
use super::touch::ContactHistory;
use crate::failure::Failure;

/// Results of the second run.
pub struct Replay {
    /// Record of the second run.
    pub record: EpisodeRecord,
    /// The requested moments, in the order of time.
    pub shots: Vec<Shot>,
    /// Events with their causes from the contacts, in the order of time.
    pub causes: Vec<Cause>,
}

/// A world at one moment.
pub struct Shot {
    /// Frame.
    pub frame: u32,
    /// The world.
    pub world: World,
    /// Detections of the last image \[m, odom\].
    pub p_odom_detected: Vec<Vec3>,
}

/// The likely cause of an event.
pub struct Cause {
    /// The event.
    pub of: CausedEvent,
    /// Frame.
    pub frame: u32,
    /// Description of the robot's contacts in the half second before.
    pub text: String,
}

/// An event whose cause is described.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CausedEvent {
    /// The end of an attempt, at a target fruit if there was one.
    End {
        /// Attempt.
        attempt: u32,
        /// Target fruit of the attempt.
        fruit: Option<u32>,
    },
    /// A branch at the base of a segment.
    Branch(u32),
    /// A fruit off its stem.
    Stem(u32),
}

/// Simulates the episode of a record again and stores the world at some frames, given in ascending order.
pub fn replay(input: &Input, frames: &[u32]) -> Result<Replay, Failure> {
    let key = input.record.key.clone();
    let plan_frame = input.harvest.frame();
    let (world, controller) = match input.harvest.build(&key) {
        Ok(built) => built,
        Err(reason) => return Err(Failure::Failed(format!("the world cannot be built: {reason}"))),
    };
    let detected = Rc::new(RefCell::new(Vec::new()));
    let mut watched = ReplayedWorld {
        world,
        frames: frames.to_vec(),
        shots: Vec::new(),
        causes: Vec::new(),
        memory: ContactHistory::default(),
        ends: input.record.attempts.iter().map(|a| (a.end_frame, a.id, a.fruit)).collect(),
        detected: detected.clone(),
    };
    watched.keep();
    let mut controller = DetectionTap { controller, detected };
    let bar = ProgressBar::new(u64::from(input.record.frames)).with_style(
        ProgressStyle::with_template("{bar:30} {percent:>3} %  second run (about {eta} left)")
            .unwrap_or_else(|_| ProgressStyle::default_bar()),
    );
    let (protocol, never) = (input.harvest.protocol().clone(), AtomicBool::new(false));
    let mut on_frame = || bar.inc(1);
    let record =
        run_episode(key, &mut watched, &mut controller, &protocol, plan_frame, &never, &mut on_frame);
    bar.finish_and_clear();
    let record = record.ok_or_else(|| Failure::Failed("the second run did not end".to_owned()))?;
    Ok(Replay { record, shots: watched.shots, causes: watched.causes })
}

/// The first difference between the record and the second run, if any.
pub fn difference(record: &EpisodeRecord, again: &EpisodeRecord) -> Option<String> {
    if record == again {
        return None;
    }
    let first = |what: &str, differs: bool| differs.then(|| format!("{what} differ"));
    first("frames or outcome", (record.frames, &record.outcome) != (again.frames, &again.outcome))
        .or_else(|| first("branches snapped", record.branches_snapped != again.branches_snapped))
        .or_else(|| first("fruit detached", record.fruit_detached != again.fruit_detached))
        .or_else(|| first("fruit deposited", record.fruit_deposited != again.fruit_deposited))
        .or_else(|| first("fruit dropped", record.fruit_dropped != again.fruit_dropped))
        .or_else(|| first("seals lost", record.seals_lost != again.seals_lost))
        .or_else(|| first("fruit taken away", record.fruit_taken_away != again.fruit_taken_away))
        .or_else(|| first("contact attempts", record.contact_attempts != again.contact_attempts))
        .or_else(|| {
            let pairs = record.attempts.iter().zip(&again.attempts);
            let attempt = pairs.clone().position(|(a, b)| a != b);
            attempt.map(|id| format!("attempt {id} differs"))
        })
        .or_else(|| first("the numbers of attempts", record.attempts.len() != again.attempts.len()))
        .or_else(|| Some("fruit, zones, detections or forces differ".to_owned()))
}

/// A world that records snapshots and causes while it runs.
struct ReplayedWorld {
    world: World,
    frames: Vec<u32>,
    shots: Vec<Shot>,
    causes: Vec<Cause>,
    memory: ContactHistory,
    /// Ends of attempts: frame, attempt, target fruit.
    ends: Vec<(u32, u32, Option<u32>)>,
    detected: Rc<RefCell<Vec<Vec3>>>,
}

impl ReplayedWorld {
    /// Stores a snapshot if the current frame is requested.
    fn keep(&mut self) {
        let frame = self.world.frame();
        if self.frames.binary_search(&frame).is_ok() {
            let p_odom_detected = self.detected.borrow().clone();
            self.shots.push(Shot { frame, world: self.world.clone(), p_odom_detected });
        }
    }
}

impl ReplayedWorld {
    /// Records the contacts on the robot at an attempt's end, and the position of the target fruit.
    fn explain_end(&mut self) {
        let frame = self.world.frame();
        for &(_, attempt, fruit) in self.ends.iter().filter(|end| end.0 == frame) {
            let mut text = self.memory.on_robot();
            let truth = self.world.fruit_truth();
            if let Some(fruit) = fruit.and_then(|id| truth.get(id as usize)) {
                // In the hand's frame, z is the approach axis and y the fingers' axis of motion.
                let x_world_tcp = self.world.handle().x_world_tcp(self.world.data());
                let p = inverse_transform(&x_world_tcp, &fruit.p_world) * 1e3;
                text += &format!(
                    "; position of the fruit from the point between the fingers: {:.0} mm ahead, {:.0} mm along and {:.0} mm across the fingers' motion",
                    p.z, p.y, p.x
                );
            }
            self.causes.push(Cause { of: CausedEvent::End { attempt, fruit }, frame, text });
        }
    }
}

impl BenchWorld for ReplayedWorld {
    fn observe(&mut self) -> Observation {
        self.world.observe()
    }

    fn step(&mut self, command: &Command) {
        self.world.step(command);
        self.memory.note(&self.world);
        self.keep();
        self.explain_end();
    }

    fn drain_events(&mut self) -> Vec<WorldEvent> {
        let events = BenchWorld::drain_events(&mut self.world);
        let frame = self.world.frame();
        for event in &events {
            let (of, text) = match *event {
                WorldEvent::BranchSnapped { segment, .. } => {
                    (CausedEvent::Branch(segment as u32), self.memory.on_limb(&self.world, segment))
                }
                WorldEvent::FruitDetached { fruit, .. } => {
                    (CausedEvent::Stem(fruit as u32), self.memory.on_fruit(&self.world, fruit))
                }
                _ => continue,
            };
            self.causes.push(Cause { of, frame, text });
        }
        events
    }

    fn fruit(&self) -> Vec<FruitTruth> {
        self.world.fruit_truth()
    }

    fn visible_fruit(&self) -> Vec<VisibleFruit> {
        self.world.visible_fruit()
    }

    fn x_world_odom(&self) -> Pose {
        self.world.x_world_odom()
    }

    fn reachable(&self) -> Vec<bool> {
        self.world.reachable()
    }

    fn reachable_ik_count(&self) -> Option<u32> {
        BenchWorld::reachable_ik_count(&self.world)
    }

    fn peak_stem_pull(&self) -> f64 {
        self.world.peak_stem_pull()
    }

    fn hand_forces(&self) -> HandForces {
        self.world.hand_forces()
    }

    fn fruit_bruise(&self, fruit: u32) -> Option<f64> {
        BenchWorld::fruit_bruise(&self.world, fruit)
    }

    fn bruise_volume(&self, fruit: u32) -> Option<f64> {
        self.world.bruise_volume(fruit)
    }

    fn stem_strength(&self, fruit: u32) -> Option<f64> {
        self.world.stem_strength(fruit)
    }

    fn breaks_at_union(&self, segment: u32) -> bool {
        BenchWorld::breaks_at_union(&self.world, segment)
    }

    fn quarantine(&self) -> Option<String> {
        self.world.quarantine()
    }
}

/// Wraps a controller and copies its detections to `detected`.
struct DetectionTap<C> {
    controller: C,
    detected: Rc<RefCell<Vec<Vec3>>>,
}

impl<C: BenchController> BenchController for DetectionTap<C> {
    fn act(&mut self, observation: &Observation) -> Command {
        self.controller.act(observation)
    }

    fn run_ends_at(&mut self, time: f64) {
        self.controller.run_ends_at(time);
    }

    fn drain_log(&mut self) -> Vec<ControllerEvent> {
        let log = self.controller.drain_log();
        for event in &log {
            if let ControllerEvent::Detected { p_odom, .. } = event {
                self.detected.borrow_mut().clone_from(p_odom);
            }
        }
        log
    }
}
