//! Reads and writes digitised trees: skeletons in JSON, and multiscale tree graphs (MTG).
//!
//! Functions take and return text or bytes; no file is opened here. `docs/exchange.md` lists the content of each format and its losses.

pub mod json;
pub mod mtg;

mod file;
mod tree;

pub use file::{TreeFile, TreeFormat};
pub use tree::{DigitisedTree, TreeFault};

/// Error of reading a tree.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// A field of a JSON file cannot be read.
    #[error("{field}: {problem}")]
    Json {
        /// Path of the field, such as `segments[3].radius`.
        field: String,
        /// Problem, with line and column.
        problem: String,
    },
    /// The file has another format or schema version.
    #[error("{field} is {found}; this version reads {read}")]
    Version {
        /// Field with the format or version.
        field: &'static str,
        /// Value in the file.
        found: String,
        /// Value that this version reads.
        read: String,
    },
    /// A line of a text file cannot be read.
    #[error("line {line}: {problem}")]
    Line {
        /// Number of the line, from 1.
        line: usize,
        /// Problem, with the field and its value.
        problem: String,
    },
    /// The file can be read, but something that holds for all of it is missing or contradictory.
    #[error("{0}")]
    Whole(String),
    /// The file can be read, but its content is no valid tree.
    #[error(transparent)]
    Tree(#[from] TreeFault),
}

/// Compiles and runs the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
