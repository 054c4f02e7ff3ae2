//! `cargo xtask check-reuse`: checks the crates as packaged for other projects.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use orchardbench::{Failure, Verdict};

use crate::workspace;

/// Packages every crate, runs the examples of docs/reuse.md, and builds and runs a controller outside the workspace on the packages.
#[derive(clap::Args)]
pub struct Args {}

/// Members of the workspace that are not published.
const UNPUBLISHED: [&str; 3] = ["orchard-tests", "devtools", "xtask"];

/// Examples that docs/reuse.md shows: package and name.
const EXAMPLES: [(&str, &str); 3] = [
    ("orchard-treegen", "grow_tree"),
    ("orchard-multibody", "step_body"),
    ("orchard-perception", "find_spheres"),
];

pub fn run(_: &Args) -> Result<(), Failure> {
    check().map(|_| ())
}

/// Runs all checks.
pub fn check() -> Result<Verdict, Failure> {
    let root = workspace::root();
    let folder = root.join("target/reuse");
    for (package, example) in EXAMPLES {
        cargo(&root, &["run", "--quiet", "--package", package, "--example", example])?;
    }
    // One target folder for all: the dependencies are built once.
    let target = folder.join("target");
    let packages = packages(&root, &folder, &target)?;
    let project = project(&root, &folder, &packages)?;
    let target = target.to_string_lossy().into_owned();
    let results = folder.join("results");
    let _ = fs::remove_dir_all(&results);
    let out = results.to_string_lossy().into_owned();
    let run = ["run", "--quiet", "--target-dir", &target, "--"];
    let bench = ["bench-v1", "--controller", "drive", "--tasks", "harvest", "--conditions", "nominal"];
    let short = ["--trees", "1", "--horizon", "1", "--out", &out];
    cargo(&project, &[&run[..], &bench, &short].concat())?;
    let summary = fs::read_to_string(results.join("summary.json"))
        .map_err(|e| Failure::Failed(format!("the controller's summary: {e}")))?;
    if !summary.contains("\"controller\": \"drive\"") {
        return Err(Failure::Failed("the summary does not name the controller".to_owned()));
    }
    Ok(Verdict::Agreed)
}

/// Packages all published crates and unpacks them; returns their names and folders.
fn packages(root: &Path, folder: &Path, target: &Path) -> Result<Vec<(String, PathBuf)>, Failure> {
    let mut args = vec!["package", "--workspace", "--no-verify", "--allow-dirty", "--quiet"];
    for name in UNPUBLISHED {
        args.extend(["--exclude", name]);
    }
    let made = target.join("package");
    let _ = fs::remove_dir_all(&made);
    let target = target.to_string_lossy().into_owned();
    args.extend(["--target-dir", &target]);
    cargo(root, &args)?;
    let unpacked = folder.join("packages");
    let _ = fs::remove_dir_all(&unpacked);
    fs::create_dir_all(&unpacked).map_err(|e| failed(&unpacked, e))?;
    let version = format!("-{}", env!("CARGO_PKG_VERSION"));
    let mut packages = Vec::new();
    for file in workspace::files(&made, &["crate"])? {
        let stem = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        run_in(&unpacked, Command::new("tar").arg("xzf").arg(&file))?;
        let name = stem.strip_suffix(&version).unwrap_or(&stem).to_owned();
        packages.push((name, unpacked.join(stem)));
    }
    packages.sort();
    packages.dedup();
    if packages.is_empty() {
        return Err(Failure::Failed(format!("{}: no packages", made.display())));
    }
    Ok(packages)
}

/// Copies the example project out of the workspace and points its dependencies to the packages.
fn project(root: &Path, folder: &Path, packages: &[(String, PathBuf)]) -> Result<PathBuf, Failure> {
    let (from, project) = (root.join("examples/own-controller"), folder.join("own-controller"));
    let source = project.join("src");
    fs::create_dir_all(&source).map_err(|e| failed(&source, e))?;
    let read = |name: &str| fs::read_to_string(from.join(name)).map_err(|e| failed(&from.join(name), e));
    let patches = packages.iter().map(|(name, path)| format!("{name} = {{ path = {path:?} }}\n"));
    let manifest = format!("{}\n[patch.crates-io]\n{}", read("Cargo.toml")?, patches.collect::<String>());
    for (name, text) in [("Cargo.toml", manifest), ("src/main.rs", read("src/main.rs")?)] {
        let path = project.join(name);
        fs::write(&path, text).map_err(|e| failed(&path, e))?;
    }
    // The versions that the workspace was tested with.
    let lock = project.join("Cargo.lock");
    fs::copy(root.join("Cargo.lock"), &lock).map_err(|e| failed(&lock, e))?;
    Ok(project)
}

fn cargo(folder: &Path, args: &[&str]) -> Result<(), Failure> {
    let program = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    run_in(folder, Command::new(program).args(args).stdout(std::process::Stdio::null()))
}

fn run_in(folder: &Path, command: &mut Command) -> Result<(), Failure> {
    let line = format!("{command:?}");
    match command.current_dir(folder).status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(Failure::Failed(format!("{line} in {} ended with {status}", folder.display()))),
        Err(e) => Err(Failure::Failed(format!("cannot run {line}: {e}"))),
    }
}

fn failed(path: &Path, e: std::io::Error) -> Failure {
    Failure::Failed(format!("{}: {e}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_shows_the_examples() {
        let root = workspace::root();
        let page = fs::read_to_string(root.join("docs/reuse.md")).unwrap();
        for (package, example) in EXAMPLES {
            let folder = package.strip_prefix("orchard-").unwrap();
            let file = format!("crates/{folder}/examples/{example}.rs");
            let text = fs::read_to_string(root.join(&file)).unwrap();
            assert!(page.contains(&format!("```rust\n{text}```")), "{file}");
        }
        let own = fs::read_to_string(root.join("examples/own-controller/src/main.rs")).unwrap();
        let page = fs::read_to_string(root.join("docs/controllers.md")).unwrap();
        assert!(page.contains(&format!("```rust\n{own}```")), "docs/controllers.md");
    }
}
