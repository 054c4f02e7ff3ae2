//! One trial: a world and a controller with a goal, frame by frame.

use std::sync::atomic::{AtomicBool, Ordering};

use orchard_geometry::Vec3;
use orchard_picker::{AttemptEnd, Controller, Event};
use orchard_world::{Status, World, WorldEvent};
use serde::{Deserialize, Serialize};

use crate::component::record::{TrialOutcome, TrialRecord};
use crate::component::rules::ComponentRules;
use crate::component::task::Component;
use crate::harvest::adapter::Simulated;
use crate::harvest::interface::GaveUp;
use crate::protocol::Protocol;
use crate::stall::StallWatch;

/// Watches a trial frame by frame: when its target is met, what the robot broke, and how far the tool went.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct TrialWatch<C: Component> {
    target: C::Target,
    /// Longest trial, and time for which the target must be met \[frames\].
    frames: u32,
    needed: u32,
    /// Frames for which it has been met without a break.
    met: u32,
    p_world_tcp: Vec3,
    path: f64,
    snapped: u32,
    knocked_off: u32,
}

impl<C: Component> TrialWatch<C> {
    /// Watches a trial of a world at its start.
    pub fn new(world: &World, target: &C::Target, rules: &ComponentRules) -> Self {
        let frame = world.spec().sim.frame();
        Self {
            target: target.clone(),
            frames: (C::time(rules) / frame).round() as u32,
            needed: C::hold_frames(rules, frame),
            met: 0,
            p_world_tcp: p_world_tcp(world),
            path: 0.0,
            snapped: 0,
            knocked_off: 0,
        }
    }

    /// The target.
    pub fn target(&self) -> &C::Target {
        &self.target
    }

    /// Number of frames after which the trial may have ended, at the earliest, if nothing touches wood or fruit in them; at least 1.
    pub fn frames_left(&self, world: &World, rules: &ComponentRules) -> u32 {
        let frame = world.spec().sim.frame();
        let to_meet = if self.met > 0 { 0 } else { C::frames_to_meet(world, &self.target, rules, frame) };
        let met = to_meet.saturating_sub(1).saturating_add(self.needed - self.met.min(self.needed));
        self.frames.saturating_sub(world.frame()).min(met).max(1)
    }

    /// Adds a frame with its events; returns how the trial ends with it, `None` if it goes on.
    pub fn after_step(
        &mut self,
        world: &World,
        events: &[WorldEvent],
        rules: &ComponentRules,
    ) -> Option<TrialOutcome> {
        for event in events {
            match event {
                WorldEvent::BranchSnapped { .. } => self.snapped += 1,
                WorldEvent::FruitDetached { fruit, .. } => {
                    self.knocked_off += u32::from(C::named_fruit(&self.target) != Some(*fruit as u32));
                }
                _ => {}
            }
        }
        if let Status::Quarantined { frame, reason } = world.status() {
            return Some(TrialOutcome::Quarantined { reason: format!("frame {frame}: {reason}") });
        }
        let p_now = p_world_tcp(world);
        self.path += (p_now - self.p_world_tcp).norm();
        self.p_world_tcp = p_now;
        self.met = if C::is_met(world, &self.target, rules) { self.met + 1 } else { 0 };
        if self.met >= self.needed {
            return Some(TrialOutcome::Success);
        }
        (world.frame() >= self.frames).then_some(TrialOutcome::TimeOver)
    }
}

fn p_world_tcp(world: &World) -> Vec3 {
    world.handle().x_world_tcp(world.data()).translation.vector
}

/// Runs a trial from the world's start; `None` if `stop` was raised before its end. `on_frame` is called after every frame.
pub(super) fn run_trial<C: Component>(
    simulated: &mut impl Simulated,
    controller: &mut dyn Controller,
    target: &C::Target,
    protocol: &Protocol,
    stop: &AtomicBool,
    on_frame: &mut dyn FnMut(),
) -> Option<TrialRecord<C::Target>> {
    let rules: &ComponentRules = &protocol.component;
    let frame = simulated.world().spec().sim.frame();
    let mut stall = StallWatch::new(&protocol.rules, frame);
    let mut watch = TrialWatch::<C>::new(simulated.world(), target, rules);
    let ended = loop {
        let observation = simulated.world_mut().observe();
        if stall.stalled(&observation) {
            break TrialOutcome::Stalled;
        }
        let command = controller.act(&observation);
        // After the controller, which may raise the flag when it fails: then its command is none.
        if stop.load(Ordering::Relaxed) {
            return None;
        }
        simulated.advance(&command);
        on_frame();
        let world = simulated.world_mut();
        let events = world.drain_events();
        if let Some(ended) = watch.after_step(world, &events, rules) {
            break ended;
        }
    };
    let world = simulated.world();
    let load = world.wood_load();
    // The figures of a quarantined world are invalid, and JSON has no NaN.
    let number = |x: f64| if x.is_finite() { x } else { 0.0 };
    let events = &controller.record().events;
    Some(TrialRecord {
        target: target.clone(),
        ended,
        duration_s: f64::from(world.frame()) * frame,
        frames: world.frame(),
        path_m: number(watch.path),
        contact_impulse_n_s: number(load.contact_impulse),
        peak_contact_force_n: number(load.peak_contact_force),
        peak_moment_ratio: number(load.peak_ratio),
        peak_moment_excess: number(load.peak_excess),
        moment_excess_s: number(load.excess_integral),
        branches_snapped: watch.snapped,
        fruit_knocked_off: watch.knocked_off,
        attempts: events.iter().filter(|e| matches!(e, Event::AttemptStarted { .. })).count() as u32,
        failures: events.iter().filter_map(failure).collect(),
        gave_up: events.iter().find_map(gave_up),
    })
}

fn gave_up(event: &Event) -> Option<GaveUp> {
    match *event {
        Event::GaveUp { time, fault } => Some(GaveUp { time, fault: name(&fault)? }),
        _ => None,
    }
}

fn failure(event: &Event) -> Option<String> {
    match event {
        Event::AttemptEnded { end: AttemptEnd::Failed(reason), .. } => name(reason),
        _ => None,
    }
}

/// The serialised name of a reason.
fn name(reason: &impl Serialize) -> Option<String> {
    serde_json::to_value(reason).ok()?.as_str().map(str::to_owned)
}
