//! Crates that differ from the last commit.

use std::collections::BTreeSet;
use std::process::Command;

use cargo_metadata::MetadataCommand;
use orchard_program::Failure;

use crate::workspace;

/// Packages with files that differ from the last commit; if there are none, packages that the last commit changed.
pub fn crates() -> Result<Vec<String>, Failure> {
    let here =
        packages_of(&[&["diff", "--name-only", "HEAD"], &["ls-files", "--others", "--exclude-standard"]])?;
    if here.is_empty() { packages_of(&[&["diff", "--name-only", "HEAD~1", "HEAD"]]) } else { Ok(here) }
}

/// The packages that hold the files that some git commands list.
fn packages_of(commands: &[&[&str]]) -> Result<Vec<String>, Failure> {
    let failed = |problem: String| Failure::Failed(format!("cannot determine the changed crates: {problem}"));
    let root = workspace::root();
    let metadata = MetadataCommand::new().manifest_path(root.join("Cargo.toml")).no_deps().exec();
    let metadata = metadata.map_err(|e| failed(e.to_string()))?;
    let mut found = BTreeSet::new();
    for args in commands {
        let output = Command::new("git").args(*args).current_dir(&root).output();
        let output = output.map_err(|e| failed(e.to_string()))?;
        if !output.status.success() {
            return Err(failed(String::from_utf8_lossy(&output.stderr).trim().to_owned()));
        }
        for file in String::from_utf8_lossy(&output.stdout).lines() {
            let path = root.join(file);
            let holds = |folder: &cargo_metadata::camino::Utf8Path| path.starts_with(folder);
            let package = metadata.packages.iter().find(|p| p.manifest_path.parent().is_some_and(holds));
            found.extend(package.map(|package| package.name.to_string()));
        }
    }
    Ok(found.into_iter().collect())
}
