//! Versions that every result names.

/// Version of the layout of every result file.
pub const SCHEMA_VERSION: u32 = 6;

/// Version of the code: the package's version and a hash over the sources of the workspace.
pub const CODE_VERSION: &str = env!("ORCHARD_CODE_VERSION");
