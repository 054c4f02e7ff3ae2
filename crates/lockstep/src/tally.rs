//! Counts of frames by the place where they were computed.

use std::collections::BTreeMap;

use orchard_world::Stay;
use serde::{Deserialize, Serialize};

/// Place where a frame is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Where {
    /// On the device.
    Device,
    /// In f64, for a reason of the world.
    Here(Stay),
    /// In f64, since the tree is larger than the lanes.
    TooLarge,
    /// In f64, since the device cannot step such a world.
    Refused,
    /// In f64, since a fruit has come off or into the hand, or wood has broken, in the midst of a span.
    Changed,
}

impl Where {
    /// Name in results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Device => "device",
            Self::Here(stay) => stay.name(),
            Self::TooLarge => "large_tree",
            Self::Refused => "refused",
            Self::Changed => "came_off",
        }
    }
}

/// Numbers of frames by the place where they were computed, and of contacts that the device left out.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Tally {
    /// Frames by the name of the place ([`Where::name`]).
    pub frames: BTreeMap<String, u64>,
    /// Frames on the device after which only the robot was brought here ([`orchard_world::World::is_behind`]).
    #[serde(default)]
    pub calm: u64,
    /// Frames on the device in which fruit off their stems and out of the hand were moved by the processor.
    #[serde(default)]
    pub free_fruit: u64,
    /// Pairs of colliders, and contact points, for which the device had no room.
    pub contacts_lost: u64,
    /// Contact solves that did not converge on the device.
    pub contacts_unsolved: u64,
}

impl Tally {
    /// Counts frames by their places, each with the number of them.
    pub(crate) fn count(&mut self, places: impl Iterator<Item = (Where, usize)>) {
        let mut counts: BTreeMap<Where, u64> = BTreeMap::new();
        for (place, frames) in places {
            *counts.entry(place).or_default() += frames as u64;
        }
        for (place, count) in counts {
            *self.frames.entry(place.name().to_owned()).or_default() += count;
        }
    }

    /// Adds the counts of others.
    #[must_use]
    pub fn with(mut self, others: &Self) -> Self {
        for (name, frames) in &others.frames {
            *self.frames.entry(name.clone()).or_default() += frames;
        }
        self.calm += others.calm;
        self.free_fruit += others.free_fruit;
        self.contacts_lost += others.contacts_lost;
        self.contacts_unsolved += others.contacts_unsolved;
        self
    }

    /// Adds frames of worlds that the device cannot step.
    #[must_use]
    pub(crate) fn with_refused(mut self, frames: u64) -> Self {
        if frames > 0 {
            *self.frames.entry(Where::Refused.name().to_owned()).or_default() += frames;
        }
        self
    }

    /// Number of all frames.
    pub fn total(&self) -> u64 {
        self.frames.values().sum()
    }

    /// Share of the frames that the device computed; 0 without frames.
    pub fn share_on_device(&self) -> f64 {
        let on_device = self.frames.get(Where::Device.name()).copied().unwrap_or(0);
        on_device as f64 / self.total().max(1) as f64
    }
}
