//! The scaling task's constants: the table `[scaling]` of the protocol.

use orchard_quantity::{Count, Quantity};
use orchard_spec::randomisation::Mode;
use serde::{Deserialize, Serialize};

/// The scaling task.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScalingRules {
    /// Frames of a course, which begins at the kick.
    pub frames: Count,
    /// Largest joint rate of a kick.
    pub kick: Quantity,
    /// The official profile.
    pub full: Effort,
    /// The short profile.
    pub quick: Effort,
    /// The paper's figures.
    pub published: PublishedScaling,
}

/// How much is measured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Effort {
    /// Worlds of the largest batch.
    pub most_worlds: Count,
    /// Worlds of a batch over those of the one before it; the first has one.
    pub factor: Count,
    /// Times that a cell is measured.
    pub repeats: Count,
    /// Time for all repeats of a cell; a repeat has at least one course, however long that takes.
    pub cell_time: Quantity,
}

impl Effort {
    /// Worlds of every batch, ascending: 1, `factor`, its square and so on, and `most_worlds`.
    pub fn worlds(&self) -> Vec<u32> {
        let (most, factor) = (self.most_worlds.get(), self.factor.get());
        let mut worlds = Vec::new();
        let mut next = Some(1);
        while let Some(count) = next.filter(|count| *count < most) {
            worlds.push(count);
            next = u32::checked_mul(count, factor);
        }
        worlds.push(most);
        worlds
    }
}

/// Figures of the paper; for comparison only.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PublishedScaling {
    /// Env-steps a second.
    pub env_steps_per_s: Vec<PublishedRate>,
}

impl PublishedScaling {
    /// The figure of a mode at a number of worlds.
    pub fn at(&self, mode: Mode, worlds: u32) -> Option<&PublishedRate> {
        self.env_steps_per_s.iter().find(|rate| (rate.mode, rate.worlds) == (mode, worlds))
    }
}

/// A rate of the paper.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PublishedRate {
    /// What differs between worlds.
    pub mode: Mode,
    /// Worlds.
    pub worlds: u32,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Unit.
    pub unit: String,
    /// Key of the source in `docs/references.bib`.
    pub source: String,
}
