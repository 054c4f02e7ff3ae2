//! Contact attempts of whole episodes on a tuning seed: they agree with the events of the world, and what a controller declares does not
//! change them.

use std::sync::atomic::AtomicBool;

use orchard_picker::Controller;
use orchard_robot::io::{Command, Observation};
use orchard_scenario::Scenario;
use orchard_tasks::harvest::adapter::Recorded;
use orchard_tasks::harvest::episode::{AttemptOutcome, ContactOutcome, EpisodeRecord};
use orchard_tasks::harvest::interface::{BenchController, ControllerEvent};
use orchard_tasks::harvest::{run_episode, trial};
use orchard_tasks::protocol::Protocol;

/// A tuning seed: the expert is known to pick here.
const SEED: u64 = 20250704;
const SECONDS: f64 = 30.0;

/// A controller that declares no attempt.
struct Undeclared(Recorded<Box<dyn Controller>>);

impl BenchController for Undeclared {
    fn act(&mut self, observation: &Observation) -> Command {
        self.0.act(observation)
    }

    fn run_ends_at(&mut self, time: f64) {
        self.0.run_ends_at(time);
    }

    fn drain_log(&mut self) -> Vec<ControllerEvent> {
        let mut log = self.0.drain_log();
        log.retain(|event| matches!(event, ControllerEvent::Detected { .. }));
        log
    }
}

fn undeclared(scenario: &Scenario, like: &EpisodeRecord) -> EpisodeRecord {
    let mut world = scenario.world(SEED, 0, 0).unwrap();
    let mut controller = Undeclared(Recorded::new(scenario.controller()));
    let (key, frame, never) = (like.key.clone(), scenario.spec().sim.frame(), AtomicBool::new(false));
    run_episode(key, &mut world, &mut controller, &Protocol::paper(), frame, &never, &mut || ()).unwrap()
}

#[test]
fn an_episode_has_the_same_contact_attempts_whatever_its_controller_declares() {
    let scenario = Scenario::of(&[("controller", "expert")]).unwrap();
    let record = trial(&scenario, SEED, 0, SECONDS).unwrap();
    println!("{:#?}", record.contact_attempts);
    let placed: Vec<u32> = record.placed_by_contact().map(|a| a.fruit).collect();
    assert!(!placed.is_empty(), "nothing was placed");

    // Every deposit of a fruit that the fingers touched belongs to exactly one contact attempt; each of these has a deposit.
    for fruit in &record.fruit {
        let deposited = record.fruit_deposited.iter().any(|e| e.fruit == fruit.id);
        let touched = record.contact_attempts.iter().any(|a| a.fruit == fruit.id && a.detached);
        let count = placed.iter().filter(|id| **id == fruit.id).count();
        assert_eq!(count, usize::from(deposited && touched), "fruit {}", fruit.id);
    }
    // What a declared attempt placed, a contact attempt placed.
    let declared = record.attempts.iter().filter(|a| a.outcome == AttemptOutcome::Placed);
    for fruit in declared.flat_map(|a| &a.placed) {
        assert!(placed.contains(fruit), "fruit {fruit}");
    }
    for attempt in &record.contact_attempts {
        let detached = record.fruit_detached.iter().any(|e| e.fruit == attempt.fruit);
        assert!(detached || !attempt.detached, "{attempt:?}");
        assert!(attempt.outcome != ContactOutcome::LeftOnTree || !attempt.detached, "{attempt:?}");
    }

    let silent = undeclared(&scenario, &record);
    assert!(silent.attempts.is_empty());
    assert_eq!(silent.contact_attempts, record.contact_attempts);
    assert_eq!(silent.fruit_deposited, record.fruit_deposited);
    // Picked fruit is not knocked off because nobody said that it would be picked.
    assert_eq!(silent.fruit_knocked_off, record.fruit_knocked_off);
    assert!(silent.fruit_knocked_off.len() < silent.fruit_detached.len());
}

/// In a run that ends before an attempt would, the expert begins none; the baseline, which pays no heed to it, does.
#[test]
fn the_expert_begins_nothing_that_the_end_would_cut_off() {
    let attempts = |controller: &str| {
        let scenario = Scenario::of(&[("controller", controller)]).unwrap();
        trial(&scenario, SEED, 0, 6.0).unwrap().attempts.len()
    };
    assert_eq!(attempts("expert"), 0);
    assert!(attempts("baseline") > 0);
}
