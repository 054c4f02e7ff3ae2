//! Counts of the damage that a robot does: snapped branches, dropped fruit, torn spurs.

use orchard_world::{Release, WorldEvent};
use serde::{Deserialize, Serialize};

use crate::rules::CostRules;

/// Damage by kind.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Damage {
    /// Joints of the tree that broke.
    pub branches_snapped: u32,
    /// Falls of fruit to the ground.
    pub fruit_dropped: u32,
    /// Spurs that tore off with their fruit.
    pub spurs_torn: u32,
}

impl Damage {
    pub(crate) fn take(&mut self, events: &[WorldEvent]) {
        for event in events {
            match event {
                WorldEvent::BranchSnapped { .. } => self.branches_snapped += 1,
                WorldEvent::FruitDropped { .. } => self.fruit_dropped += 1,
                WorldEvent::FruitDetached { release: Some(Release::Spur), .. } => self.spurs_torn += 1,
                _ => {}
            }
        }
    }

    pub(crate) fn cost(&self, rules: &CostRules) -> f64 {
        f64::from(self.branches_snapped) * rules.branch_snapped.si()
            + f64::from(self.fruit_dropped) * rules.fruit_dropped.si()
            + f64::from(self.spurs_torn) * rules.spur_torn.si()
    }
}
