//! Apples: placement, stems, detachment and loose fruit.
//!
//! [`place`] chooses spurs and sizes; [`FruitSet`] puts the fruit into a multibody model, as point
//! bodies on tethers or as bodies on stems that bend and twist; [`FruitLives`] follows every fruit from its stem to the bucket or the ground, by the rules in [`life`]; [`Engine`] moves
//! what is free of stem and hand.

mod apple;
mod bruise;
mod clear;
mod cluster;
mod engine;
pub mod life;
mod lives;
mod obstacle;
mod place;
mod rehang;
mod set;
mod stem;

pub use apple::Fruit;
pub use bruise::{Bruise, Partner, impact_energy};
pub use engine::{Ball, Engine, Impact, Pressing};
pub use life::{
    FruitState, Island, LooseEvent, Phase, RestRule, Resting, Support, Touch, WakeRule, is_gripped,
};
pub use lives::FruitLives;
pub use obstacle::{Obstacle, Shapes};
pub use place::place;
pub use rehang::rehang;
pub use set::{FruitGroups, FruitSet};
pub use stem::{Release, StemLife, StemLoad, least_load};

/// Compiles and runs the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
