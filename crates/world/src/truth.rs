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

    /// The paper's reachability of every fruit where it hung at the start: its centre lies within the arm's
    /// reach sphere from an admissible stand-off. The nearest stand-off reaches highest and lowest, so a fruit
    /// is reachable if |z - z_shoulder|^2 <= R^2 - d_min^2. On flat ground the base can take that stand-off
    /// from the canopy's outside for every fruit.
    pub fn reachable(&self) -> Vec<bool> {
        let spec = &self.spec().episode;
        let (reach, (nearest, _)) = (spec.reach_radius.si(), spec.stand_off.si());
        let half_height_squared = reach * reach - nearest * nearest;
        let z_shoulder = self.shoulder_height();
        self.fruit()
            .fruit
            .iter()
            .map(|f| {
                let dz = f.p_hang_world.z - z_shoulder;
                dz * dz <= half_height_squared
            })
            .collect()
    }
}
