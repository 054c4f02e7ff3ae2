//! `orchard presets`, `robots`, `cameras`, `detectors`, `controllers`: names that options take.

use crate::failure::Failure;

/// Prints names, one a line.
pub fn print(names: &[&str]) -> Result<(), Failure> {
    for name in names {
        say!("{name}");
    }
    Ok(())
}
