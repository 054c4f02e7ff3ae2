//! `orchard presets`, `robots`, `cameras`, `detectors`, `controllers`: print the names that the options accept.

use crate::failure::Failure;

/// Prints names, one per line.
pub fn print(names: &[&str]) -> Result<(), Failure> {
    for name in names {
        say!("{name}");
    }
    Ok(())
}
