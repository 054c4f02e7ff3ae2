//! Interfaces of the world and the controller of an episode.
//!
//! The benchmark has access to the truth ([`BenchWorld`]); the controller gets only [`Observation`]s and reports its beliefs
//! ([`ControllerEvent`]).

use orchard_geometry::{Pose, Vec3};
use orchard_robot::io::{Command, Observation};
use orchard_world::WorldEvent;
use serde::{Deserialize, Serialize};

/// A world with access to the truth. Indices of fruit and segments do not change during an episode.
pub trait BenchWorld {
    /// Reads the sensors. Called once before every step.
    fn observe(&mut self) -> Observation;
    /// Advances one frame under a command.
    fn step(&mut self, command: &Command);
    /// Returns the events of the last step, in order, and clears them.
    fn drain_events(&mut self) -> Vec<WorldEvent>;
    /// Every fruit, by index.
    fn fruit(&self) -> Vec<FruitTruth>;
    /// Fruit in the last depth image that an observation delivered.
    fn visible_fruit(&self) -> Vec<VisibleFruit>;
    /// Pose of the odom frame in the world.
    fn x_world_odom(&self) -> Pose;
    /// True if each fruit lies inside the arm's reach sphere from an admissible stand-off, now.
    fn reachable(&self) -> Vec<bool>;
    /// Number of fruit confirmed as reachable by inverse kinematics, if computed.
    fn reachable_ik_count(&self) -> Option<u32> {
        None
    }
    /// Largest stem force over all fruit and all substeps of the last step \[N\].
    fn peak_stem_pull(&self) -> f64;
    /// Contact forces on the hand in the last substep of the last step.
    fn hand_forces(&self) -> HandForces {
        HandForces::default()
    }
    /// Largest impact energy of a fruit so far \[J\], if recorded.
    fn fruit_bruise(&self, fruit: u32) -> Option<f64> {
        let _ = fruit;
        None
    }
    /// Bruised volume of a fruit so far \[m^3\], if the world's config has a law of it.
    fn bruise_volume(&self, fruit: u32) -> Option<f64> {
        let _ = fruit;
        None
    }
    /// Strength of a fruit's stem in a straight pull \[N\], if the world tells it.
    fn stem_strength(&self, fruit: u32) -> Option<f64> {
        let _ = fruit;
        None
    }
    /// True if the joint at a segment's base breaks at the union of two axes, not in the branch's own section.
    fn breaks_at_union(&self, segment: u32) -> bool {
        let _ = segment;
        false
    }
    /// Reason of the world's quarantine, if its state is no longer plausible.
    fn quarantine(&self) -> Option<String>;
}

/// Contact forces on the hand.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct HandForces {
    /// The larger of the two fingers' sums of normal forces \[N\].
    pub finger: f64,
    /// Norm of the sum of all contact forces on hand and fingers, as measured by a wrist force sensor \[N\].
    pub wrist: f64,
}

pub use orchard_world::truth::FruitTruth;

/// A fruit in a depth image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct VisibleFruit {
    /// The fruit.
    pub fruit: u32,
    /// Pixels with a valid depth.
    pub pixels: u32,
}

/// A harvest controller.
pub trait BenchController {
    /// Returns the command for the next frame.
    fn act(&mut self, observation: &Observation) -> Command;
    /// Tells when the run ends, on the clock of the observations \[s\]; called once, before the first frame.
    fn run_ends_at(&mut self, time: f64) {
        let _ = time;
    }
    /// Returns the events that the controller logged during the last call of [`BenchController::act`], in order.
    fn drain_log(&mut self) -> Vec<ControllerEvent>;
}

/// When and why a controller gave up.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GaveUp {
    /// Time \[s\].
    pub time: f64,
    /// Reason.
    pub fault: String,
}

/// Event in the log of a controller.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum ControllerEvent {
    /// The controller committed to a target.
    AttemptStarted {
        /// Believed fruit centre \[m, odom\].
        p_odom_target: Vec3,
        /// Believed radius \[m\].
        radius: f64,
    },
    /// The controller judged that the fruit is between the fingers.
    Grasped {
        /// Width between the fingers \[m\].
        width: f64,
    },
    /// The controller judged that the stem has given way.
    StemGaveWay {
        /// Largest pull that the controller estimated \[N\].
        pull: f64,
    },
    /// The controller retreats from contact with the hand.
    Yielded {
        /// Force that it felt \[N\].
        force: f64,
    },
    /// The controller entered a state.
    StateChanged {
        /// The state's name.
        state: String,
    },
    /// The controller ended the current attempt.
    AttemptEnded {
        /// Reason why the attempt failed; `None` if the controller reports that the fruit was placed.
        failure: Option<String>,
    },
    /// The controller gives no commands any more, and the robot holds still from now on.
    GaveUp {
        /// Reason, by the name of [`orchard_picker::Fault`].
        fault: String,
    },
    /// The controller evaluated the observation's depth image.
    Detected {
        /// Centres of all detections in that image \[m, odom\].
        p_odom: Vec<Vec3>,
        /// Their radii \[m\].
        radius: Vec<f64>,
    },
    /// The controller noticed a fault.
    Alarm {
        /// Fault, by the name of [`orchard_picker::Alarm`].
        alarm: String,
    },
    /// A lasting fault is over, as the controller notices.
    AlarmEnded {
        /// Fault, by the name of [`orchard_picker::Alarm`].
        alarm: String,
    },
}
