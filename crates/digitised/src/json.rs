//! Reads and writes a skeleton as JSON without loss, with a schema version.

use orchard_treegen::{FruitSite, LeafSite, Segment, Skeleton, Spur};
use serde::{Deserialize, Serialize};

use crate::{DigitisedTree, ImportError};

/// Value of the field `format`.
pub const FORMAT: &str = "orchard-skeleton";
/// Version of the schema. It increases when a field changes its meaning or is removed, or when a required field is added.
pub const SCHEMA_VERSION: u32 = 1;

#[derive(Serialize)]
struct Written<'a> {
    format: &'static str,
    schema_version: u32,
    #[serde(flatten)]
    skeleton: &'a Skeleton,
}

/// Header with the version, which is read first, since the rest may differ between versions.
#[derive(Deserialize)]
struct Head {
    format: String,
    schema_version: u32,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Read {
    #[serde(rename = "format")]
    _format: String,
    #[serde(rename = "schema_version")]
    _schema_version: u32,
    segments: Vec<Segment>,
    fruit_sites: Option<Vec<FruitSite>>,
    leaves: Option<Vec<LeafSite>>,
    #[serde(default)]
    spurs: Vec<Spur>,
}

/// Writes a skeleton; [`read`] returns the same bits.
pub fn write(skeleton: &Skeleton) -> String {
    let file = Written { format: FORMAT, schema_version: SCHEMA_VERSION, skeleton };
    let text = serde_json::to_string_pretty(&file);
    text.unwrap_or_else(|e| unreachable!("numbers and lists have a form in JSON: {e}")) + "\n"
}

/// Reads a tree; `fruit_sites`, `leaves` and `spurs` may be missing.
///
/// # Errors
/// A field cannot be read (with line and column), or the content is no valid tree.
pub fn read(text: &str) -> Result<DigitisedTree, ImportError> {
    let head: Head = parse(text)?;
    if head.format != FORMAT {
        return Err(version("format", head.format, FORMAT));
    }
    if head.schema_version != SCHEMA_VERSION {
        return Err(version("schema_version", head.schema_version, SCHEMA_VERSION));
    }
    let Read { segments, fruit_sites, leaves, spurs, .. } = parse(text)?;
    Ok(DigitisedTree::new(segments, fruit_sites, leaves)?.with_spurs(spurs)?)
}

fn version(field: &'static str, found: impl ToString, read: impl ToString) -> ImportError {
    ImportError::Version { field, found: found.to_string(), read: read.to_string() }
}

fn parse<'a, T: Deserialize<'a>>(text: &'a str) -> Result<T, ImportError> {
    let mut json = serde_json::Deserializer::from_str(text);
    let problem = |field: String, problem: String| ImportError::Json { field, problem };
    let value = serde_path_to_error::deserialize(&mut json)
        .map_err(|e| problem(e.path().to_string(), e.inner().to_string()))?;
    json.end().map_err(|e| problem("end of the file".into(), e.to_string()))?;
    Ok(value)
}
