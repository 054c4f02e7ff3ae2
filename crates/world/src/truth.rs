//! Ground truth of a world, for benchmarks and not for controllers.

use crate::World;
use orchard_fruit::Bruise;
pub use orchard_fruit::FruitState;
use orchard_geometry::Vec3;

/// The truth about one fruit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FruitTruth {
    /// Centre \[m\], world.
    pub p_world: Vec3,
    /// Radius \[m\].
    pub radius: f64,
    /// State.
    pub state: FruitState,
}

impl World {
    /// The truth about every fruit, by fruit index.
    pub fn fruit_truth(&self) -> Vec<FruitTruth> {
        assert!(!self.is_behind(), "wood and fruit are behind the robot");
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
        let on_broken_limb = self.rupture().is_debris(self.fruit().fruit[i].segment);
        self.fruit_lives().state(i, on_broken_limb, self.is_held(i))
    }
}
