//! Reach and grasp: hold a named fruit between both fingers.

use orchard_geometry::{Vec3, inverse_transform};
use orchard_picker::Goal;
use orchard_spec::{Purpose, Stream};
use orchard_world::World;
use serde::{Deserialize, Serialize};

use crate::component::rules::ComponentRules;
use crate::component::task::Component;
use crate::json::array;

/// The task.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReachAndGrasp;

/// A named fruit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FruitTarget {
    /// The fruit.
    pub fruit: u32,
    /// Centre at the start \[m, world\].
    pub p_world: [f64; 3],
    /// Radius \[m\].
    pub radius: f64,
    /// Centre given to the controller \[m, odom\].
    pub p_odom_told: [f64; 3],
    /// Radius given to the controller \[m\].
    pub radius_told: f64,
}

/// Smallest radius given to a controller \[m\]: keeps the radius positive.
const SMALLEST_RADIUS: f64 = 1e-3;

impl Component for ReachAndGrasp {
    type Target = FruitTarget;
    const NAME: &'static str = "reach-and-grasp";
    const SUMMARY: &'static str = "reach-and-grasp.json";

    /// The first of the reachable fruit confirmed by inverse kinematics, in random order.
    fn targets(world: &World, rules: &ComponentRules, seed: u64) -> Vec<FruitTarget> {
        let (truth, reachable) = (world.fruit_truth(), world.reachable());
        let mut fruit: Vec<usize> = (0..truth.len()).filter(|&i| reachable[i]).collect();
        Stream::new(seed, world.index(), Purpose::ComponentTarget).shuffle(&mut fruit);
        let mut noise = Stream::new(seed, world.index(), Purpose::Localisation);
        let (centre, radius) = (rules.grasp.centre_error.si(), rules.grasp.radius_error.si());
        let confirmed = fruit.into_iter().filter(|&i| world.reaches_by_ik(&truth[i].p_world));
        confirmed
            .take(rules.grasp.targets.get() as usize)
            .map(|i| {
                let p_world = truth[i].p_world;
                let error = Vec3::from_fn(|_, _| noise.normal(0.0, centre));
                let p_odom = inverse_transform(&world.x_world_odom(), &p_world) + error;
                FruitTarget {
                    fruit: i as u32,
                    p_world: array(&p_world),
                    radius: truth[i].radius,
                    p_odom_told: array(&p_odom),
                    radius_told: noise.normal(truth[i].radius, radius).max(SMALLEST_RADIUS),
                }
            })
            .collect()
    }

    fn goal(target: &FruitTarget) -> Goal {
        Goal::Grasp { p_odom: target.p_odom_told.into(), radius: target.radius_told }
    }

    fn time(rules: &ComponentRules) -> f64 {
        rules.grasp.time.si()
    }

    fn hold_frames(rules: &ComponentRules, frame: f64) -> u32 {
        ((rules.grasp.hold.si() / frame).round() as u32).max(1)
    }

    fn is_met(world: &World, target: &FruitTarget, _: &ComponentRules) -> bool {
        world.is_held(target.fruit as usize)
    }

    fn frames_to_meet(_: &World, _: &FruitTarget, _: &ComponentRules, _: f64) -> u32 {
        // A grip touches.
        u32::MAX
    }

    fn named_fruit(target: &FruitTarget) -> Option<u32> {
        Some(target.fruit)
    }

    fn trials(rules: &ComponentRules) -> u32 {
        rules.grasp.targets.get()
    }
}
