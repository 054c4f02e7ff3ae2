//! Apple trees grown by parametric L-systems.
//!
//! config + seed -> grammar -> turtle -> pipe model -> clearance -> rescale -> [`Skeleton`].

mod skeleton;

pub use skeleton::{FruitSite, LeafSite, Segment, Skeleton};
