//! Names the code that makes results: the package version and a hash over what decides results, so that a result of other code is never
//! taken for one of this code. Hashed are sources, kernels, manifests and build scripts of all crates that can change a result, the configs
//! and assets, and the lock file. A published package, which has no neighbours, is named by its version alone.
//!
//! It is a name and no proof: whoever changes the code can also change the name.

use std::path::{Path, PathBuf};
use std::{env, fs, io};

use sha2::{Digest, Sha256};

/// Bytes of the hash that are kept; enough to distinguish versions of one code base.
const KEPT_BYTES: usize = 6;

/// Crates that only display or request results: no result depends on them.
const SHOWING: [&str; 3] = ["report", "program", "orchard"];

/// Files and folders of the workspace, outside the crates, that decide results.
const SHARED: [&str; 4] = ["Cargo.lock", "Cargo.toml", "configs", "assets"];
/// Files and folders of a crate that decide results.
const OF_CRATE: [&str; 3] = ["Cargo.toml", "build.rs", "src"];

fn main() -> io::Result<()> {
    println!("cargo:rerun-if-changed=build.rs");
    let version = env::var("CARGO_PKG_VERSION").unwrap_or_default();
    let (crates, workspace) = (Path::new(".."), Path::new("../.."));
    let name = if workspace.join("Cargo.lock").is_file() {
        let mut parts: Vec<PathBuf> = SHARED.iter().map(|part| workspace.join(part)).collect();
        let shows = |folder: &Path| SHOWING.iter().any(|name| folder.ends_with(name));
        for folder in entries(crates)?.into_iter().filter(|folder| !shows(folder)) {
            parts.extend(OF_CRATE.iter().map(|part| folder.join(part)));
        }
        let mut files = Vec::new();
        for part in parts.iter().filter(|part| part.exists()) {
            println!("cargo:rerun-if-changed={}", part.display());
            collect(part, &mut files)?;
        }
        format!("{version}+{}", hash(&files)?)
    } else {
        version
    };
    println!("cargo:rustc-env=ORCHARD_CODE_VERSION={name}");
    Ok(())
}

/// Lists the entries of a folder, sorted by name.
fn entries(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut paths = fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<io::Result<Vec<_>>>()?;
    paths.sort();
    Ok(paths)
}

/// Adds a file, or all files under a folder, sorted by name.
fn collect(path: &Path, files: &mut Vec<PathBuf>) -> io::Result<()> {
    if path.is_dir() {
        return entries(path)?.iter().try_for_each(|entry| collect(entry, files));
    }
    files.push(path.to_owned());
    Ok(())
}

/// Hash over names and contents, hexadecimal. Line ends are read as the repository stores them, so that a
/// checkout that rewrites them has the same name.
fn hash(files: &[PathBuf]) -> io::Result<String> {
    let mut hash = Sha256::new();
    for path in files {
        let name = path.to_string_lossy().replace('\\', "/");
        let bytes = fs::read(path)?;
        let bytes = match std::str::from_utf8(&bytes) {
            Ok(text) => text.replace("\r\n", "\n").into_bytes(),
            Err(_) => bytes,
        };
        for part in [name.as_bytes(), &bytes] {
            hash.update((part.len() as u64).to_le_bytes());
            hash.update(part);
        }
    }
    Ok(hash.finalize().iter().take(KEPT_BYTES).map(|byte| format!("{byte:02x}")).collect())
}
