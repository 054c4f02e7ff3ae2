//! What a benchmark may ask of a world and a controller may not.

use crate::World;
use orchard_fruit::{Bruise, Phase};
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
    /// Off its stem, in the air or in the bucket but not yet at rest; or lying on the robot beside the bucket.
    Loose,
    /// In the bucket, where it has come to rest.
    Deposited,
    /// It has touched the ground, and not come to rest in the bucket since.
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

    /// The hardest impact and squeeze that a fruit has met.
    pub fn fruit_bruise(&self, fruit: usize) -> Bruise {
        self.fruit_lives().bruise(fruit)
    }

    fn fruit_state_of(&self, i: usize) -> FruitState {
        let lives = self.fruit_lives();
        match lives.phase(i) {
            Phase::Hanging if self.rupture().is_debris(self.fruit().fruit[i].segment) => {
                FruitState::OnBrokenLimb
            }
            Phase::Hanging => FruitState::OnTree,
            _ if self.is_held(i) => FruitState::Held,
            _ if lives.is_deposited(i) => FruitState::Deposited,
            _ if lives.has_dropped(i) => FruitState::Dropped,
            _ => FruitState::Loose,
        }
    }
}
