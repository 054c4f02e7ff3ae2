//! Errors of environments.

use orchard_policy::SettingError;
use orchard_quantity::ConfigError;
use orchard_world::{SnapshotError, WorldError};

/// An environment that cannot be built or stepped.
#[derive(Debug, thiserror::Error)]
pub enum EnvError {
    /// One of its worlds cannot be built.
    #[error("world {world}: {source}")]
    World {
        /// Index of the world.
        world: u32,
        /// Cause.
        source: WorldError,
    },
    /// A setting that does not exist or does not fit.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// The scenario changes the protocol's figures in a way that it does not allow.
    #[error("{0}")]
    Rules(#[from] ConfigError),
    /// There is no graphics device, it cannot step these worlds, or it was lost.
    #[error("backend gpu: {0}")]
    Device(String),
    /// A list that must have one entry an environment has another length.
    #[error("{given} {what} for {envs} environments")]
    Count {
        /// Name of the entries, such as actions.
        what: &'static str,
        /// Entries given.
        given: usize,
        /// Entries needed.
        envs: usize,
    },
    /// A number of an action is not finite.
    #[error("action of environment {env}: {channel} is {value}, which is not a finite number")]
    Action {
        /// Place of the environment.
        env: usize,
        /// Name of the number.
        channel: String,
        /// Value given.
        value: f32,
    },
    /// An environment was stepped or saved before its first reset.
    #[error("environment {env} has no episode yet: call reset first")]
    NotStarted {
        /// Place of the environment.
        env: usize,
    },
    /// An environment was stepped after the end of its episode.
    #[error("the episode of environment {env} has ended: reset it before the next step")]
    Ended {
        /// Place of the environment.
        env: usize,
    },
    /// Saved state of an environment that cannot be read or belongs to another one.
    #[error("state of environment {env}: {problem}")]
    State {
        /// Place of the environment.
        env: usize,
        /// Reason why the state cannot be used.
        problem: String,
    },
    /// The task has no target in any of the worlds that were tried.
    #[error("environment {env}: no target of {task} in {tried} worlds from world {world} of seed {seed}")]
    NoTarget {
        /// Place of the environment.
        env: usize,
        /// Name of the task.
        task: &'static str,
        /// Worlds tried.
        tried: u32,
        /// The first of them.
        world: u32,
        /// Seed.
        seed: u64,
    },
    /// The number of commands differs from the number of worlds.
    #[error("{given} commands for {worlds} worlds")]
    CommandCount {
        /// Commands given.
        given: usize,
        /// Worlds.
        worlds: usize,
    },
    /// The number of snapshots differs from the number of worlds.
    #[error("{given} snapshots for {worlds} worlds")]
    SnapshotCount {
        /// Snapshots given.
        given: usize,
        /// Worlds.
        worlds: usize,
    },
    /// A snapshot that does not fit its world.
    #[error("snapshot {index}: {source}")]
    Snapshot {
        /// Place of the world in [`crate::Env::worlds`].
        index: usize,
        /// Cause.
        source: SnapshotError,
    },
}
