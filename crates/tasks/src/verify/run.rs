//! Runs a trajectory on trees.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use orchard_bench::task::Progress;
use orchard_bench::{PlanError, check_trees};
use orchard_picker::Controller;
use orchard_robot::{Command, JointValues, RobotModel};
use orchard_scenario::Scenario;
use orchard_world::truth::FruitState;
use orchard_world::{Status, World, WorldEvent};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::protocol::Protocol;
use crate::verify::trajectory::{Row, Trajectory, TrajectoryError};

/// A trajectory and the trees on which it is run.
#[derive(Debug, Clone)]
pub struct VerifyPlan {
    /// Worlds and robot.
    pub scenario: Scenario,
    /// The trajectory.
    pub trajectory: Trajectory,
    /// Seeds, in order.
    pub seeds: Vec<u64>,
    /// Trees per seed.
    pub trees: u32,
    /// Protocol constants.
    pub protocol: Protocol,
}

impl VerifyPlan {
    /// Frames of a run on a tree.
    pub fn frames(&self) -> u32 {
        let length = self.trajectory.duration() + self.protocol.verify.settle.si();
        (length / self.scenario.spec().sim.frame()).ceil() as u32
    }

    /// Every tree, seed by seed.
    pub fn worlds(&self) -> Vec<(u64, u32)> {
        let worlds = |&seed: &u64| (0..self.trees).map(move |world| (seed, world));
        self.seeds.iter().flat_map(worlds).collect()
    }
}

/// Effect of a trajectory on a tree.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TreeOutcome {
    /// Seed.
    pub seed: u64,
    /// World index.
    pub world: u32,
    /// Reason why the run was not completed: the world could not be built or left its plausible state.
    pub quarantined: Option<String>,
    /// Simulated time \[s\].
    pub duration_s: f64,
    /// Fruit at the start.
    pub fruit: u32,
    /// Ruptures.
    pub branches_snapped: u32,
    /// Fruit that came off its stem.
    pub fruit_knocked_off: u32,
    /// Fruit that at the end is off its stem and neither in the bucket nor in the hand.
    pub fruit_dropped: u32,
    /// Largest ratio of bending moment to rupture moment of any joint, including gravity.
    pub peak_moment_ratio: f64,
    /// Largest excess of a joint's ratio over its value at the start.
    pub peak_moment_excess: f64,
    /// Integral over time of the largest excess \[s\].
    pub moment_excess_s: f64,
    /// Impulse of the robot's contacts with wood \[N s\].
    pub contact_impulse_n_s: f64,
    /// Largest sum of the forces of these contacts \[N\].
    pub peak_contact_force_n: f64,
}

/// Reason why a verification did not finish.
#[derive(Debug, thiserror::Error)]
pub enum VerifyError {
    /// The plan cannot be run.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The threads cannot be started.
    #[error("cannot start threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// The stop flag was raised; nothing was written.
    #[error("interrupted after {done} of {total} trees; nothing was written")]
    Interrupted {
        /// Trees done.
        done: usize,
        /// Trees in the plan.
        total: usize,
    },
}

/// Runs the trajectory on every tree on `threads` threads; outcomes in the order of [`VerifyPlan::worlds`].
///
/// # Errors
/// The plan is invalid, or `stop` was raised.
pub fn run(
    plan: &VerifyPlan,
    threads: usize,
    stop: &AtomicBool,
    progress: &impl Progress<TreeOutcome>,
) -> Result<Vec<TreeOutcome>, VerifyError> {
    check_trees(&plan.seeds, plan.trees)?;
    let worlds = plan.worlds();
    let done = AtomicUsize::new(0);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    let outcomes: Option<Vec<TreeOutcome>> = pool.install(|| {
        worlds
            .par_iter()
            .with_max_len(1)
            .map(|&(seed, world)| {
                let outcome = one(plan, seed, world, stop, &mut || progress.step())?;
                progress.record(&outcome, false);
                done.fetch_add(1, Ordering::Relaxed);
                Some(outcome)
            })
            .collect()
    });
    outcomes.ok_or(VerifyError::Interrupted { done: done.into_inner(), total: worlds.len() })
}

/// One tree; `None` if stopped.
fn one(
    plan: &VerifyPlan,
    seed: u64,
    world: u32,
    stop: &AtomicBool,
    on_frame: &mut dyn FnMut(),
) -> Option<TreeOutcome> {
    let mut outcome = TreeOutcome {
        seed,
        world,
        quarantined: None,
        duration_s: 0.0,
        fruit: 0,
        branches_snapped: 0,
        fruit_knocked_off: 0,
        fruit_dropped: 0,
        peak_moment_ratio: 0.0,
        peak_moment_excess: 0.0,
        moment_excess_s: 0.0,
        contact_impulse_n_s: 0.0,
        peak_contact_force_n: 0.0,
    };
    if stop.load(Ordering::Relaxed) {
        return None;
    }
    let mut world = match plan.scenario.world(seed, world, 0) {
        Ok(world) => world,
        Err(e) => {
            outcome.quarantined = Some(e.to_string());
            return Some(outcome);
        }
    };
    let frame = plan.scenario.spec().sim.frame();
    for k in 0..plan.frames() {
        if stop.load(Ordering::Relaxed) {
            return None;
        }
        world.step(&plan.trajectory.at(f64::from(k) * frame));
        on_frame();
        for event in world.drain_events() {
            match event {
                WorldEvent::BranchSnapped { .. } => outcome.branches_snapped += 1,
                WorldEvent::FruitDetached { .. } => outcome.fruit_knocked_off += 1,
                _ => {}
            }
        }
        if let Status::Quarantined { frame, reason } = world.status() {
            outcome.quarantined = Some(format!("frame {frame}: {reason}"));
            break;
        }
    }
    let fruit = world.fruit_truth();
    let dropped = |state| matches!(state, FruitState::Dropped | FruitState::Loose);
    let load = world.wood_load();
    // The figures of a quarantined world are invalid, and JSON has no NaN.
    let number = |x: f64| if x.is_finite() { x } else { 0.0 };
    Some(TreeOutcome {
        duration_s: f64::from(world.frame()) * frame,
        fruit: fruit.len() as u32,
        fruit_dropped: fruit.iter().filter(|f| dropped(f.state)).count() as u32,
        peak_moment_ratio: number(load.peak_ratio),
        peak_moment_excess: number(load.peak_excess),
        moment_excess_s: number(load.excess_integral),
        contact_impulse_n_s: number(load.contact_impulse),
        peak_contact_force_n: number(load.peak_contact_force),
        ..outcome
    })
}

/// Decimal places of a recorded trajectory: micrometres and microradians.
const DIGITS: f64 = 1e6;

/// Records the commands of a controller in a world during `frames` frames: every `every`-th frame and the last.
///
/// # Errors
/// A command of the controller is not valid in a trajectory.
pub fn record_controller(
    world: &mut World,
    robot: &RobotModel,
    controller: &mut dyn Controller,
    frames: u32,
    every: u32,
) -> Result<Trajectory, TrajectoryError> {
    let frame = world.spec().sim.frame();
    let round = |x: f64| (x * DIGITS).round() / DIGITS;
    let mut rows = Vec::new();
    for k in 0..=frames {
        let command = controller.act(&world.observe());
        if k.is_multiple_of(every.max(1)) || k == frames {
            let arm_q = JointValues::from_fn(command.arm_q.len(), |i| round(command.arm_q[i])).vector();
            let rounded = Command {
                arm_q: robot.kinematics().values(&robot.kinematics().clamped(&arm_q)),
                arm_v: JointValues::zeros(command.arm_v.len()),
                base_velocity: command.base_velocity.map(round),
                finger_q: round(command.finger_q),
                finger_force: round(command.finger_force),
                vacuum: round(command.vacuum),
            };
            rows.push((u64::from(k) + 1, Row { time: round(f64::from(k) * frame), command: rounded }));
        }
        world.step(&command);
    }
    Trajectory::new("the recording", &rows, robot, f64::INFINITY)
}
