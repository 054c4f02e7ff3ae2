//! Settings of a task environment: task, observations and actions, reward.

use orchard_policy::{SettingError, Spaces, Target};
use orchard_tasks::plan_file::Backend;
use serde::{Deserialize, Serialize};

/// Largest number of environments of a seed. The next episode of the environment with world `k` has world `k + WORLDS`, and so on; after as many
/// episodes the seed counts up. With a [`Pool`] they are its worlds.
pub const WORLDS: u32 = 1 << 16;

/// A task to learn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Task {
    /// Pick fruit into the bucket until none is reachable or the time is over: the benchmark's harvest.
    #[serde(rename = "Harvest-v1")]
    Harvest,
    /// Hold a named fruit: the benchmark's reach-and-grasp, one fruit an episode.
    #[serde(rename = "Reach-v1")]
    Reach,
    /// Push the tool through the canopy to a point behind it: the benchmark's gentle task, one point an episode.
    #[serde(rename = "Gentle-v1")]
    Gentle,
}

/// Worlds in which all episodes begin: the first ones of a seed. Each is grown and settled once and kept, so that a reset costs little.
///
/// Episode `n` of a seed `s` begins, in the environment with world `k`, in world `(s + k + 104,729 n) mod trees` of the pool: environments that
/// are in the same episode have different trees, as long as there are enough, and each sees all trees before it sees one again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Pool {
    /// Number of worlds, from 1 to [`WORLDS`].
    pub trees: u32,
    /// Their seed.
    pub seed: u64,
}

/// Settings of a task environment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Settings {
    /// The task.
    pub task: Task,
    /// Observations and actions; the target is the task's.
    pub spaces: Spaces,
    /// Reward the task's success alone, without shaping and damage.
    pub sparse: bool,
    /// Observe truth (`privileged`). A policy that reads it cannot be ranked.
    pub privileged: bool,
    /// Processor that moves the worlds: the CPU in f64, or a graphics device in f32.
    pub backend: Backend,
    /// Worlds that are grown once and begun in again and again; `None` if every episode begins in a new one.
    pub pool: Option<Pool>,
}

impl Task {
    /// All tasks.
    pub const ALL: [Self; 3] = [Self::Harvest, Self::Reach, Self::Gentle];

    /// Name of the task.
    pub fn name(self) -> &'static str {
        match self {
            Self::Harvest => "Harvest-v1",
            Self::Reach => "Reach-v1",
            Self::Gentle => "Gentle-v1",
        }
    }

    /// Finds a task by its name.
    ///
    /// # Errors
    /// No task has this name.
    pub fn named(name: &str) -> Result<Self, SettingError> {
        SettingError::choice("task", name, &Self::ALL.map(|task| (task.name(), task)))
    }

    /// Kind of target that a policy is told.
    pub fn target(self) -> Option<Target> {
        match self {
            Self::Harvest => None,
            Self::Reach => Some(Target::Fruit),
            Self::Gentle => Some(Target::Point),
        }
    }
}

impl Settings {
    /// The default settings of a task: the default [`Spaces`] with the task's target, and the shaped reward.
    pub fn of(task: Task) -> Self {
        Self {
            task,
            spaces: Spaces { target: task.target(), ..Spaces::default() },
            sparse: false,
            privileged: false,
            backend: Backend::Cpu,
            pool: None,
        }
    }

    /// Sets the reward by its name: `shaped` or `sparse`.
    ///
    /// # Errors
    /// No reward has this name.
    pub fn rewarding(self, reward: &str) -> Result<Self, SettingError> {
        let sparse = SettingError::choice("reward", reward, &[("shaped", false), ("sparse", true)])?;
        Ok(Self { sparse, ..self })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_user_can_get_wrong() {
        let e = Settings::of(Task::Harvest).rewarding("dense").unwrap_err().to_string();
        assert_eq!(e, "reward dense: unknown; it is one of shaped, sparse");
        let e = Task::named("Harvest-v2").unwrap_err().to_string();
        assert_eq!(e, "task Harvest-v2: unknown; it is one of Harvest-v1, Reach-v1, Gentle-v1");
    }
}
