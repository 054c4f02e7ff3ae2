//! Apples: placement, stems, detachment and loose fruit.
//!
//! [`place`] chooses spurs and sizes; [`FruitSet`] puts the fruit into a multibody model as point
//! bodies on tethers; [`FruitState`] follows every fruit from its stem to the bucket or the ground.

mod place;
mod set;
mod state;

pub use place::{Fruit, place};
pub use set::{FruitGroups, FruitSet};
pub use state::{FruitEvent, FruitState, Phase, RestRule, Resting, Touch};
