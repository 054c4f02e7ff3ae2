//! One trial: a world and a controller with a goal, frame by frame.

use std::sync::atomic::{AtomicBool, Ordering};

use orchard_picker::{AttemptEnd, Controller, Event};
use orchard_world::{Status, World, WorldEvent};

use crate::component::record::{TrialOutcome, TrialRecord};
use crate::component::rules::ComponentRules;
use crate::component::task::Component;
use crate::protocol::Protocol;
use crate::stall::StallWatch;

/// Runs a trial from the world's start; `None` if `stop` was raised before its end. `on_frame` is called after every frame.
pub(super) fn run_trial<C: Component>(
    world: &mut World,
    controller: &mut dyn Controller,
    target: &C::Target,
    protocol: &Protocol,
    stop: &AtomicBool,
    on_frame: &mut dyn FnMut(),
) -> Option<TrialRecord<C::Target>> {
    let rules: &ComponentRules = &protocol.component;
    let frame = world.spec().sim.frame();
    let frames = (C::time(rules) / frame).round() as u32;
    let needed = C::hold_frames(rules, frame);
    let mut stall = StallWatch::new(&protocol.rules, frame);
    let p_world_tcp = |world: &World| world.handle().x_world_tcp(world.data()).translation.vector;
    let (mut p_tcp, mut path, mut met) = (p_world_tcp(world), 0.0, 0);
    let (mut snapped, mut knocked_off) = (0, 0);
    let mut ended = None;
    while ended.is_none() {
        if stop.load(Ordering::Relaxed) {
            return None;
        }
        let observation = world.observe();
        if stall.stalled(&observation) {
            ended = Some(TrialOutcome::Stalled);
            break;
        }
        let command = controller.act(&observation);
        world.step(&command);
        on_frame();
        for event in world.drain_events() {
            match event {
                WorldEvent::BranchSnapped { .. } => snapped += 1,
                WorldEvent::FruitDetached { fruit, .. } => {
                    knocked_off += u32::from(C::named_fruit(target) != Some(fruit as u32));
                }
                _ => {}
            }
        }
        if let Status::Quarantined { frame, reason } = world.status() {
            ended = Some(TrialOutcome::Quarantined { reason: format!("frame {frame}: {reason}") });
            break;
        }
        let p_now = p_world_tcp(world);
        path += (p_now - p_tcp).norm();
        p_tcp = p_now;
        met = if C::is_met(world, target, rules) { met + 1 } else { 0 };
        if met >= needed {
            ended = Some(TrialOutcome::Success);
        } else if world.frame() >= frames {
            ended = Some(TrialOutcome::TimeOver);
        }
    }
    let load = world.wood_load();
    // The figures of a quarantined world are invalid, and JSON has no NaN.
    let number = |x: f64| if x.is_finite() { x } else { 0.0 };
    let events = &controller.record().events;
    Some(TrialRecord {
        target: target.clone(),
        ended: ended.unwrap_or(TrialOutcome::TimeOver),
        duration_s: f64::from(world.frame()) * frame,
        frames: world.frame(),
        path_m: number(path),
        contact_impulse_n_s: number(load.contact_impulse),
        peak_contact_force_n: number(load.peak_contact_force),
        peak_moment_ratio: number(load.peak_ratio),
        peak_moment_excess: number(load.peak_excess),
        moment_excess_s: number(load.excess_integral),
        branches_snapped: snapped,
        fruit_knocked_off: knocked_off,
        attempts: events.iter().filter(|e| matches!(e, Event::AttemptStarted { .. })).count() as u32,
        failures: events.iter().filter_map(failure).collect(),
    })
}

fn failure(event: &Event) -> Option<String> {
    match event {
        Event::AttemptEnded { end: AttemptEnd::Failed(reason), .. } => {
            serde_json::to_value(reason).ok().and_then(|value| value.as_str().map(str::to_owned))
        }
        _ => None,
    }
}
