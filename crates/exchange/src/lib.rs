//! Reads and writes files of other tools: trees, multibody models, depth images, intrinsics and annotations.
//!
//! There is one module a format; those of digitised trees are `orchard-digitised`'s. Functions take and return text or bytes; no file is opened here. `docs/exchange.md` lists the
//! content of each format and its losses.

pub mod coco;
pub mod colour_image;
pub mod depth_image;
pub mod depth_png;
#[cfg(feature = "gltf")]
pub mod gltf;
pub mod image_png;
pub mod intrinsics;
pub mod mjcf;
pub mod regions;
pub mod urdf;
pub mod usd;

mod wood;
mod yaml;

pub use orchard_digitised::{DigitisedTree, ImportError, TreeFault, json, mtg};
pub use wood::Wood;
