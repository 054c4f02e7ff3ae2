//! `Reach-v1`: the benchmark's reach-and-grasp as an episode to learn in, one named fruit an episode.

use orchard_tasks::component::{
    Component, ComponentRules, FruitTarget, ReachAndGrasp, TrialOutcome, TrialWatch,
};
use orchard_world::{World, WorldEvent};
use serde::{Deserialize, Serialize};

use crate::harvest::p_world_tcp;
use crate::interface::Term;
use crate::report::{Ending, TERMS};
use crate::rules::ReachReward;

/// A reach under way.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Reach {
    watch: TrialWatch<ReachAndGrasp>,
    held: bool,
    gripped: bool,
    /// Of the present step: true if the named fruit was gripped for the first time, and the distance at its begin \[m\].
    grips: bool,
    distance: f64,
}

pub(crate) fn terms(rules: &ReachReward) -> Vec<Term> {
    let term = |name, weight: &orchard_quantity::Quantity| Term { name, weight: weight.si() };
    vec![
        term("success", &rules.success),
        term("grip", &rules.grip),
        term("approach", &rules.approach),
        term("damage", &rules.damage),
    ]
}

impl Reach {
    /// The episode of a world's first target; `None` if it has none.
    pub fn new(world: &World, rules: &ComponentRules, seed: u64) -> Option<Self> {
        let target = ReachAndGrasp::targets(world, rules, seed).into_iter().next()?;
        let watch = TrialWatch::new(world, &target, rules);
        Some(Self { watch, held: false, gripped: false, grips: false, distance: 0.0 })
    }

    /// What the target's centre (odom) and radius are told to be \[m\].
    pub fn told(&self) -> [f64; 4] {
        let [x, y, z] = self.watch.target().p_odom_told;
        [x, y, z, self.watch.target().radius_told]
    }

    /// The target.
    pub fn target(&self) -> &FruitTarget {
        self.watch.target()
    }

    pub fn begin_step(&mut self, world: &World) {
        self.grips = false;
        self.distance = self.distance_now(world);
    }

    /// Adds a frame with its events; returns how the episode ends with it, if it does.
    pub fn after_frame(
        &mut self,
        world: &World,
        events: &[WorldEvent],
        rules: &ComponentRules,
    ) -> Option<Ending> {
        let named = ReachAndGrasp::named_fruit(self.watch.target());
        let grips = |e: &WorldEvent| matches!(e, WorldEvent::FruitGripped { fruit, .. } if Some(*fruit as u32) == named);
        if events.iter().any(grips) {
            self.grips |= !self.gripped;
            self.gripped = true;
        }
        self.watch.after_step(world, events, rules).map(|outcome| match outcome {
            TrialOutcome::Success => {
                self.held = true;
                Ending { outcome: "success", terminated: true, success: true }
            }
            TrialOutcome::TimeOver => Ending::TIME_OVER,
            TrialOutcome::Stalled => Ending::STALLED,
            TrialOutcome::Quarantined { .. } => Ending::QUARANTINED,
        })
    }

    /// Terms of the step, unweighted, in the order of [`terms`], but for the damage.
    pub fn end_step(&self, world: &World) -> [f64; TERMS] {
        let approach = self.distance - self.distance_now(world);
        [f64::from(u8::from(self.held)), f64::from(u8::from(self.grips)), approach, 0.0, 0.0, 0.0]
    }

    /// 1 if the named fruit was held for the task's time.
    pub fn completeness(&self) -> f64 {
        f64::from(u8::from(self.held))
    }

    /// True if the state fits a world.
    pub fn fits(&self, world: &World) -> bool {
        (self.watch.target().fruit as usize) < world.fruit().len()
    }

    /// From the tool point to where the named fruit hung at the start \[m\].
    fn distance_now(&self, world: &World) -> f64 {
        let [x, y, z] = self.watch.target().p_world;
        (orchard_geometry::Vec3::new(x, y, z) - p_world_tcp(world)).norm()
    }
}
