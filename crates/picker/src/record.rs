//! What a controller believed and did, for a benchmark to score.

use orchard_geometry::Vec3;
use orchard_perception::Sighting;
use serde::{Deserialize, Serialize};

/// Number of an attempt, from 0 in the order of starting.
pub type AttemptId = u32;

/// What the picker is doing.
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
}

/// Why an attempt failed, as the controller believes it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FailureReason {
    /// No stand-off from which the arm reaches the target.
    Unreachable,
    /// The arm stopped short of the pre-grasp posture.
    ReachStalled,
    /// The second look saw no fruit, or the fingers closed on nothing.
    NoFruitAtDetection,
    /// No posture for the last stretch.
    GraspUnreachable,
    /// The hand stopped short of the fruit.
    GraspStalled,
    /// The stem held until the pull's end.
    StemTooStrong,
    /// The fruit left the hand before it was over the bucket.
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
}

/// How an attempt ended, as the controller believes it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AttemptEnd {
    /// The fruit was let go over the bucket.
    Deposited,
    /// The attempt failed.
    Failed(FailureReason),
}

/// Something that happened, with the observation's time [s].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Event {
    /// A target was committed.
    AttemptStarted {
        /// Time [s].
        time: f64,
        /// Attempt.
        id: AttemptId,
        /// Estimated centre of the fruit, odom [m].
        p_odom: Vec3,
        /// Estimated radius [m].
        radius: f64,
    },
    /// The fingers hold something that the controller takes for the fruit.
    Grasped {
        /// Time [s].
        time: f64,
        /// Attempt.
        id: AttemptId,
        /// Width between the fingers [m].
        width: f64,
    },
    /// The controller takes the stem as given way.
    StemGaveWay {
        /// Time [s].
        time: f64,
        /// Attempt.
        id: AttemptId,
        /// Largest pull along the withdrawal that the arm's torques told [N].
        pull: f64,
    },
    /// The hand goes back from what it pressed on.
    Yielded {
        /// Time [s].
        time: f64,
        /// Attempt.
        id: AttemptId,
        /// Force that the arm's torques told [N].
        force: f64,
    },
    /// The controller's state changed.
    StateChanged {
        /// Time [s].
        time: f64,
        /// The new state.
        state: State,
    },
    /// An attempt is over.
    AttemptEnded {
        /// Time [s].
        time: f64,
        /// Attempt.
        id: AttemptId,
        /// How it ended.
        end: AttemptEnd,
    },
}

/// The detections of one depth image, before any tracking.
#[derive(Debug, Clone, PartialEq)]
pub struct ImageReport {
    /// Time of the image [s].
    pub time: f64,
    /// Raw detections in the odom frame.
    pub detections: Vec<Sighting>,
}

/// What a controller believed and did.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Record {
    /// Events in the order of time.
    pub events: Vec<Event>,
    /// One report an image.
    pub images: Vec<ImageReport>,
}
