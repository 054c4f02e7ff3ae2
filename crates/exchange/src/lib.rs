//! Skeletons as files of other tools, digitised trees as skeletons, depth images as cameras write them.
//!
//! One module a format; text and bytes go in and out, no file is opened here. `docs/exchange.md` tells what each
//! file holds and what is lost.

pub mod coco;
pub mod depth_png;
pub mod gltf;
pub mod image_png;
pub mod intrinsics;
pub mod json;
pub mod mjcf;
pub mod mtg;
pub mod urdf;
pub mod usd;

mod digitised;
mod wood;

pub use digitised::{DigitisedTree, TreeFault};
pub use wood::Wood;

/// Why a file is no tree.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// A field of a JSON file cannot be read.
    #[error("{field}: {problem}")]
    Json {
        /// Path of the field, such as `segments[3].radius`.
        field: String,
        /// What is wrong, with line and column.
        problem: String,
    },
    /// Written for another reader.
    #[error("{field} is {found}; this version reads {read}")]
    Version {
        /// The field that tells.
        field: &'static str,
        /// Its value.
        found: String,
        /// The value that can be read.
        read: String,
    },
    /// A line of a text file cannot be read.
    #[error("line {line}: {problem}")]
    Line {
        /// Number of the line, from 1.
        line: usize,
        /// What is wrong, with the field and its value.
        problem: String,
    },
    /// The file can be read, but what stands in it is no tree.
    #[error(transparent)]
    Tree(#[from] TreeFault),
}
