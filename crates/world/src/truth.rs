//! What a benchmark may ask of a world and a controller may not.

use crate::World;
use orchard_fruit::{Phase, Resting};
use orchard_geometry::Vec3;
use serde::{Deserialize, Serialize};

/// Where a fruit is in its life.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FruitState {
    /// On its stem.
    OnTree,
    /// On its stem, on a broken limb.
    OnBrokenLimb,
    /// Off its stem, between both fingers.
    Held,
    /// Off its stem, in the air or in the bucket but not yet at rest.
    Loose,
    /// In the bucket.
    Deposited,
    /// It has touched the ground.
    Dropped,
}

/// The truth about one fruit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FruitTruth {
    /// Centre [m], world.
    pub p_world: Vec3,
    /// Radius [m].
    pub radius: f64,
    /// Where it is in its life.
    pub state: FruitState,
}

impl World {
    /// The truth about every fruit, by fruit index.
    pub fn fruit_truth(&self) -> Vec<FruitTruth> {
        let fruit = self.fruit();
        (0..fruit.len())
            .map(|i| FruitTruth {
                p_world: self.data().point_p_world[fruit.points[i].index()],
                radius: fruit.fruit[i].radius,
                state: self.fruit_state_of(i),
            })
            .collect()
    }

    fn fruit_state_of(&self, i: usize) -> FruitState {
        let lives = self.fruit_lives();
        match lives.phase(i) {
            Phase::Hanging if self.rupture().is_debris(self.fruit().fruit[i].segment) => {
                FruitState::OnBrokenLimb
            }
            Phase::Hanging => FruitState::OnTree,
            Phase::Asleep(Resting::Bucket(_)) => FruitState::Deposited,
            Phase::Loose if self.is_held(i) => FruitState::Held,
            Phase::Loose if !lives.has_dropped(i) => FruitState::Loose,
            Phase::Loose | Phase::Asleep(Resting::Ground(_)) => FruitState::Dropped,
        }
    }
}
