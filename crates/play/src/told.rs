//! The figures that a page tells.

use orchard_picker::State;
use serde::Serialize;

/// Figures of the present state.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Told {
    /// Frames since the start.
    pub frame: u32,
    /// Time since the start \[s\].
    pub time: f64,
    /// Frames in a second \[Hz\].
    pub frame_rate: f64,
    /// The foliage dial of this world.
    pub foliage: f64,
    /// Fruit on their stems.
    pub hanging: u32,
    /// Fruit at rest in the bucket.
    pub picked: u32,
    /// Fruit that touched the ground.
    pub dropped: u32,
    /// Branches that snapped.
    pub snapped: u32,
    /// Place of the robot's base \[m\], world.
    pub p_world_base: [f64; 3],
    /// State of the controller; `None` before its first, or without a controller.
    pub state: Option<State>,
    /// Pull of the hand; `None` while it holds nothing.
    pub pull: Option<Pull>,
    /// Reason why the world stands still; `None` while it runs.
    pub fault: Option<String>,
}

/// Pull of the hand.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Pull {
    /// Grabbed place \[m\], world.
    pub p_world: [f64; 3],
    /// Place to which the hand pulls \[m\], world.
    pub p_world_target: [f64; 3],
    /// Force in the last frame \[N\].
    pub force: f64,
}
