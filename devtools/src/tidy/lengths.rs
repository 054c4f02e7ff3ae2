//! Checks the length of source files.

use std::path::Path;

use super::Findings;
use crate::workspace::{files, relative};

/// Lines above which a file is refused.
const REFUSED: usize = 800;

/// Lines above which a file gets a warning.
const LONG: usize = 500;

/// Counts the lines of every Rust and WGSL file under `root`.
pub fn check(root: &Path) -> anyhow::Result<Findings> {
    let mut findings = Findings::default();
    for path in files(root, &["rs", "wgsl"])? {
        let lines = std::fs::read_to_string(&path)?.lines().count();
        let line = format!("{} has {lines} lines", relative(root, &path));
        if lines > REFUSED {
            findings.errors.push(format!("{line}, more than {REFUSED}"));
        } else if lines > LONG {
            findings.warnings.push(line);
        }
    }
    Ok(findings)
}

#[cfg(test)]
mod tests {
    use super::super::fixture::folder;
    use super::*;

    #[test]
    fn long_files_are_listed_and_very_long_ones_refused() {
        let lines = |n: usize| "//\n".repeat(n);
        let folder = folder(&[
            ("a/500.rs", &lines(500)),
            ("a/501.rs", &lines(501)),
            ("a/801.wgsl", &lines(801)),
            ("target/900.rs", &lines(900)),
            ("elsewhere/CACHEDIR.TAG", ""),
            ("elsewhere/900.rs", &lines(900)),
            ("a/900.txt", &lines(900)),
        ]);
        let findings = check(folder.path()).unwrap();
        assert_eq!(findings.errors, ["a/801.wgsl has 801 lines, more than 800"]);
        assert_eq!(findings.warnings, ["a/501.rs has 501 lines"]);
    }
}
