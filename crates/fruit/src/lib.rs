//! Apples: placement, stems, detachment and loose fruit.
//!
//! [`place`] chooses spurs and sizes; [`FruitSet`] puts the fruit into a multibody model as point
//! bodies on tethers; [`FruitLives`] follows every fruit from its stem to the bucket or the ground; [`Engine`] moves
//! what is free of stem and hand.

mod bruise;
mod clear;
mod engine;
mod lives;
mod obstacle;
mod place;
mod rehang;
mod set;

pub use bruise::{Bruise, Partner, impact_energy};
pub use engine::{Ball, Engine, Impact, Pressing};
pub use lives::{FruitEvent, FruitLives, Phase, RestRule, Resting, Touch};
pub use obstacle::{Obstacle, Shapes};
pub use place::{Fruit, place};
pub use rehang::rehang;
pub use set::{FruitGroups, FruitSet};
