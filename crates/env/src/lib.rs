//! Many worlds of a scenario, and the tasks of the benchmark as environments to learn in.
//!
//! An [`Env`] is N worlds of one seed of a [`orchard_scenario::Scenario`], stepped by commands. A [`TaskEnv`] puts a task of the benchmark on
//! them: actions and observations in the encoding of `orchard-policy`, rewards, costs and ends. Python uses the same one. Worlds share nothing, so
//! the result of a world does not depend on the number of other worlds or of threads.
//!
//! ```no_run
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! use orchard_env::{Settings, Task, TaskEnv};
//! use orchard_scenario::Scenario;
//! let scenario = Scenario::of(&[("preset", "tall-spindle")])?;
//! let mut env = TaskEnv::new(&scenario, &Settings::of(Task::Harvest), 0..8)?;
//! let all = vec![true; 8];
//! env.reset(&[Some(1); 8], &all)?;
//! let actions = vec![0.0; 8 * env.interface().policy.action.len()];
//! env.step(&actions, &all)?;
//! let reward: Vec<f64> = (0..8).map(|k| env.report(k).reward).collect();
//! # Ok(())
//! # }
//! ```
//!
//! A controller of the benchmark drives an environment by [`TaskEnv::drive`], which gives demonstrations.
//!
//! `docs/python.md` states the spaces, the conventions and the rewards.

mod alone;
mod component;
mod damage;
mod driven;
mod error;
mod harvest;
mod instruction;
mod interface;
mod mover;
#[cfg(feature = "gpu")]
mod on_device;
mod pictures;
mod privileged;
mod report;
mod rules;
mod settings;
mod slot;
mod starts;
mod task_env;
mod together;
mod worlds;

pub use driven::{Driven, Via};
pub use error::EnvError;
pub use interface::{Interface, Term};
#[cfg(feature = "gpu")]
pub use orchard_gpu::DeviceArray;
#[cfg(feature = "gpu")]
pub use orchard_lockstep::Detail;
pub use orchard_tasks::plan_file::Backend;
pub use report::{Report, Statistics};
pub use rules::{
    CostRules, GentleReward, HarvestReward, InstructionRules, LearningRules, ReachReward, V1_TOML,
};
pub use settings::{Pool, Settings, Task, WORLDS};
pub use task_env::TaskEnv;
pub use worlds::Env;

/// Compiles the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
