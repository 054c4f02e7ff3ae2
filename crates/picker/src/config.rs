//! The baseline picker's config.

use orchard_quantity::{ConfigError, Count, Quantity, Span, from_toml};

/// The preset `paper` as TOML text.
pub const PAPER_TOML: &str = include_str!("../configs/paper/picker.toml");

macro_rules! section {
    ($(#[$doc:meta])* $name:ident { $($(#[$field_doc:meta])* $field:ident: $kind:ty,)* }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct $name { $($(#[$field_doc])* pub $field: $kind,)* }
    };
}
pub(crate) use section;

section! {
    /// Everything that the baseline picker can be told.
    PickerConfig {
        /// Reading the sensors.
        sensors: SensorsConfig,
        /// Tree-centre belief.
        belief: BeliefConfig,
        /// Point memory.
        cloud: CloudConfig,
        /// Looking for fruit.
        scan: ScanConfig,
        /// Driving.
        drive: DriveConfig,
        /// Where to stand.
        align: AlignConfig,
        /// From where to grasp.
        approach: ApproachConfig,
        /// The second look.
        reach: ReachConfig,
        /// Arm motions.
        arm: ArmConfig,
        /// Closing the fingers.
        grasp: GraspConfig,
        /// Detaching.
        pull: PullConfig,
        /// Letting go.
        deposit: DepositConfig,
        /// Longest durations.
        timeout: TimeoutConfig,
        /// How long failed targets are left alone.
        blacklist: BlacklistConfig,
    }
}

section! {
    /// Reading the sensors.
    SensorsConfig {
        /// A gap between observations longer than this is not integrated over.
        longest_step: Quantity,
        /// States of the robot are remembered for so long, to place images that come late.
        memory: Quantity,
    }
}

section! {
    /// Where the tree is believed to stand.
    BeliefConfig {
        /// How far straight ahead of the start the tree is first believed to stand.
        start_distance: Quantity,
        /// Weight of the start belief, in images.
        prior_images: Count,
        /// Points farther from the belief than this are not of the tree.
        canopy_radius: Quantity,
    }
}

section! {
    /// Memory of seen points.
    CloudConfig {
        /// Images kept.
        images: Count,
        /// Every so many pixels are kept, along rows and columns.
        stride: Count,
        /// Farthest depth kept.
        range: Quantity,
        /// An image with a smaller share of valid pixels is blind.
        blind_fraction: Quantity,
    }
}

section! {
    /// A survey posture of the arm.
    PostureConfig {
        /// TCP ahead of the base's centre.
        x: Quantity,
        /// TCP over the ground.
        z: Quantity,
        /// Rise of the hand's axis.
        pitch: Quantity,
        /// Turn of the hand's axis to the left.
        yaw: Quantity,
    }
}

section! {
    /// Looking for fruit.
    ScanConfig {
        /// Distance from the tree's centre.
        standoff: Quantity,
        /// Distance at which a place counts as reached.
        position_tolerance: Quantity,
        /// Angle at which a place counts as reached.
        angle_tolerance: Quantity,
        /// Bearing step around the tree when nothing is found.
        orbit_step: Quantity,
        /// Time in each posture.
        dwell: Quantity,
        /// Heights over the ground of fruit that is tried.
        height: Span,
        /// Arm speed without sight, as a share of the normal one.
        blind_speed_scale: Quantity,
        /// Postures, in turn. The first is also the one for driving.
        postures: Vec<PostureConfig>,
    }
}

section! {
    /// Driving.
    DriveConfig {
        /// Largest speed.
        speed: Quantity,
        /// Largest turn rate.
        turn_speed: Quantity,
        /// Speed per distance.
        gain: Quantity,
        /// Distance from the tree at which its bearing is changed.
        orbit_radius: Quantity,
        /// Share of the orbit radius from which the base goes around; nearer it backs out first.
        orbit_share: Quantity,
        /// Bearing differences up to this are driven straight.
        orbit_angle: Quantity,
        /// Nearest that the base's centre comes to the tree's.
        trunk_clearance: Quantity,
        /// A base told to go faster than this must move.
        stall_command: Quantity,
        /// A base that must move and is slower than this is held by something.
        stall_speed: Quantity,
    }
}

section! {
    /// Where to stand.
    AlignConfig {
        /// Distances of the base from the target, best first.
        standoffs: Vec<Quantity>,
        /// Distance at which a place counts as reached.
        position_tolerance: Quantity,
        /// Angle at which a place counts as reached.
        angle_tolerance: Quantity,
        /// Bearings of the base about the target, from straight outwards.
        bearings: Vec<Quantity>,
        /// Targets that are planned for before one is chosen.
        candidates: Count,
        /// Points in the way that equal one metre of driving.
        drive_cost: Quantity,
        /// Points in the way that equal one point where the robot would stand.
        crowd_cost: Quantity,
        /// Room of chassis and arm: half-length.
        body_half_x: Quantity,
        /// Room of chassis and arm: half-width.
        body_half_y: Quantity,
        /// Room of chassis and arm: height.
        body_height: Quantity,
    }
}

section! {
    /// From where to grasp.
    ApproachConfig {
        /// Distance of the pre-grasp from the fruit.
        pregrasp: Quantity,
        /// Distance of the second look's TCP from the fruit.
        look: Quantity,
        /// How far the TCP goes beyond the fruit's centre.
        overshoot: Quantity,
        /// Longest step between the postures that are checked along the straight approach.
        line_step: Quantity,
        /// Rises of the approach direction, best first.
        elevations: Vec<Quantity>,
        /// Turns of the approach direction from the line base-fruit, best first.
        azimuths: Vec<Quantity>,
        /// Swept volume: half-extent along the hand's x.
        sweep_half_x: Quantity,
        /// Swept volume: half-extent along the hand's y.
        sweep_half_y: Quantity,
        /// Swept volume: its end beyond the TCP.
        sweep_tip: Quantity,
        /// Swept volume: its length back along the approach.
        sweep_length: Quantity,
        /// Points this close to the fruit's surface are the fruit's.
        fruit_margin: Quantity,
        /// The hand's length, back from the TCP.
        hand_length: Quantity,
        /// The arm must be able to go on beyond the grasp by this much when a place for the base is chosen: the base stops
        /// only about there.
        reach_margin: Quantity,
        /// Points between the second look's camera and the fruit, in points in the way.
        hiding_cost: Quantity,
        /// Points in the way that equal one radian of turning.
        turn_cost: Quantity,
        /// Points in the way that equal one radian of the joint that moves farthest.
        posture_cost: Quantity,
        /// Directions within reach that are compared, least in the way first.
        candidates: Count,
    }
}

section! {
    /// The second look.
    ReachConfig {
        /// Images with the fruit that are averaged.
        look_images: Count,
        /// Images after which the look ends.
        look_images_max: Count,
        /// A target seen in this many images before is tried even if the second look does not show it.
        trusted_hits: Count,
        /// A detection this close to the estimate is the target.
        match_distance: Quantity,
    }
}

section! {
    /// Arm motions.
    ArmConfig {
        /// Largest joint speed.
        joint_speed: Quantity,
        /// Largest joint acceleration.
        joint_acceleration: Quantity,
        /// Hand speed towards the fruit.
        approach_speed: Quantity,
        /// Hand speed away with the fruit.
        withdraw_speed: Quantity,
        /// Hand acceleration on a straight line.
        line_acceleration: Quantity,
        /// Slowest motion at the end of a straight line, as a share of its speed.
        line_creep: Quantity,
        /// A larger joint step between neighbouring points of a line means another branch of postures.
        branch_jump: Quantity,
        /// Joint error at which a motion counts as ended.
        arrived: Quantity,
        /// Joint error that counts as held by something, when the arm is slow.
        stall_error: Quantity,
        /// Joint speed below which the arm is slow.
        stall_speed: Quantity,
    }
}

section! {
    /// Closing the fingers.
    GraspConfig {
        /// Opening of each finger before.
        opening: Quantity,
        /// Largest force of each finger drive.
        force: Quantity,
        /// A hand stopped this close to its goal closes all the same.
        close_near: Quantity,
        /// Least width between the fingers that is a fruit.
        fruit_width_min: Quantity,
        /// Time between closing and pulling.
        settle: Quantity,
        /// Longest closing time.
        close_time: Quantity,
        /// A gap between the fingers that changes by less than this a frame is steady.
        steady_width: Quantity,
        /// Time for which the gap must be steady.
        steady_time: Quantity,
    }
}

section! {
    /// Detaching.
    PullConfig {
        /// Longest withdrawal.
        distance: Quantity,
        /// Weight of a frame's force in the running mean of the pull.
        tension_weight: Quantity,
        /// Pull that shows that the stem is taut.
        tension_high: Quantity,
        /// Pull below which a stem that was taut has given way.
        tension_low: Quantity,
        /// Least withdrawal before the fruit is carried off.
        clear_distance: Quantity,
        /// Gravity that the arm's torques balance.
        gravity: Quantity,
    }
}

section! {
    /// Letting go.
    DepositConfig {
        /// TCP over the ground when it arrives over the bucket.
        above: Quantity,
        /// TCP over the ground when it lets go.
        release: Quantity,
        /// Largest distance from the bucket's axis.
        centred: Quantity,
        /// Largest joint speed.
        slow: Quantity,
        /// Time for the fruit to leave the fingers.
        open_time: Quantity,
    }
}

section! {
    /// Longest durations.
    TimeoutConfig {
        /// Of reaching.
        reach: Quantity,
        /// Of grasping.
        grasp: Quantity,
        /// Of pulling.
        pull: Quantity,
        /// Of carrying.
        transport: Quantity,
        /// Of aligning.
        align: Quantity,
        /// Of no progress.
        stall: Quantity,
    }
}

section! {
    /// How long failed targets are left alone.
    BlacklistConfig {
        /// After failures that may pass.
        short: Quantity,
        /// After failures that will not.
        long: Quantity,
        /// Detections this close to a failed target are the same.
        radius: Quantity,
    }
}

impl PickerConfig {
    /// Reads a config from TOML text; `file` names it in errors.
    ///
    /// # Errors
    /// Not TOML, a field missing or unknown, a value outside its range.
    pub fn from_toml(file: &str, text: &str) -> Result<Self, ConfigError> {
        from_toml(file, text)
    }

    /// The preset `paper`.
    ///
    /// # Panics
    /// Never: the embedded file is read in this crate's tests.
    pub fn paper() -> Self {
        match Self::from_toml("paper/picker.toml", PAPER_TOML) {
            Ok(config) => config,
            Err(e) => unreachable!("embedded preset: {e}"),
        }
    }
}
