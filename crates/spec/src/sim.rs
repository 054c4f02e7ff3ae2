//! Time, gravity and contact.

use orchard_quantity::{Count, Quantity};
use serde::{Deserialize, Serialize};

/// Time stepping, gravity and the compliance of contact.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SimSpec {
    /// Magnitude of gravity, along world -z.
    pub gravity: Quantity,
    /// Frame rate: one observation and one command a frame.
    pub frame_rate: Quantity,
    /// Physics substeps a frame.
    pub substeps: Count,
    /// Time constant of linear dissipation in contact (Castro et al. 2022).
    pub contact_dissipation_time: Quantity,
    /// Gap below which a pair of shapes becomes a contact candidate.
    pub contact_margin: Quantity,
    /// Coulomb friction coefficient of the ground.
    pub ground_friction: Quantity,
    /// Contact stiffness of the ground.
    pub ground_stiffness: Quantity,
    /// Speed below which loose fruit and debris that touch something fall asleep.
    pub sleep_speed: Quantity,
    /// Time for which they must stay slower than `sleep_speed`.
    pub sleep_time: Quantity,
    /// Half-width of the box about the trunk base outside which a position counts as diverged.
    pub plausible_extent: Quantity,
    /// Contact of loose fruit.
    pub loose: LooseSpec,
}

/// Contact of loose fruit in the rigid-body engine.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LooseSpec {
    /// Contact stiffness, given as the natural frequency of a contact.
    pub contact_frequency: Quantity,
    /// Damping ratio of a contact.
    pub contact_damping_ratio: Quantity,
    /// Highest speed at which an overlap is undone.
    pub recovery_speed: Quantity,
    /// Sweeps over the contacts in each inner step; every frame starts without a first guess of the impulses.
    pub sweeps: Count,
    /// Gap below which two resting fruit count as touching: a few times the sag of a contact in a pile.
    pub touching_gap: Quantity,
}

impl SimSpec {
    /// Frame length \[s\].
    pub fn frame(&self) -> f64 {
        1.0 / self.frame_rate.si()
    }

    /// Substep length \[s\].
    pub fn substep(&self) -> f64 {
        self.frame() / f64::from(self.substeps.get())
    }
}
