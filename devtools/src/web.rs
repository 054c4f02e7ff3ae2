//! `cargo xtask web`: builds the page that runs a world in a browser.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use flate2::Compression;
use flate2::write::GzEncoder;
use orchard_bench::store::write_bytes;
use orchard_program::Failure;

use crate::workspace;

/// Builds the static page of docs/web.md: a world with its controller in WebAssembly.
#[derive(clap::Args)]
#[command(
    after_help = "Needs Rust's target wasm32-unknown-unknown (rustup target add wasm32-unknown-unknown) and nothing else. The folder can be served by any web\n\
                  server; for a look: python3 -m http.server --directory DIR."
)]
pub struct Args {
    /// Folder for the page, made if it is missing; files of the same names are replaced
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// Rust's name of WebAssembly without an operating system.
const TARGET: &str = "wasm32-unknown-unknown";
/// The crates that are compiled, and the files that they become: the first is that of the page, the second is loaded when many trees are asked for.
const PROGRAMS: [(&str, &str); 2] = [("orchard-web", "orchard.wasm"), ("orchard-web-batch", "batch.wasm")];
/// Kinds of files of the page.
const KINDS: [&str; 3] = ["html", "css", "js"];

/// Size of a page.
pub struct Weight {
    /// All files \[bytes\].
    pub raw: usize,
    /// All files, each compressed by gzip \[bytes\].
    pub compressed: usize,
}

pub fn run(args: &Args) -> Result<(), Failure> {
    if !workspace::has_target(TARGET) {
        return Err(Failure::BadInput(missing()));
    }
    let weight = build(&args.out)?;
    say!("{}: {}", args.out.display(), weight);
    Ok(())
}

impl std::fmt::Display for Weight {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        const MEGA: f64 = 1e6;
        let [raw, compressed] = [self.raw, self.compressed].map(|bytes| bytes as f64 / MEGA);
        write!(f, "{compressed:.2} MB to load with gzip ({raw:.2} MB without)")
    }
}

/// Says that the target is missing, and how to get it.
pub fn missing() -> String {
    format!("Rust's target {TARGET} is missing: rustup target add {TARGET}")
}

/// True if the page can be built here.
pub fn can_build() -> bool {
    workspace::has_target(TARGET)
}

/// Builds the page into a folder.
pub fn build(out: &Path) -> Result<Weight, Failure> {
    let mut files = Vec::new();
    for (package, file) in PROGRAMS {
        files.push((file.to_owned(), compile(package)?));
    }
    std::fs::create_dir_all(out).map_err(|e| failed(out, e))?;
    let source = workspace::root().join("web");
    for path in workspace::files(&source, &KINDS)? {
        files.push((workspace::relative(&source, &path), path));
    }
    let mut weight = Weight { raw: 0, compressed: 0 };
    for (name, path) in files {
        let bytes = std::fs::read(&path).map_err(|e| failed(&path, e))?;
        weight.raw += bytes.len();
        weight.compressed += compressed(&bytes).map_err(|e| failed(&path, e))?;
        write_bytes(&out.join(name), &bytes).map_err(|e| Failure::Failed(e.to_string()))?;
    }
    Ok(weight)
}

/// Compiles a crate to WebAssembly; returns its file.
fn compile(package: &str) -> Result<PathBuf, Failure> {
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo.args(["rustc", "--quiet", "--release", "--package", package, "--lib", "--target", TARGET]);
    // The names of its functions are of no use on the page.
    cargo.args(["--crate-type", "cdylib", "--", "-C", "strip=symbols"]);
    let status = cargo.current_dir(workspace::root()).status();
    if !status.is_ok_and(|status| status.success()) {
        return Err(Failure::Failed(format!("{package} cannot be built for {TARGET}")));
    }
    let name = format!("{}.wasm", package.replace('-', "_"));
    Ok(workspace::target().join(TARGET).join("release").join(name))
}

/// Size of bytes under gzip's best compression, as web servers send files.
fn compressed(bytes: &[u8]) -> std::io::Result<usize> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(bytes)?;
    Ok(encoder.finish()?.len())
}

fn failed(path: &Path, e: std::io::Error) -> Failure {
    Failure::Failed(format!("{}: {e}", path.display()))
}
