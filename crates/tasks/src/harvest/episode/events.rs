//! Events of a world in the record of its episode.

use orchard_world::Release;
use serde::{Deserialize, Serialize};

/// A fruit and the moment of an event.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FruitMoment {
    /// The fruit.
    pub fruit: u32,
    /// Frame.
    pub frame: u32,
    /// Time \[s\].
    pub time: f64,
}

/// A fruit that came off its stem.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DetachEvent {
    /// The fruit.
    pub fruit: u32,
    /// Frame.
    pub frame: u32,
    /// Time \[s\].
    pub time: f64,
    /// Tension of the stem when it broke \[N\]; null if not finite.
    pub tension_n: Option<f64>,
    /// True if the tension exceeds `rules.stem_pull`, the force that detaches most apples in a straight pull.
    pub stem_pulled: bool,
    /// Way in which it came off a stem that bends; absent on a tether.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub release: Option<Release>,
    /// Strength of its stem in a straight pull \[N\]; absent if the world does not tell it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub strength_n: Option<f64>,
}

/// A fruit that came to rest in the bucket.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DepositEvent {
    /// The fruit.
    pub fruit: u32,
    /// Frame.
    pub frame: u32,
    /// Time \[s\].
    pub time: f64,
    /// Height of the fall from the fingers \[m\]; null if not recorded.
    pub drop_height_m: Option<f64>,
    /// Energy of the hardest impact of that fall \[J\]; null if not recorded.
    pub impact_energy_j: Option<f64>,
    /// Energy of the hardest impact of the fruit since the start \[J\]; null if not recorded.
    pub bruise_energy_j: Option<f64>,
    /// True if the energy exceeds `rules.bruise_energy`; null if not recorded.
    pub bruised: Option<bool>,
    /// Bruised volume of the fruit \[m^3\]; absent where the preset has no law of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bruise_volume_m3: Option<f64>,
    /// True if that volume exceeds `rules.bruise_volume`; absent without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub over_bruise_volume: Option<bool>,
}

/// A rupture of wood.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SnapEvent {
    /// Segment whose base joint broke.
    pub segment: u32,
    /// Frame.
    pub frame: u32,
    /// Time \[s\].
    pub time: f64,
    /// True if the branch broke at its union with the wood that bears it; absent where its own section broke.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub at_union: bool,
}

/// A fault that the controller noticed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AlarmTime {
    /// Fault, by the name of [`orchard_picker::Alarm`].
    pub alarm: String,
    /// Time at which it was noticed \[s\].
    pub from: f64,
    /// Time at which the controller noticed its end \[s\]; null if it told none.
    pub until: Option<f64>,
}
