//! Data sets: images of trees from all sides with ground truth.
//!
//! recipe -> trees (world at rest, views, files, one record per tree) -> annotations, poses, manifest. Recipe, records and manifest
//! carry checksums; the records and the manifest hold those of the other files. `docs/dataset.md` describes the files.

mod config;
mod error;
mod folder;
mod recipe;
mod record;
mod run;
mod tables;
#[cfg(test)]
mod tests;
mod tree;

pub use config::{DatasetConfig, PAPER_TOML};
pub use error::DatasetError;
pub use folder::Folder;
pub use recipe::{Plan, Recipe, Seeds};
pub use run::{Done, NoProgress, Progress, run};
pub use tables::{CLASSES, Class, NO_INSTANCE};
pub use tree::view_name;
