//! `Reach-v1` and `Gentle-v1`: a component task of the benchmark as an episode to learn in, one target an episode.

use orchard_geometry::Vec3;
use orchard_tasks::component::{
    Component, ComponentRules, FruitTarget, Gentle, PointTarget, ReachAndGrasp, TrialOutcome, TrialWatch,
};
use orchard_world::{World, WorldEvent};
use serde::{Deserialize, Serialize};

use crate::harvest::p_world_tcp;
use crate::interface::{Term, term};
use crate::report::{Ending, TERMS};
use crate::rules::LearningRules;

/// A component task that can be learned.
pub(crate) trait Learnable: Component {
    /// The terms of its reward.
    fn terms(rules: &LearningRules) -> Vec<Term>;
    /// The terms of a step, unweighted, in that order, but for the damage.
    fn values(step: &Step) -> [f64; TERMS];
    /// Place of the target at the start.
    fn p_world(target: &Self::Target) -> [f64; 3];
    /// Target as it is told, as in `orchard_policy::Reading::target`.
    fn told(target: &Self::Target) -> [f64; 4];
}

/// Measures of a step, from which the terms of its reward follow.
pub(crate) struct Step {
    /// 1 if the target was met for the task's time.
    success: f64,
    /// 1 if the named fruit was gripped for the first time.
    grip: f64,
    /// Way of the tool towards the target \[m\].
    approach: f64,
    /// Impulse of the robot's contacts with wood \[N s\].
    impulse: f64,
}

/// A trial under way.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(bound = "")]
pub(crate) struct Trial<C: Learnable> {
    watch: TrialWatch<C>,
    met: bool,
    gripped: bool,
    /// Of the present step: true if the named fruit was gripped for the first time; distance \[m\] and impulse \[N s\] at its begin.
    grips: bool,
    distance: f64,
    impulse: f64,
}

impl<C: Learnable> Trial<C> {
    /// The episode of a world's first target; `None` if it has none.
    pub fn new(world: &World, rules: &ComponentRules, seed: u64) -> Option<Self> {
        let target = C::targets(world, rules, seed).into_iter().next()?;
        let watch = TrialWatch::new(world, &target, rules);
        Some(Self { watch, met: false, gripped: false, grips: false, distance: 0.0, impulse: 0.0 })
    }

    /// The target.
    pub fn target(&self) -> &C::Target {
        self.watch.target()
    }

    pub fn begin_step(&mut self, world: &World) {
        self.grips = false;
        self.distance = self.distance_now(world);
        self.impulse = world.wood_load().contact_impulse;
    }

    /// Adds a frame with its events; returns how the episode ends with it, if it does.
    pub fn after_frame(
        &mut self,
        world: &World,
        events: &[WorldEvent],
        rules: &ComponentRules,
    ) -> Option<Ending> {
        let named = C::named_fruit(self.target());
        let grips = |e: &WorldEvent| matches!(e, WorldEvent::FruitGripped { fruit, .. } if Some(*fruit as u32) == named);
        if events.iter().any(grips) {
            self.grips |= !self.gripped;
            self.gripped = true;
        }
        self.watch.after_step(world, events, rules).map(|outcome| match outcome {
            TrialOutcome::Success => {
                self.met = true;
                Ending { outcome: "success", terminated: true, success: true }
            }
            TrialOutcome::TimeOver => Ending::TIME_OVER,
            TrialOutcome::Stalled => Ending::STALLED,
            TrialOutcome::Quarantined { .. } => Ending::QUARANTINED,
        })
    }

    /// As [`TrialWatch::frames_left`].
    pub fn frames_left(&self, world: &World, rules: &ComponentRules) -> u32 {
        self.watch.frames_left(world, rules)
    }

    /// Terms of the step, unweighted, but for the damage.
    pub fn end_step(&self, world: &World) -> [f64; TERMS] {
        C::values(&Step {
            success: self.completeness(),
            grip: f64::from(u8::from(self.grips)),
            approach: self.distance - self.distance_now(world),
            impulse: world.wood_load().contact_impulse - self.impulse,
        })
    }

    /// 1 if the target was met for the task's time.
    pub fn completeness(&self) -> f64 {
        f64::from(u8::from(self.met))
    }

    /// True if the state fits a world.
    pub fn fits(&self, world: &World) -> bool {
        C::named_fruit(self.target()).is_none_or(|fruit| (fruit as usize) < world.fruit().len())
    }

    /// From the tool point to the target \[m\].
    fn distance_now(&self, world: &World) -> f64 {
        (Vec3::from(C::p_world(self.target())) - p_world_tcp(world)).norm()
    }
}

impl Learnable for ReachAndGrasp {
    fn terms(rules: &LearningRules) -> Vec<Term> {
        let rules = &rules.reach;
        vec![
            term("success", &rules.success),
            term("grip", &rules.grip),
            term("approach", &rules.approach),
            term("damage", &rules.damage),
        ]
    }

    fn values(step: &Step) -> [f64; TERMS] {
        [step.success, step.grip, step.approach, 0.0, 0.0, 0.0]
    }

    fn p_world(target: &FruitTarget) -> [f64; 3] {
        target.p_world
    }

    fn told(target: &FruitTarget) -> [f64; 4] {
        let [x, y, z] = target.p_odom_told;
        [x, y, z, target.radius_told]
    }
}

impl Learnable for Gentle {
    fn terms(rules: &LearningRules) -> Vec<Term> {
        let rules = &rules.gentle;
        vec![
            term("success", &rules.success),
            term("approach", &rules.approach),
            term("impulse", &rules.impulse),
            term("damage", &rules.damage),
        ]
    }

    fn values(step: &Step) -> [f64; TERMS] {
        [step.success, step.approach, -step.impulse, 0.0, 0.0, 0.0]
    }

    fn p_world(target: &PointTarget) -> [f64; 3] {
        target.p_world
    }

    fn told(target: &PointTarget) -> [f64; 4] {
        let [x, y, z] = target.p_odom;
        [x, y, z, target.heading_odom]
    }
}
