//! Apples: placement, stems, detachment and loose fruit.
//!
//! [`place`] chooses spurs and sizes; [`FruitSet`] puts the fruit into a multibody model as point
//! bodies on tethers; [`FruitLives`] follows every fruit from its stem to the bucket or the ground.

mod clear;
mod lives;
mod place;
mod rehang;
mod set;

pub use lives::{FruitEvent, FruitLives, Phase, RestRule, Resting, Touch};
pub use place::{Fruit, place};
pub use rehang::rehang;
pub use set::{FruitGroups, FruitSet};
