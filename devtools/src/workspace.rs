//! The workspace on disk.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use anyhow::Context;

/// The workspace's root: the folder above this package.
pub fn root() -> PathBuf {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    package.parent().unwrap_or(package).to_owned()
}

/// The folder that cargo builds in.
pub fn target() -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), PathBuf::from)
}

/// The folder of Rust's compilers.
pub fn sysroot() -> anyhow::Result<PathBuf> {
    let output = Command::new("rustc").args(["--print", "sysroot"]).output();
    let output = output.context("cannot run rustc")?;
    anyhow::ensure!(output.status.success(), "rustc --print sysroot ended with {}", output.status);
    Ok(PathBuf::from(String::from_utf8_lossy(&output.stdout).trim()))
}

/// True if Rust's standard library for a target is installed.
pub fn has_target(target: &str) -> bool {
    let library = Command::new("rustc").args(["--print", "target-libdir", "--target", target]).output();
    let library = library.ok().filter(|found| found.status.success());
    library.is_some_and(|found| Path::new(String::from_utf8_lossy(&found.stdout).trim()).is_dir())
}

/// These tools as a program to call. It is a second name of the file that runs: cargo replaces the first one when it builds the tools again. The first
/// call makes it, so whoever builds calls this before.
pub fn tools() -> anyhow::Result<PathBuf> {
    static TOOLS: OnceLock<PathBuf> = OnceLock::new();
    if let Some(path) = TOOLS.get() {
        return Ok(path.clone());
    }
    let this = std::env::current_exe().context("cannot find this program")?;
    let folder = target().join("tools");
    // One name for all runs: cargo compiles everything anew for a compiler of another name (`fuzz`).
    let path = folder.join(format!("devtools{}", std::env::consts::EXE_SUFFIX));
    let _ = std::fs::remove_file(&path);
    std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    std::fs::hard_link(&this, &path)
        .or_else(|_| std::fs::copy(&this, &path).map(drop))
        .with_context(|| path.display().to_string())?;
    Ok(TOOLS.get_or_init(|| path).clone())
}

/// All files under a folder with one of the extensions, sorted. Links, hidden folders, `target` and folders marked as caches, as cargo marks any
/// folder that it builds in, are skipped.
pub fn files(folder: &Path, extensions: &[&str]) -> anyhow::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    if folder.is_dir() {
        collect(folder, extensions, &mut found)?;
    }
    found.sort();
    Ok(found)
}

fn collect(folder: &Path, extensions: &[&str], found: &mut Vec<PathBuf>) -> anyhow::Result<()> {
    let entries = std::fs::read_dir(folder).with_context(|| folder.display().to_string())?;
    for entry in entries {
        let entry = entry.with_context(|| folder.display().to_string())?;
        let (path, kind) = (entry.path(), entry.file_type()?);
        let name = entry.file_name().to_string_lossy().into_owned();
        let is_built = || name == "target" || path.join("CACHEDIR.TAG").exists();
        if kind.is_dir() && !name.starts_with('.') && !is_built() {
            collect(&path, extensions, found)?;
        } else if kind.is_file() && path.extension().is_some_and(|e| extensions.iter().any(|x| e == *x)) {
            found.push(path);
        }
    }
    Ok(())
}

/// A path relative to a folder, with forward slashes.
pub fn relative(folder: &Path, path: &Path) -> String {
    path.strip_prefix(folder).unwrap_or(path).display().to_string().replace('\\', "/")
}
