//! Names the code that makes results: the package version and a hash over the sources of all crates that can change one and the
//! lock file, so that a result of other code is never taken for one of this code. A published package, which
//! has no neighbours, is named by its version alone.

use std::path::{Path, PathBuf};
use std::{env, fs, io};

use sha2::{Digest, Sha256};

/// Bytes of the hash that are kept; enough to distinguish versions of one code base.
const KEPT_BYTES: usize = 6;

/// Crates that only display or request results: no result depends on them.
const SHOWING: [&str; 2] = ["report", "orchard"];

fn main() -> io::Result<()> {
    println!("cargo:rerun-if-changed=build.rs");
    let version = env::var("CARGO_PKG_VERSION").unwrap_or_default();
    let crates = Path::new("..");
    let lock = Path::new("../../Cargo.lock");
    let name = if lock.is_file() {
        println!("cargo:rerun-if-changed={}", lock.display());
        let mut files = vec![lock.to_owned()];
        let shows = |folder: &Path| SHOWING.iter().any(|name| folder.ends_with(name));
        for folder in entries(crates)?.into_iter().filter(|folder| !shows(folder)) {
            let sources = folder.join("src");
            if sources.is_dir() {
                println!("cargo:rerun-if-changed={}", sources.display());
                collect(&sources, &mut files)?;
            }
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

fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> io::Result<()> {
    for path in entries(folder)? {
        if path.is_dir() {
            collect(&path, files)?;
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
    Ok(())
}

/// Hash over names and contents, hexadecimal. Line ends are read as the repository stores them, so that a
/// checkout that rewrites them has the same name.
fn hash(files: &[PathBuf]) -> io::Result<String> {
    let mut hash = Sha256::new();
    for path in files {
        let name = path.to_string_lossy().replace('\\', "/");
        let text = fs::read_to_string(path)?.replace("\r\n", "\n");
        for part in [name, text] {
            hash.update((part.len() as u64).to_le_bytes());
            hash.update(part.as_bytes());
        }
    }
    Ok(hash.finalize().iter().take(KEPT_BYTES).map(|byte| format!("{byte:02x}")).collect())
}
