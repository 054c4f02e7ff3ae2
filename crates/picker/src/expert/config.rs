//! Config of the expert picker: the part that it shares with the baseline, then its own.

use crate::config::{PickerConfig, text_of, tuned};
use crate::motion::HomingConfig;
use crate::section::section;
use crate::watch::WatchConfig;
use orchard_quantity::{ConfigError, Count, Quantity, from_table, parse, with_base};
use orchard_robot::RobotModel;

/// Config of controller `expert` as TOML text; table `shared` has the base `baseline`.
pub const EXPERT_TOML: &str = include_str!("../../configs/expert/picker.toml");

section! {
    /// Config of the expert picker.
    ExpertConfig {
        /// Config shared with the baseline.
        shared: PickerConfig,
        /// Motions outside the canopy.
        swift: SwiftConfig,
        /// Unfolding of the arm in front of the fruit.
        unfold: UnfoldConfig,
        /// Homing of the hand onto the fruit.
        homing: HomingConfig,
        /// Contact sensing by fingers and arm.
        feel: FeelConfig,
        /// Loading of the stem by the pull.
        load: LoadConfig,
        /// Loading of a stem with other fruit beside its own.
        beside: BesideConfig,
        /// Leaving the canopy with the fruit.
        leave: LeaveConfig,
        /// Placing in the bucket.
        place: PlaceConfig,
        /// Times left in which an attempt still succeeds.
        finish: FinishConfig,
        /// Limits of the alarms.
        watch: WatchConfig,
    }
}

section! {
    /// Times left in a run in which an attempt still succeeds.
    FinishConfig {
        /// Least time for a whole attempt: with less left, none is begun.
        attempt: Quantity,
        /// Least time from the approach of the hand until the fruit lies in the bucket: with less left, the hand does not go for the fruit.
        approach: Quantity,
    }
}

section! {
    /// Motions outside the canopy.
    SwiftConfig {
        /// Largest joint speed.
        speed: Quantity,
        /// Largest joint acceleration.
        acceleration: Quantity,
        /// Joint distance at which a way-point counts as passed.
        blend: Quantity,
    }
}

section! {
    /// Unfolding of the arm in front of the fruit.
    UnfoldConfig {
        /// Distance of the base from its stand-off at which the arm unfolds.
        base_left: Quantity,
        /// Joint distance from the carrying posture at which the arm counts as folded.
        folded: Quantity,
        /// Distance of the camera from the target up to which an image counts as a second look.
        range: Quantity,
        /// Joint distance from the look posture at which the hand begins to home in.
        near: Quantity,
        /// Largest joint speed among branches.
        speed: Quantity,
        /// Cost of a point that the hand meets on its swing to the look posture, in points in the path of the approach.
        swing_cost: Quantity,
    }
}

section! {
    /// Contact sensing by fingers and arm.
    FeelConfig {
        /// Least force of the finger drives that counts as a squeeze, as a share of the commanded force.
        squeeze: Quantity,
        /// Time that the gap must be steady.
        steady_time: Quantity,
        /// Length of a withdrawal beyond which the pull rises no more, and the hand bends the stem.
        bend_distance: Quantity,
        /// Length of a withdrawal beyond which a taut stem means that wood bends.
        wood_distance: Quantity,
        /// Share of the peak pull below which a pull that does not end means that wood yields.
        wood_share: Quantity,
        /// Time for which the lower pull must last.
        wood_time: Quantity,
        /// Least weight on the hand that counts as a fruit.
        weight_min: Quantity,
        /// Time after the end of a pull until the pull is judged.
        settle_time: Quantity,
        /// Least gap between the fingers that still holds a fruit.
        held_width_min: Quantity,
        /// Weight of a frame in the running mean of the force on the hand.
        touch_weight: Quantity,
        /// Largest force on the hand outside a pull; a larger one is wood.
        touch_max: Quantity,
        /// Force on the hand that ends a drive with the arm folded.
        drive_max: Quantity,
        /// Time without sight after which the picker stands still.
        blind_time: Quantity,
    }
}

section! {
    /// Loading of the stem by the pull.
    LoadConfig {
        /// Pull that the hand allows itself from the start.
        brisk: Quantity,
        /// Rise of the allowed pull.
        rate: Quantity,
        /// Shortfall from the allowed pull at which the hand withdraws at full speed; it slows down in proportion.
        band: Quantity,
        /// Lead of the allowed pull over the pull up to which it rises.
        lead: Quantity,
        /// Share of its speed at which the hand, at the largest pull, gives a stem up.
        last_share: Quantity,
        /// Force across the pull at which the hand gives way aside at its full speed; it gives way in proportion.
        give_force: Quantity,
        /// Largest way aside.
        give_most: Quantity,
        /// Pull at which the hand twists the fruit.
        twist_at: Quantity,
        /// Largest pull: a stem that bears it, the twist and the bend is too strong.
        most: Quantity,
        /// Radius of the circle on which the hand bends a stem that bears the largest pull, and time for the circle.
        bend: Quantity,
        bend_time: Quantity,
        /// Largest twist.
        turn: Quantity,
        /// Speed of the twist.
        turn_speed: Quantity,
        /// Torque about the approach axis at which the twist ends: the fruit does not turn with the hand.
        torque_max: Quantity,
        /// Squeeze of each finger for a pull, as a share of it; never less than `grasp.force`.
        squeeze: Quantity,
        /// Largest squeeze of each finger, also that after a slip.
        squeeze_most: Quantity,
        /// Loss of the gap's width that means that the fruit slips.
        slip: Quantity,
        /// Pull after a slip, as a share of the largest before.
        slip_share: Quantity,
    }
}

section! {
    /// Loading of a stem with other fruit beside its own, which the wood shakes off as it springs back.
    BesideConfig {
        /// Largest gap between two fruit that hang beside each other.
        gap: Quantity,
        /// Pull at which the hand twists the fruit.
        twist_at: Quantity,
        /// Largest pull.
        most: Quantity,
        /// Largest squeeze.
        squeeze_most: Quantity,
    }
}

section! {
    /// Leaving the canopy with the fruit.
    LeaveConfig {
        /// Distance of the straight withdrawal before the arm swings.
        distance: Quantity,
        /// Speed of the withdrawal.
        speed: Quantity,
        /// Acceleration with which an empty hand withdraws.
        acceleration: Quantity,
        /// Distance that the base backs out meanwhile.
        base_distance: Quantity,
        /// Speed of the base meanwhile.
        base_speed: Quantity,
    }
}

section! {
    /// Placing in the bucket.
    PlaceConfig {
        /// Height of the TCP above the ground over the rim.
        above: Quantity,
        /// Height of the TCP above the ground where the first layer is let go.
        release: Quantity,
        /// Speed at which the fruit lands.
        speed: Quantity,
        /// Largest speed of the way down.
        brisk: Quantity,
        /// Last part of the way down, in which the fruit may land.
        near: Quantity,
        /// Squeeze of each finger on the way down.
        hold: Quantity,
        /// Downward force at which the fruit counts as landed.
        touch: Quantity,
        /// Height of a layer: each further layer is let go this much higher.
        layer: Quantity,
        /// Places of a layer along the bucket, from its axis.
        along: Vec<Quantity>,
        /// Places of a layer across the bucket, from its axis.
        across: Vec<Quantity>,
        /// Largest number of layers.
        layers: Count,
        /// Joint error over the rim at which the hand may go down.
        arrived: Quantity,
        /// Way by which each finger opens, and the largest force of it meanwhile.
        opening: Quantity,
        force: Quantity,
        /// Joint distance at which the posture over the rim counts as passed.
        blend: Quantity,
        /// Time for the fruit to leave the fingers.
        open_time: Quantity,
    }
}

/// The table of what the expert shares with the baseline.
const SHARED: &str = "shared";

impl ExpertConfig {
    /// Reads a config from TOML text; `file` names it in errors. With `base = "NAME"` table `shared` holds only what differs
    /// from that config of [`PickerConfig::FILES`].
    ///
    /// # Errors
    /// Not TOML, no such base, a field missing or unknown, a value outside its range.
    pub fn from_toml(file: &str, text: &str) -> Result<Self, ConfigError> {
        let mut table = parse(file, text)?;
        if let Some(toml::Value::Table(shared)) = table.get_mut(SHARED) {
            *shared = with_base(file, std::mem::take(shared), &text_of, &[])
                .map_err(|e| ConfigError { field: format!("{SHARED}.{}", e.field), ..e })?;
        }
        from_table(file, table)
    }

    /// Lays a robot's figures over the config: table `picker` of its tuning over what all controllers share, table `expert` over the rest.
    ///
    /// # Errors
    /// An unknown field, or a value outside its range.
    pub fn tuned(&self, robot: &RobotModel) -> Result<Self, ConfigError> {
        let config = tuned(self, robot, "expert")?;
        Ok(Self { shared: config.shared.tuned(robot)?, ..config })
    }

    /// Returns the config that comes with the crate.
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
