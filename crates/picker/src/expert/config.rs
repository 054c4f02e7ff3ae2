//! The expert picker's config: the shared part in the baseline's form, then its own.

use crate::config::{PickerConfig, section};
use crate::motion::HomingConfig;
use orchard_quantity::{ConfigError, Count, Quantity, from_toml};

/// The preset `expert` as TOML text.
pub const EXPERT_TOML: &str = include_str!("../../configs/expert/picker.toml");

section! {
    /// Everything that the expert picker can be told.
    ExpertConfig {
        /// What it shares with the baseline.
        shared: PickerConfig,
        /// Motions outside the canopy.
        swift: SwiftConfig,
        /// Unfolding the arm before the fruit.
        unfold: UnfoldConfig,
        /// The hand's way onto the fruit.
        homing: HomingConfig,
        /// What the fingers and the wrist must feel.
        feel: FeelConfig,
        /// Out of the canopy with the fruit.
        leave: LeaveConfig,
        /// Placing in the bucket.
        place: PlaceConfig,
    }
}

section! {
    /// Motions outside the canopy.
    SwiftConfig {
        /// Largest joint speed.
        speed: Quantity,
        /// Largest joint acceleration.
        acceleration: Quantity,
        /// A way-point is passed once all joints are this near.
        blend: Quantity,
    }
}

section! {
    /// Unfolding the arm before the fruit.
    UnfoldConfig {
        /// Distance of the base from its stand-off at which the arm unfolds.
        base_left: Quantity,
        /// The arm counts as folded once all joints are this near to the carrying posture.
        folded: Quantity,
        /// An image counts for the second look if the camera was this near to the target.
        range: Quantity,
        /// The hand homes in once all joints are this near to the posture of the second look.
        near: Quantity,
        /// Largest joint speed among branches.
        speed: Quantity,
        /// A point in the way of the hand's swing to the second look, in points in the way of the approach.
        swing_cost: Quantity,
    }
}

section! {
    /// What the fingers and the wrist must feel.
    FeelConfig {
        /// Least force of the finger drives that is a squeeze, as a share of what they are told.
        squeeze: Quantity,
        /// Time that the gap must be steady.
        steady_time: Quantity,
        /// A withdrawal longer than this with the stem taut bends wood.
        wood_way: Quantity,
        /// A drop of the pull below this share of its peak while the fruit is still tied is wood that gives.
        wood_share: Quantity,
        /// Time for which it must last.
        wood_time: Quantity,
        /// Least weight on the hand that is a fruit.
        weight_min: Quantity,
        /// Time after the end of a pull until the pull is judged.
        settle_time: Quantity,
        /// A smaller gap between the fingers holds no fruit any longer.
        held_width_min: Quantity,
        /// Weight of a frame in the running mean of the force on the empty hand.
        touch_weight: Quantity,
        /// A larger one on the way to the second look is wood.
        touch_max: Quantity,
        /// Images without sight are borne for so long.
        blind_time: Quantity,
    }
}

section! {
    /// Out of the canopy with the fruit.
    LeaveConfig {
        /// The hand withdraws straight by this much before the arm swings.
        way: Quantity,
        /// Speed of the withdrawal.
        speed: Quantity,
        /// Acceleration with which an empty hand withdraws.
        acceleration: Quantity,
        /// The base backs out by this much meanwhile.
        base_way: Quantity,
        /// At this speed.
        base_speed: Quantity,
    }
}

section! {
    /// Placing in the bucket.
    PlaceConfig {
        /// TCP over the ground over the rim.
        above: Quantity,
        /// TCP over the ground where the first layer is let go.
        release: Quantity,
        /// Force down at which the fruit counts as landed.
        touch: Quantity,
        /// Each further layer is let go this much higher.
        layer: Quantity,
        /// Places of a layer along the bucket, from its axis.
        along: Vec<Quantity>,
        /// Places of a layer across the bucket, from its axis.
        across: Vec<Quantity>,
        /// Most layers.
        layers: Count,
        /// Joint error at which the fingers may open.
        arrived: Quantity,
        /// Each finger opens by this much.
        opening: Quantity,
        /// The posture over the rim is passed once all joints are this near.
        blend: Quantity,
        /// Time for the fruit to leave the fingers.
        open_time: Quantity,
    }
}

impl ExpertConfig {
    /// Reads a config from TOML text; `file` names it in errors.
    ///
    /// # Errors
    /// Not TOML, a field missing or unknown, a value outside its range.
    pub fn from_toml(file: &str, text: &str) -> Result<Self, ConfigError> {
        from_toml(file, text)
    }

    /// The preset `expert`.
    ///
    /// # Panics
    /// Never: the embedded file is read in this crate's tests.
    pub fn preset() -> Self {
        match Self::from_toml("expert/picker.toml", EXPERT_TOML) {
            Ok(config) => config,
            Err(e) => unreachable!("embedded preset: {e}"),
        }
    }
}
