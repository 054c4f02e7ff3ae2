//! The record of one world's episode, as written to `episodes/*.json`.
//!
//! All fields are a function of (code version, config, seed, world, repeat, horizon); none depends on a clock or the machine.

mod events;

pub use events::{AlarmTime, DepositEvent, DetachEvent, FruitMoment, SnapEvent};

use orchard_bench::record::Record;
use orchard_scenario::Names;
use orchard_world::Release;
use serde::{Deserialize, Serialize};

use crate::backend::Backend;
use crate::harvest::interface::GaveUp;
use crate::zones::{Zone, ZoneFrame, ZoneTable};

/// Key of an episode: all inputs that determine it. A stored episode is reused only if all of them are equal.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct EpisodeKey {
    /// [`orchard_bench::SCHEMA_VERSION`].
    pub schema_version: u32,
    /// [`orchard_bench::CODE_VERSION`].
    pub code_version: String,
    /// SHA-256 over scenario and protocol, hexadecimal.
    pub config_hash: String,
    /// Names of world, robot, camera, detector and controller.
    #[serde(flatten)]
    pub scenario: Names,
    /// Condition of the benchmark matrix.
    pub condition: String,
    /// Seed.
    pub seed: u64,
    /// World index under the seed.
    pub world: u32,
    /// Repeat number, from 0: each repeat has another start pose of the robot.
    pub repeat: u32,
    /// Time budget \[frames\].
    pub horizon_frames: u32,
    /// Backend that moved the world; left out for the processor. On a graphics device it moves in f32: such an episode is no episode of a leaderboard.
    #[serde(default, skip_serializing_if = "Backend::is_cpu")]
    pub backend: Backend,
}

/// Outcome of an episode.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "status", rename_all = "snake_case")]
pub enum Outcome {
    /// The time budget was used up.
    BudgetSpent,
    /// No reachable fruit was left on the tree.
    AllReachablePicked,
    /// The robot did not move for too long.
    Stalled,
    /// The world left its plausible state; it counts as zero harvest.
    Quarantined {
        /// Problem.
        reason: String,
    },
}

pub use orchard_world::truth::FruitState;

/// One fruit's truth.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FruitRecord {
    /// Index of the fruit in its world.
    pub id: u32,
    /// Centre at the start \[m, world\].
    pub p_world: [f64; 3],
    /// Radius \[m\].
    pub radius: f64,
    /// True if it lay inside the reach sphere at the start.
    pub reachable: bool,
    /// Zone at the start; null if no fruit is reachable.
    pub zone: Option<Zone>,
    /// State at the end.
    pub final_state: FruitState,
}

/// A state that the controller entered.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StateTime {
    /// Name of the state.
    pub state: String,
    /// Time at which it was entered \[s\].
    pub time: f64,
}

/// Outcome of an attempt.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AttemptOutcome {
    /// A fruit that the fingers last held in this attempt came to rest in the bucket.
    Placed,
    /// No such fruit came to rest in the bucket.
    Failed,
}

/// One attempt: from the commitment to a target until the controller ended it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AttemptRecord {
    /// Index in the episode.
    pub id: u32,
    /// Frame of the commitment.
    pub start_frame: u32,
    /// Frame at which the controller ended it, or the episode's last.
    pub end_frame: u32,
    /// Time of the commitment \[s\].
    pub start_time: f64,
    /// Time of the end \[s\].
    pub end_time: f64,
    /// Committed target \[m, odom\].
    pub p_odom_target: [f64; 3],
    /// Fruit on the tree within one radius of the target at the commitment; null for a false detection.
    pub fruit: Option<u32>,
    /// Zone of that fruit at the start of the episode; without a fruit, zone of the target.
    pub zone: Option<Zone>,
    /// Outcome by the world's truth.
    pub outcome: AttemptOutcome,
    /// Reason why it failed; null when placed.
    pub failure_reason: Option<String>,
    /// Fruit held between both fingers, in the order of their grips.
    pub gripped: Vec<u32>,
    /// Fruit that came off its stem while held, from the start of this attempt up to the next one.
    pub detached: Vec<u32>,
    /// Held fruit that came to rest in the bucket, then or later.
    pub placed: Vec<u32>,
    /// Duration of a placed attempt \[s\]; null when failed.
    pub cycle_time: Option<f64>,
    /// States that the controller went through.
    pub states: Vec<StateTime>,
    /// Belief of the controller.
    pub belief: Belief,
    /// Intervals in which a detached fruit was between both fingers.
    pub held: Vec<HeldFruit>,
    /// Fruit that was knocked off from the start of this attempt up to the next one.
    pub knocked_off: Vec<KnockedOff>,
    /// Wood that broke, up to the next attempt.
    pub snapped: Vec<AttemptSnap>,
    /// Largest stem force during the attempt \[N\].
    pub max_stem_pull_n: Option<f64>,
    /// Largest sum of normal forces on one finger \[N\], at the ends of frames.
    pub max_finger_force_n: Option<f64>,
    /// Largest sum of contact forces on the hand \[N\], at the ends of frames.
    pub max_wrist_force_n: Option<f64>,
}

/// Belief of the controller about an attempt, and the truth about its target.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Belief {
    /// Radius of the target \[m\].
    pub radius_m: f64,
    /// Truth: the hanging fruit nearest to the target at the commitment; null if none hung.
    pub nearest_fruit: Option<u32>,
    /// Truth: distance from the target to its centre \[m\].
    pub nearest_distance_m: Option<f64>,
    /// Time at which the controller judged that the fruit was between its fingers \[s\].
    pub grasp_time: Option<f64>,
    /// Width between the fingers at that time \[m\].
    pub grasp_width_m: Option<f64>,
    /// Time at which the controller judged that the stem had given way \[s\].
    pub stem_time: Option<f64>,
    /// Largest pull that it had estimated by then \[N\].
    pub pull_n: Option<f64>,
    /// Retreats of the controller after contacts of the hand.
    pub yielded: Vec<Yielding>,
    /// Outcome that the controller reported: `deposited` or a reason; null if it did not end the attempt.
    pub end: Option<String>,
}

/// One retreat of the controller after a contact of the hand.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Yielding {
    /// Time \[s\].
    pub time: f64,
    /// Force that the controller felt \[N\].
    pub force_n: Option<f64>,
}

/// End of an interval in which the fingers held a fruit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum HeldEnd {
    /// The fruit is still between the fingers.
    InHand,
    /// The command had opened the fingers wider than the fruit.
    LetGo,
    /// The fruit left the fingers although they were commanded closed.
    Lost,
}

/// An interval in which a detached fruit was between both fingers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HeldFruit {
    /// The fruit.
    pub fruit: u32,
    /// First frame.
    pub from_frame: u32,
    /// Last frame.
    pub to_frame: u32,
    /// End of the interval.
    pub end: HeldEnd,
}

/// A fruit that came off its stem without being held.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct KnockedOff {
    /// The fruit.
    pub fruit: u32,
    /// Time \[s\].
    pub time: f64,
    /// State of the controller.
    pub state: Option<String>,
}

/// Wood that broke during an attempt.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AttemptSnap {
    /// Segment whose base joint broke.
    pub segment: u32,
    /// Time \[s\].
    pub time: f64,
    /// State of the controller.
    pub state: Option<String>,
}

/// Outcome of a contact attempt, by the truth of the world.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ContactOutcome {
    /// The fruit came off its stem and to rest in the bucket.
    Placed,
    /// The fruit still hung when the attempt closed.
    LeftOnTree,
    /// The fruit came off its stem, both fingers never pressed on it in the attempt, and it did not come to rest in the bucket.
    KnockedOff,
    /// The fruit was gripped and came off its stem, and left the fingers, but did not come to rest in the bucket.
    Dropped,
    /// The episode ended while the attempt was open.
    RunEnded,
}

impl ContactOutcome {
    /// Name in records and summaries.
    pub fn name(self) -> &'static str {
        match self {
            Self::Placed => "placed",
            Self::LeftOnTree => "left_on_tree",
            Self::KnockedOff => "knocked_off",
            Self::Dropped => "dropped",
            Self::RunEnded => "run_ended",
        }
    }
}

/// One contact attempt: the contacts of the fingers with one fruit, from the first until the fruit is released, or until no finger
/// has touched it for `rules.contact_gap`. It depends on the world alone; the controller declares nothing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ContactAttemptRecord {
    /// The fruit.
    pub fruit: u32,
    /// First frame in which a finger pressed on it.
    pub start_frame: u32,
    /// Last frame in which one did.
    pub end_frame: u32,
    /// Time of the first contact \[s\].
    pub start_time: f64,
    /// Time of the last contact \[s\].
    pub end_time: f64,
    /// True if both fingers pressed on it at once.
    pub gripped: bool,
    /// True if its stem gave way before the attempt closed.
    pub detached: bool,
    /// Outcome.
    pub outcome: ContactOutcome,
}

/// Sums over the depth images of an episode.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct DetectionTally {
    /// Images for which the controller reported its detections, even if there were none.
    pub images: u32,
    /// Detections matched to a fruit.
    pub true_positives: u32,
    /// Detections without a matched fruit.
    pub false_positives: u32,
    /// Visible fruit.
    pub visible: u32,
    /// Visible fruit matched to a detection.
    pub recalled: u32,
}

/// One world's episode.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EpisodeRecord {
    /// Key: all inputs that determine the episode.
    #[serde(flatten)]
    pub key: EpisodeKey,
    /// Outcome of the episode.
    pub outcome: Outcome,
    /// Frames stepped.
    pub frames: u32,
    /// Simulated time \[s\].
    pub duration_s: f64,
    /// Fruit on the tree at the start.
    pub fruit_total: u32,
    /// Fruit inside the reach sphere at the start.
    pub reachable_count: u32,
    /// Their indices.
    pub reachable: Vec<u32>,
    /// Number of reachable fruit confirmed by inverse kinematics; null if not computed.
    pub reachable_ik_count: Option<u32>,
    /// Zone frame; null if no fruit is reachable.
    pub zone_frame: Option<ZoneFrame>,
    /// Reachable fruit by zone.
    pub zone_census: ZoneTable<u32>,
    /// Every fruit.
    pub fruit: Vec<FruitRecord>,
    /// Every attempt that the controller declared.
    pub attempts: Vec<AttemptRecord>,
    /// Every contact attempt, by its first frame.
    pub contact_attempts: Vec<ContactAttemptRecord>,
    /// Ruptures.
    pub branches_snapped: Vec<SnapEvent>,
    /// Fruit that came off its stem.
    pub fruit_detached: Vec<DetachEvent>,
    /// Fruit that came off its stem, by any cause, without a grip before in the contact attempt that was open, if one was.
    pub fruit_knocked_off: Vec<FruitMoment>,
    /// Fruit that came to rest in the bucket.
    pub fruit_deposited: Vec<DepositEvent>,
    /// Fruit that reached the ground.
    pub fruit_dropped: Vec<FruitMoment>,
    /// Fruit that the suction cup lost its seal on with the valve open; left out where there is none, as without a cup.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub seals_lost: Vec<FruitMoment>,
    /// Fruit that left the field with an exchanged bucket; left out where there is none, as under rules without an exchange.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub fruit_taken_away: Vec<FruitMoment>,
    /// Counts of the detector against truth.
    pub detection: DetectionTally,
    /// Largest stem force of the episode \[N\]; null if it was not finite.
    pub max_stem_pull_n: Option<f64>,
    /// When and why the controller gave up; left out if it did not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gave_up: Option<GaveUp>,
    /// Faults that the controller noticed, in the order of their beginnings; left out if there were none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub alarms: Vec<AlarmTime>,
    /// SHA-256, hexadecimal, of what moved the robot and what the controller logged: of the command log before compression, whether a log
    /// was written or not. Null for a world that could not be built.
    pub commands_sha256: Option<String>,
}

impl Record for EpisodeRecord {
    type Key = EpisodeKey;

    const FOLDER: &'static str = "episodes";
    const OPTIONAL: &'static [&'static str] = &["backend"];

    fn key(&self) -> &EpisodeKey {
        &self.key
    }

    fn file(key: &EpisodeKey) -> String {
        let EpisodeKey { scenario: Names { controller, .. }, condition, seed, world, repeat, .. } = key;
        match repeat {
            0 => format!("{controller}-{condition}-{seed}-{world:03}.json"),
            repeat => format!("{controller}-{condition}-{seed}-{world:03}-r{repeat}.json"),
        }
    }
}

impl AttemptRecord {
    /// Total time in each state up to the end of the attempt \[s\], in the order of the first entry.
    pub fn state_durations(&self) -> Vec<(String, f64)> {
        let mut durations: Vec<(String, f64)> = Vec::new();
        for (i, entered) in self.states.iter().enumerate() {
            let left = self.states.get(i + 1).map_or(self.end_time, |next| next.time);
            let time = left - entered.time;
            match durations.iter_mut().find(|(state, _)| *state == entered.state) {
                Some((_, sum)) => *sum += time,
                None => durations.push((entered.state.clone(), time)),
            }
        }
        durations
    }
}

impl EpisodeRecord {
    /// True if the world was quarantined.
    pub fn quarantined(&self) -> bool {
        matches!(self.outcome, Outcome::Quarantined { .. })
    }

    /// Fruit in the bucket at the end; none in a quarantined world.
    pub fn deposited(&self) -> impl Iterator<Item = &FruitRecord> {
        let counts = !self.quarantined();
        self.fruit.iter().filter(move |f| counts && f.final_state == FruitState::Deposited)
    }

    /// Deposits; none in a quarantined world.
    pub fn deposits(&self) -> impl Iterator<Item = &DepositEvent> {
        let counts = !self.quarantined();
        self.fruit_deposited.iter().filter(move |_| counts)
    }

    /// Stem-pulled fruit; none in a quarantined world, whose forces are invalid.
    pub fn stem_pulled(&self) -> impl Iterator<Item = &DetachEvent> {
        let counts = !self.quarantined();
        self.fruit_detached.iter().filter(move |event| counts && event.stem_pulled)
    }

    /// Stem tensions at which held fruit came off \[N\]; none in a quarantined world, whose forces are invalid.
    pub fn detach_tensions(&self) -> Vec<f64> {
        self.picked().filter_map(|event| event.tension_n).collect()
    }

    /// Those tensions, each as a share of its stem's strength in a straight pull.
    pub fn detach_shares(&self) -> Vec<f64> {
        self.picked().filter_map(|event| Some(event.tension_n? / event.strength_n?)).collect()
    }

    /// Held fruit that came off; none in a quarantined world.
    fn picked(&self) -> impl Iterator<Item = &DetachEvent> {
        let knocked_off = |fruit: u32| self.fruit_knocked_off.iter().any(|event| event.fruit == fruit);
        let counts = !self.quarantined();
        self.fruit_detached.iter().filter(move |event| counts && !knocked_off(event.fruit))
    }

    /// Fruit that came off with their spurs; none in a quarantined world.
    pub fn spurs_torn(&self) -> impl Iterator<Item = &DetachEvent> {
        let counts = !self.quarantined();
        self.fruit_detached.iter().filter(move |event| counts && event.release == Some(Release::Spur))
    }

    /// Deposited fruit with a bruise.
    pub fn bruised(&self) -> impl Iterator<Item = &DepositEvent> {
        self.deposits().filter(|event| event.bruised == Some(true))
    }

    /// Fruit that at the end is off its stem and neither at rest in the bucket nor in the hand.
    pub fn dropped(&self) -> impl Iterator<Item = &FruitRecord> {
        self.fruit.iter().filter(|f| matches!(f.final_state, FruitState::Dropped | FruitState::Loose))
    }

    /// Contact attempts that count as placed; none in a quarantined world.
    pub fn placed_by_contact(&self) -> impl Iterator<Item = &ContactAttemptRecord> {
        let counts = !self.quarantined();
        self.contact_attempts.iter().filter(move |a| counts && a.outcome == ContactOutcome::Placed)
    }

    /// Attempts that count as placed; none in a quarantined world.
    pub fn placed(&self) -> impl Iterator<Item = &AttemptRecord> {
        let counts = !self.quarantined();
        self.attempts.iter().filter(move |a| counts && a.outcome == AttemptOutcome::Placed)
    }
}
