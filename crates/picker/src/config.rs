//! Config of the baseline picker, which runs controllers `baseline` and `paper`.

use crate::blacklist::BlacklistConfig;
use crate::section::section;
use crate::wires::WiresConfig;
use orchard_quantity::{ConfigError, Count, Quantity, Span, from_table, overlay, parse, with_base};
use orchard_robot::RobotModel;

/// The config of controller `baseline`.
pub const BASELINE_TOML: &str = include_str!("../configs/baseline/picker.toml");
/// The config of controller `paper`; its base is `baseline`.
pub(crate) const PAPER_TOML: &str = include_str!("../configs/paper/picker.toml");

section! {
    /// Config of the baseline picker.
    PickerConfig {
        /// Reading of the sensors.
        sensors: SensorsConfig,
        /// Tree-centre belief.
        belief: BeliefConfig,
        /// Point memory.
        cloud: CloudConfig,
        /// Wires.
        wires: WiresConfig,
        /// Looking for fruit.
        scan: ScanConfig,
        /// Driving.
        drive: DriveConfig,
        /// Choice of the stand-off.
        align: AlignConfig,
        /// Choice of the approach.
        approach: ApproachConfig,
        /// The second look.
        reach: ReachConfig,
        /// Arm motions.
        arm: ArmConfig,
        /// Closing the fingers.
        grasp: GraspConfig,
        /// Touching the fruit with a suction cup.
        suction: SuctionConfig,
        /// Detaching.
        pull: PullConfig,
        /// Letting go.
        deposit: DepositConfig,
        /// Longest durations.
        timeout: TimeoutConfig,
        /// Blacklist of failed targets.
        blacklist: BlacklistConfig,
    }
}

section! {
    /// Reading the sensors.
    SensorsConfig {
        /// Longest gap between observations that is integrated over.
        longest_step: Quantity,
        /// Time for which states of the robot are kept, to place images that come late.
        memory: Quantity,
        /// Takes the base's motion into account in every frame: torques for it and for velocity products are taken off the arm's to find the
        /// force at the hand, and the hand's goal follows it between images.
        base_motion: bool,
    }
}

section! {
    /// Belief of the tree's position.
    BeliefConfig {
        /// Distance straight ahead of the start at which the tree is first believed to be.
        start_distance: Quantity,
        /// Weight of the start belief, in images.
        prior_images: Count,
        /// Largest distance of the tree's points from the believed axis.
        canopy_radius: Quantity,
    }
}

section! {
    /// Memory of seen points.
    CloudConfig {
        /// Number of images kept. 0: none, and nothing is judged by clearance.
        images: Count,
        /// Spacing of the pixels kept, along rows and columns.
        stride: Count,
        /// Farthest depth kept.
        range: Quantity,
        /// Share of valid pixels below which an image counts as blind.
        blind_fraction: Quantity,
        /// Length from which a piece of surface without a step in depth counts as wood. 0: nothing does.
        wood_length: Quantity,
        /// Step in depth that ends a piece, in widths of a cell there.
        wood_step: Quantity,
        /// Most columns of cells over the image's width.
        wood_columns: Count,
        /// Width of the cubes in which wood is remembered beyond the images kept. 0: it is not.
        wood_grid: Quantity,
        /// Number of images that must have shown wood in a cube.
        wood_images: Count,
        /// Drops the tracks of fruit whose place the camera sees through.
        forget_vanished: bool,
    }
}

section! {
    /// A survey posture of the arm.
    PostureConfig {
        /// TCP ahead of the base's centre.
        x: Quantity,
        /// TCP above the ground.
        z: Quantity,
        /// Pitch of the hand's axis, upwards.
        pitch: Quantity,
        /// Yaw of the hand's axis, to the left.
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
        /// Heights above the ground of fruit that is tried.
        height: Span,
        /// Share of an image's pixels that must show the canopy; with fewer the base turns to the believed tree. 0: it never does.
        canopy_share_min: Quantity,
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
        /// Largest difference of bearing that is driven straight.
        orbit_angle: Quantity,
        /// Least distance between base and tree, centre to centre.
        trunk_clearance: Quantity,
        /// Commanded speed above which the base must move.
        stall_command: Quantity,
        /// Speed below which a base that must move counts as held.
        stall_speed: Quantity,
        /// Half-length of the line across its way that the base does not cross again once something has held it there. 0: it forgets.
        wall_half: Quantity,
        /// Distance of that line ahead of the base's centre.
        wall_ahead: Quantity,
        /// Distance by which the base leaves it.
        wall_back: Quantity,
        /// Distance of the base from a row, beside it and past its end, on the way to its other side once nothing is left on this one. 0: it stays.
        row_clearance: Quantity,
        /// Distance from the tree beyond which it turns back on that way.
        row_far: Quantity,
        /// Number of attempts in a row whose failure means that nothing is left on this side.
        row_failures: Count,
    }
}

section! {
    /// Choice of the stand-off.
    AlignConfig {
        /// Distances of the base from the target, best first.
        standoffs: Vec<Quantity>,
        /// Distance at which a place counts as reached.
        position_tolerance: Quantity,
        /// Angle at which a place counts as reached.
        angle_tolerance: Quantity,
        /// Bearings of the base about the target, from straight outwards.
        bearings: Vec<Quantity>,
        /// Number of nearest targets that are planned for before one is chosen.
        candidates: Count,
        /// Cost of one metre of driving, in points in the path.
        drive_cost: Quantity,
        /// Cost of a target that is surely no fruit, in points in the path.
        doubt_cost: Quantity,
        /// Cost of a point where the robot would stand, in points in the path.
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
    /// Choice of the approach.
    ApproachConfig {
        /// Distance of the pre-grasp from the fruit.
        pregrasp: Quantity,
        /// Distance of the second look's TCP from the fruit.
        look: Quantity,
        /// Distance of the TCP beyond the fruit's centre at the grasp.
        overshoot: Quantity,
        /// Longest step between the postures that are checked along the straight approach.
        line_step: Quantity,
        /// Elevations of the approach direction, best first.
        elevations: Vec<Quantity>,
        /// Azimuths of the approach direction from the line base-fruit, best first.
        azimuths: Vec<Quantity>,
        /// Swept volume: half-extent along the hand's x.
        sweep_half_x: Quantity,
        /// Swept volume: half-extent along the hand's y.
        sweep_half_y: Quantity,
        /// Swept volume: end beyond the TCP.
        sweep_tip: Quantity,
        /// Swept volume: length back along the approach.
        sweep_length: Quantity,
        /// Distance from the fruit's surface within which points belong to the fruit.
        fruit_margin: Quantity,
        /// Length of the hand, back from the TCP.
        hand_length: Quantity,
        /// Distance beyond the grasp that the arm must be able to reach from a place of the base, which stops there only roughly.
        reach_margin: Quantity,
        /// Cost of a point between the second look's camera and the fruit, in points in the path.
        hiding_cost: Quantity,
        /// Number of points for which a point of wood counts where the hand would meet it.
        wood_weight: Quantity,
        /// Turns of the hand about its approach axis, best first.
        rolls: Vec<Quantity>,
        /// Open fingers: half-extent along the hand's x, and distance of their outer sides from the approach axis along its y.
        finger_half_x: Quantity,
        finger_outer: Quantity,
        /// Distance from other fruit below which a finger counts as touching it.
        brush_margin: Quantity,
        /// Cost of another fruit that a finger touches on the approach, in points in the path.
        brush_cost: Quantity,
        /// Number of images that must have shown another fruit for it to count.
        neighbour_hits: Count,
        /// Distance from a target within which a sighting is of the target itself, in its radii: two apples side by side are two radii apart.
        same_fruit: Quantity,
        /// Cost of one radian of turning from the preferred direction, in points in the path.
        turn_cost: Quantity,
        /// Cost of one radian of the joint that moves farthest, in points in the path.
        posture_cost: Quantity,
        /// Number of directions within reach that are compared, least cost first.
        candidates: Count,
    }
}

section! {
    /// The second look.
    ReachConfig {
        /// Number of images with the fruit that are averaged. 0: no second look.
        look_images: Count,
        /// Number of images after which the look ends.
        look_images_max: Count,
        /// Number of earlier sightings from which a target is tried even if the second look does not show it.
        trusted_hits: Count,
        /// Largest distance of a detection from the estimate that is taken for the target.
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
        /// Largest joint step between neighbouring points of a line; a larger one means another branch of postures.
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
        /// Least clearance of each open finger from a fruit that is tried; a target beyond it is left.
        clearance: Quantity,
        /// Opening of each finger before.
        opening: Quantity,
        /// Largest force of each finger drive.
        force: Quantity,
        /// Distance from its goal at which a stopped hand closes all the same.
        close_near: Quantity,
        /// Least width between the fingers that counts as a fruit.
        fruit_width_min: Quantity,
        /// Time between closing and pulling.
        settle: Quantity,
        /// Longest closing time.
        close_time: Quantity,
        /// Largest change per frame of a steady gap between the fingers.
        steady_width: Quantity,
        /// Time for which the gap must be steady.
        steady_time: Quantity,
    }
}

section! {
    /// Touching the fruit with a suction cup; without effect for fingers.
    SuctionConfig {
        /// Distance of the lip from the fruit's expected skin at which the cup begins to draw.
        draw: Quantity,
        /// Largest speed of the lip from there on.
        touch_speed: Quantity,
        /// Largest distance of the lip from the line through the fruit's centre with which it goes on there, and lag of the arm to that side at
        /// which the hand slows down on its way.
        lateral_max: Quantity,
    }
}

section! {
    /// Detaching.
    PullConfig {
        /// Longest withdrawal.
        distance: Quantity,
        /// Weight of a frame's force in the running mean of the pull.
        tension_weight: Quantity,
        /// Pull above which the stem counts as taut.
        tension_high: Quantity,
        /// Pull below which a stem that was taut counts as broken.
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
        /// Height of the TCP above the ground when it arrives over the bucket.
        above: Quantity,
        /// Height of the TCP above the ground when it lets go.
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
        /// Reaching.
        reach: Quantity,
        /// Grasping.
        grasp: Quantity,
        /// Pulling.
        pull: Quantity,
        /// Carrying.
        transport: Quantity,
        /// Aligning.
        align: Quantity,
        /// No progress.
        stall: Quantity,
    }
}

impl PickerConfig {
    /// The configs that come with the crate: names of their controllers and TOML texts.
    pub const FILES: &[(&str, &str)] = &[("baseline", BASELINE_TOML), ("paper", PAPER_TOML)];

    /// Reads a config from TOML text; `file` names it in errors. With `base = "NAME"` it holds what differs from that one.
    ///
    /// # Errors
    /// Not TOML, no such base, a field missing or unknown, a value outside its range.
    pub fn from_toml(file: &str, text: &str) -> Result<Self, ConfigError> {
        from_table(file, with_base(file, parse(file, text)?, &text_of, &[])?)
    }

    /// The config of a controller by its name.
    ///
    /// # Errors
    /// There is none of that name; the message lists all names.
    pub fn named(name: &str) -> Result<Self, String> {
        let text = text_of(name)?;
        Self::from_toml(&format!("{name}/picker.toml"), text).map_err(|e| e.to_string())
    }

    /// The config of controller `baseline`.
    ///
    /// # Panics
    /// Never: the embedded file is read in this crate's tests.
    pub fn baseline() -> Self {
        Self::named("baseline").unwrap_or_else(|e| unreachable!("embedded config: {e}"))
    }

    /// The config of controller `paper`.
    ///
    /// # Panics
    /// Never: the embedded file is read in this crate's tests.
    pub(crate) fn of_paper_controller() -> Self {
        Self::named("paper").unwrap_or_else(|e| unreachable!("embedded config: {e}"))
    }
}

impl PickerConfig {
    /// Fits the config to a robot's geometry and lays the robot's figures, table `picker` of its tuning, over it.
    ///
    /// # Errors
    /// An unknown field, or a value outside its range.
    pub(crate) fn tuned(&self, robot: &RobotModel) -> Result<Self, ConfigError> {
        tuned(&self.fitted(robot), robot, "picker")
    }
}

/// Lays a table of a robot's tuning over a config.
///
/// # Errors
/// An unknown field, or a value outside its range.
pub(crate) fn tuned<T>(config: &T, robot: &RobotModel, table: &str) -> Result<T, ConfigError>
where
    T: Clone + serde::Serialize + serde::de::DeserializeOwned,
{
    let file = format!("robot `{}`", robot.articulation().name);
    let error =
        |problem: String| ConfigError { file: file.clone(), field: format!("tuning.{table}"), problem };
    let above = match robot.config().tuning.get(table) {
        None => return Ok(config.clone()),
        Some(toml::Value::Table(above)) => above.clone(),
        Some(_) => return Err(error("must be a table".to_owned())),
    };
    let mut below = toml::Table::try_from(config).map_err(|e| error(e.to_string()))?;
    overlay(&mut below, above, &[]);
    from_table(&format!("{file}: tuning.{table}"), below)
}

/// TOML text of a config by the name of its controller.
pub(crate) fn text_of(name: &str) -> Result<&'static str, String> {
    let found = PickerConfig::FILES.iter().find(|(known, _)| *known == name);
    found.map(|(_, text)| *text).ok_or_else(|| {
        let names: Vec<&str> = PickerConfig::FILES.iter().map(|(known, _)| *known).collect();
        format!("no picker config '{name}'; the configs are: {}", names.join(", "))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_config_holds_what_differs_from_its_base() {
        let baseline = PickerConfig::baseline();
        assert_eq!(PickerConfig::from_toml("x.toml", "base = \"baseline\"").unwrap(), baseline);
        let text = "base = \"baseline\"\n[pull]\n\
                    distance = { value = 0.4, range = [0.0, 1.0], unit = \"m\", source = \"picker\" }";
        let mut longer = PickerConfig::from_toml("x.toml", text).unwrap();
        assert_eq!(longer.pull.distance.si(), 0.4);
        longer.pull.distance = baseline.pull.distance.clone();
        assert_eq!(longer, baseline);
    }

    #[test]
    fn unknown_names_list_all() {
        let configs = "no picker config 'lemon'; the configs are: baseline, paper";
        assert_eq!(PickerConfig::named("lemon").unwrap_err(), configs);
        let e = PickerConfig::from_toml("x.toml", "base = \"lemon\"").unwrap_err();
        assert_eq!(e.to_string(), format!("x.toml: base: {configs}"));
        let e = PickerConfig::from_toml("x.toml", "base = \"paper\"\n[pul]\nx = 3").unwrap_err().to_string();
        assert!(e.starts_with("x.toml: pul: unknown field `pul`"), "{e}");
    }
}
