//! Record of a controller's beliefs and actions, for a benchmark to score.

use orchard_geometry::Vec3;
use orchard_perception::Sighting;
use serde::{Deserialize, Serialize};

/// Number of an attempt, from 0 in the order of starting.
pub type AttemptId = u32;

/// State of a picker.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum State {
    /// Looks for fruit.
    Scan,
    /// Drives to where the target can be reached.
    Align,
    /// Moves the hand before the target and looks again.
    Reach,
    /// Advances and closes the fingers.
    Grasp,
    /// Withdraws with the fruit.
    Pull,
    /// Carries the fruit over the bucket and lets go.
    Deposit,
    /// Brings the empty hand out of the canopy.
    Retreat,
    /// Stands still with the arm folded until an alarm is over.
    Safe,
}

/// Reason for which an attempt failed, as the controller believes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FailureReason {
    /// There is no stand-off from which the arm reaches the target.
    Unreachable,
    /// The arm stopped short of the pre-grasp posture.
    ReachStalled,
    /// The second look saw no fruit, or the fingers closed on nothing.
    NoFruitAtDetection,
    /// There is no posture for the last stretch.
    GraspUnreachable,
    /// The hand stopped short of the fruit.
    GraspStalled,
    /// The stem held until the end of the pull.
    StemTooStrong,
    /// The fruit left the hand before it was above the bucket.
    Slipped,
    /// The arm pushed the fruit off its stem.
    KnockedOffByArm,
    /// The fruit was let go beside the bucket.
    MissedBucket,
    /// Something held the base or the arm.
    Blocked,
    /// The base did not reach its stand-off in time.
    AlignTimeout,
    /// The episode ended.
    RunEnded,
    /// The camera gave no image that could be used.
    NoSight,
    /// The fingers did not close.
    HandStuck,
    /// A load lay on the arm.
    ArmLoaded,
    /// Other fruit hang in the way of the fingers.
    HemmedIn,
}

/// End of an attempt, as the controller believes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AttemptEnd {
    /// The fruit was let go above the bucket.
    Deposited,
    /// The attempt failed.
    Failed(FailureReason),
}

/// A fault that a controller notices and tells; it acts on it and goes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Alarm {
    /// No image comes.
    CameraSilent,
    /// The camera moves, and its image does not change.
    CameraFrozen,
    /// Images come too late to be placed.
    CameraLate,
    /// Images show nothing.
    CameraBlind,
    /// The odometry's pose went where its velocity does not lead.
    OdometryJump,
    /// The fingers do not close.
    HandStuck,
    /// Something heavy lies on the arm.
    ArmLoaded,
    /// The fruit left the hand on the way to the bucket.
    FruitLost,
    /// A reading of the robot's own sensors is not finite.
    ReadingNotFinite,
}

impl Alarm {
    /// True of the alarms of a camera that gives no image that could be used.
    pub fn is_of_camera(self) -> bool {
        matches!(self, Self::CameraSilent | Self::CameraFrozen | Self::CameraLate | Self::CameraBlind)
    }

    /// True of an alarm that lasts until its end is told; another one tells of a moment.
    pub fn lasts(self) -> bool {
        self.is_of_camera() || matches!(self, Self::HandStuck | Self::ArmLoaded | Self::ReadingNotFinite)
    }
}

/// Reason for which a controller gives no commands any more.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fault {
    /// A number of the network's action is not finite.
    ActionNotFinite,
    /// The network gives no action.
    NoAction,
    /// It needs a target and has none.
    NoTarget,
}

/// An event, with the observation's time \[s\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Event {
    /// A target was committed.
    AttemptStarted {
        /// Time \[s\].
        time: f64,
        /// Attempt.
        id: AttemptId,
        /// Estimated centre of the fruit, odom \[m\].
        p_odom: Vec3,
        /// Estimated radius \[m\].
        radius: f64,
    },
    /// The fingers hold the fruit, as the controller believes.
    Grasped {
        /// Time \[s\].
        time: f64,
        /// Attempt.
        id: AttemptId,
        /// Width between the fingers \[m\].
        width: f64,
    },
    /// The stem has broken, as the controller believes.
    StemGaveWay {
        /// Time \[s\].
        time: f64,
        /// Attempt.
        id: AttemptId,
        /// Largest pull along the withdrawal, from the arm's torques \[N\].
        pull: f64,
    },
    /// The hand goes back from an obstacle that it pressed on.
    Yielded {
        /// Time \[s\].
        time: f64,
        /// Attempt.
        id: AttemptId,
        /// Force on the obstacle, from the arm's torques \[N\].
        force: f64,
    },
    /// The controller's state changed.
    StateChanged {
        /// Time \[s\].
        time: f64,
        /// The new state.
        state: State,
    },
    /// An attempt is over.
    AttemptEnded {
        /// Time \[s\].
        time: f64,
        /// Attempt.
        id: AttemptId,
        /// End of the attempt.
        end: AttemptEnd,
    },
    /// The controller gives no commands any more: from now on the robot holds still.
    GaveUp {
        /// Time \[s\].
        time: f64,
        /// Reason.
        fault: Fault,
    },
    /// The controller notices a fault.
    Alarm {
        /// Time \[s\].
        time: f64,
        /// The fault.
        alarm: Alarm,
    },
    /// A lasting fault is over.
    AlarmEnded {
        /// Time \[s\].
        time: f64,
        /// The fault.
        alarm: Alarm,
    },
}

/// The detections of one depth image, before any tracking.
#[derive(Debug, Clone, PartialEq)]
pub struct ImageReport {
    /// Time of the image \[s\].
    pub time: f64,
    /// Raw detections in the odom frame.
    pub detections: Vec<Sighting>,
}

/// Record of a controller's beliefs and actions.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Record {
    /// Events in the order of time.
    pub events: Vec<Event>,
    /// One report for each image.
    pub images: Vec<ImageReport>,
}
