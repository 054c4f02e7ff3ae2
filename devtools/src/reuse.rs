//! `cargo xtask check-reuse`: checks the crates as packaged for other projects.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use orchard_program::{Failure, Verdict};

use crate::workspace;

/// Packages every crate, compiles each from its package, outside the workspace and with a controller of its own project, and runs that
/// controller and the examples of docs/reuse.md.
#[derive(clap::Args)]
pub struct Args {}

/// Members of the workspace that are not published.
const UNPUBLISHED: [&str; 7] = [
    "orchard-python",
    "orchard-web",
    "orchard-web-batch",
    "orchard-tests",
    "orchard-fuzz",
    "devtools",
    "xtask",
];

/// Folder of the workspace of packages: a package belongs to the workspace that is nearest above it.
const OUTSIDE: &str = "outside";

/// Folder and name of the example project with a controller.
const CONTROLLER: &str = "own-controller";

/// An empty package with the tools' dependencies on crates of other authors. With it their features are those of this workspace, and one
/// build of each serves both.
const SHARED: &str = "shared-dependencies";

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
    let target = workspace::target();
    let folder = target.join("reuse");
    for (package, example) in EXAMPLES {
        // The tools are named for their features, which are those of all builds here.
        let both = ["--package", package, "--package", "devtools"];
        cargo(&root, &[&["build", "--quiet", "--example", example], &both[..]].concat())?;
        let program = target.join("debug/examples").join(example);
        run_in(&root, Command::new(program).stdout(std::process::Stdio::null()))?;
    }
    let packages = packages(&root, &folder)?;
    let outside = outside(&root, &folder, &packages)?;
    let here = ["--quiet", "--target-dir", &target.to_string_lossy()];
    cargo(&outside, &[&["build", "--workspace", "--lib", "--bin", CONTROLLER], &here[..]].concat())?;
    // Alone, the project leaves out the default features of the library.
    cargo(&outside, &[&["check", "--package", CONTROLLER], &here[..]].concat())?;
    without_graphics(&outside)?;
    let results = folder.join("results");
    let _ = fs::remove_dir_all(&results);
    let out = results.to_string_lossy().into_owned();
    let bench = ["bench-v1", "--controller", "drive", "--tasks", "harvest", "--conditions", "nominal"];
    let short = ["--trees", "1", "--horizon", "0.2", "--out", &out];
    let program = target.join("debug").join(CONTROLLER);
    run_in(&outside, Command::new(program).args(bench).args(short).stdout(std::process::Stdio::null()))?;
    let summary = fs::read_to_string(results.join("summary.json"))
        .map_err(|e| Failure::Failed(format!("the controller's summary: {e}")))?;
    if !summary.contains("\"controller\": \"drive\"") {
        return Err(Failure::Failed("the summary does not name the controller".to_owned()));
    }
    Ok(Verdict::Agreed)
}

/// Checks that a controller's project compiles neither the graphics device nor recordings and demonstrations.
fn without_graphics(outside: &Path) -> Result<(), Failure> {
    let program = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let tree = ["tree", "--quiet", "--package", CONTROLLER, "--edges", "normal,build", "--prefix", "none"];
    let output = Command::new(program).args(tree).current_dir(outside).output();
    let output = output.map_err(|e| Failure::Failed(format!("cannot run cargo tree: {e}")))?;
    if !output.status.success() {
        return Err(Failure::Failed(String::from_utf8_lossy(&output.stderr).trim().to_owned()));
    }
    let tree = String::from_utf8_lossy(&output.stdout);
    match ["wgpu ", "foxglove ", "parquet "]
        .iter()
        .find(|name| tree.lines().any(|line| line.starts_with(*name)))
    {
        Some(name) => Err(Failure::Failed(format!("a controller of one's own compiles {}", name.trim()))),
        None => Ok(()),
    }
}

/// Packages all published crates and unpacks them; returns their names and folders.
fn packages(root: &Path, folder: &Path) -> Result<Vec<(String, PathBuf)>, Failure> {
    // The packages are compiled below: `cargo package` would compile each with all that it depends on, once more for every crate.
    let mut args = vec!["package", "--workspace", "--no-verify", "--allow-dirty", "--quiet"];
    for name in UNPUBLISHED {
        args.extend(["--exclude", name]);
    }
    let target = folder.join("target");
    let made = target.join("package");
    let _ = fs::remove_dir_all(&made);
    let target = target.to_string_lossy().into_owned();
    args.extend(["--target-dir", &target]);
    cargo(root, &args)?;
    let unpacked = folder.join(OUTSIDE);
    let _ = fs::remove_dir_all(&unpacked);
    fs::create_dir_all(&unpacked).map_err(|e| failed(&unpacked, e))?;
    let version = format!("-{}", env!("CARGO_PKG_VERSION"));
    let mut packages = Vec::new();
    for file in workspace::files(&made, &["crate"])? {
        let stem = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        // With the time of unpacking: all files in a package have one time, long ago, by which cargo would take the last run's build for this one's.
        run_in(&unpacked, Command::new("tar").arg("xzmf").arg(&file))?;
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

/// Returns a dependency of the tools as a manifest outside this workspace states it: `shared` is the workspace's entry, with the features of the
/// tools' own entry; without one, the tools' own entry.
fn dependency(own: &toml::Value, shared: Option<&toml::Value>) -> toml::Value {
    let mut table = match shared {
        None => return own.clone(),
        Some(toml::Value::Table(table)) => table.clone(),
        Some(version) => toml::Table::from_iter([("version".to_owned(), version.clone())]),
    };
    if let Some(features) = own.get("features") {
        table.insert("features".to_owned(), features.clone());
    }
    table.into()
}

/// Makes a workspace of the packages and of the example project, whose dependencies it points to the packages. Profiles of dependencies and
/// versions are those of this workspace, so that one build of each serves both; the packages are compiled without optimisation.
fn outside(root: &Path, folder: &Path, packages: &[(String, PathBuf)]) -> Result<PathBuf, Failure> {
    let (from, outside) = (root.join("examples").join(CONTROLLER), folder.join(OUTSIDE));
    let source = outside.join(CONTROLLER).join("src");
    let shared_source = outside.join(SHARED).join("src");
    for folder in [&source, &shared_source] {
        fs::create_dir_all(folder).map_err(|e| failed(folder, e))?;
    }
    let read = |path: PathBuf| fs::read_to_string(&path).map_err(|e| failed(&path, e));
    let project = read(from.join("Cargo.toml"))?.replace("[workspace]", "");
    let main = read(from.join("src/main.rs"))?;
    let parse = |file: &str| -> Result<toml::Table, Failure> {
        read(root.join(file))?.parse().map_err(|e| Failure::Failed(format!("{file}: {e}")))
    };
    let own = parse("Cargo.toml")?;
    let profile = own.get("profile").and_then(|profile| profile.get("dev")).cloned();
    let mut manifest = toml::Table::new();
    let members = packages.iter().map(|(_, path)| path.to_string_lossy().into_owned());
    let members =
        members.chain([CONTROLLER.to_owned(), SHARED.to_owned()]).map(toml::Value::from).collect::<Vec<_>>();
    let patches = packages.iter().map(|(name, path)| {
        let path = toml::Table::from_iter([("path".to_owned(), path.to_string_lossy().into_owned().into())]);
        (name.clone(), toml::Value::from(path))
    });
    let patches = toml::Table::from_iter(patches);
    let workspace = [("members".to_owned(), members.into()), ("resolver".to_owned(), "3".into())];
    manifest.insert("workspace".to_owned(), toml::Table::from_iter(workspace).into());
    let registry = [("crates-io".to_owned(), toml::Value::from(patches))];
    manifest.insert("patch".to_owned(), toml::Table::from_iter(registry).into());
    let all = own.get("workspace").and_then(|workspace| workspace.get("dependencies"));
    let tools: toml::Table = parse("devtools/Cargo.toml")?;
    let others = |kind: &str| -> toml::Table {
        let own = tools.get(kind).and_then(toml::Value::as_table).into_iter().flatten();
        let own = own.filter(|(name, _)| !name.starts_with("orchard"));
        own.map(|(name, own)| (name.clone(), dependency(own, all.and_then(|all| all.get(name))))).collect()
    };
    let package = [("name", SHARED), ("version", "0.0.0"), ("edition", "2024")];
    let package = package.map(|(key, value)| (key.to_owned(), value.into()));
    let shared = toml::Table::from_iter([
        ("package".to_owned(), toml::Table::from_iter(package).into()),
        ("dependencies".to_owned(), others("dependencies").into()),
        ("build-dependencies".to_owned(), others("build-dependencies").into()),
    ]);
    if let Some(mut profile) = profile {
        let fields = profile.as_table_mut();
        if let Some(packages) = fields.and_then(|dev| {
            dev.insert("opt-level".to_owned(), 0.into());
            dev.get_mut("package").and_then(toml::Value::as_table_mut)
        }) {
            packages.retain(|name, _| !name.starts_with("orchard"));
        }
        manifest.insert("profile".to_owned(), toml::Table::from_iter([("dev".to_owned(), profile)]).into());
    }
    let lock =
        fs::read_to_string(root.join("Cargo.lock")).map_err(|e| failed(&root.join("Cargo.lock"), e))?;
    for (path, text) in [
        (outside.join("Cargo.toml"), manifest.to_string()),
        (outside.join("Cargo.lock"), lock),
        (outside.join(CONTROLLER).join("Cargo.toml"), project),
        (source.join("main.rs"), main),
        (shared_source.with_file_name("Cargo.toml"), shared.to_string()),
        (shared_source.with_file_name("build.rs"), "fn main() {}\n".to_owned()),
        (shared_source.join("lib.rs"), String::new()),
    ] {
        fs::write(&path, text).map_err(|e| failed(&path, e))?;
    }
    Ok(outside)
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
