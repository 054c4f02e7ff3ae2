//! `cargo xtask fuzz`: the targets under `fuzz/`, each for a bounded time.

use std::ffi::OsString;
use std::path::Path;
use std::process::{Command, ExitCode, Stdio};

use anyhow::Context;
use orchard_bench::store::write_bytes;
use orchard_exchange::{depth_png, intrinsics};
use orchard_geometry::{DepthImage, Intrinsics};
use orchard_perception::DetectorConfig;
use rayon::prelude::*;

use crate::workspace;
use orchard_program::{Failure, Program, Verdict};

/// Runs libFuzzer on the detector and on all readers of input files.
#[derive(clap::Args)]
#[command(
    after_help = "Targets:\n  detect       any image, intrinsics and choice of gates\n  image_files  PNG, TIFF, JPEG, NumPy, intrinsics, regions, detector config\n  \
                  plan, record, mcap\n               files of a short run of bench-v1, after edits\n  \
                  board, snapshot, trajectory, tree (MTG and JSON), urdf, onnx, toml\n               any bytes, or a valid file after edits\n\
                  Needs a C++ compiler for libFuzzer; stable Rust is enough. Found inputs are kept in the target folder under fuzz/.\n\
                  A failing input is named. To reproduce the failure:\n  \
                  ORCHARD_FUZZ_TARGET=NAME ORCHARD_FUZZ_FILES=target/fuzz/files target/debug/orchard-fuzz INPUT"
)]
pub struct Args {
    /// Time for each target [s]
    #[arg(long, default_value_t = SECONDS, value_name = "SECONDS", value_parser = clap::value_parser!(u32).range(1..=86_400))]
    pub seconds: u32,
}

/// Time for each target in `cargo xtask test` \[s\], our own choice: 48 s of one processor for all of them.
pub const SECONDS: u32 = 4;

/// The targets of the program in `fuzz/`.
const TARGETS: [&str; 12] = [
    "detect",
    "image_files",
    "plan",
    "record",
    "board",
    "snapshot",
    "mcap",
    "trajectory",
    "tree",
    "urdf",
    "onnx",
    "toml",
];

/// Compiler flags for coverage guidance, those of cargo-fuzz without a sanitizer: counters and tables of
/// branches, operands of comparisons, and one code unit, so that the tables are complete. Level 1 compiles in half the time of level 3 and
/// runs fast enough for a bounded run; overflow and debug checks stay on.
const FLAGS: [&str; 9] = [
    "--cfg=fuzzing",
    "-Cpasses=sancov-module",
    "-Cllvm-args=-sanitizer-coverage-level=4",
    "-Cllvm-args=-sanitizer-coverage-inline-8bit-counters",
    "-Cllvm-args=-sanitizer-coverage-pc-table",
    "-Cllvm-args=-sanitizer-coverage-trace-compares",
    "-Cllvm-args=-simplifycfg-branch-fold-threshold=0",
    "-Ccodegen-units=1",
    "-Copt-level=1",
];

/// Environment variable that makes this program a compiler with [`FLAGS`].
const AS_COMPILER: &str = "ORCHARD_FUZZ_COMPILER";

/// Compiles one crate with [`FLAGS`] if cargo calls this program as the compiler of the workspace's crates; `None` in a call by a user.
///
/// Crates of other authors keep their usual flags, so that the fuzzer shares them with all other builds; it is not guided inside them.
pub fn as_compiler() -> Option<ExitCode> {
    std::env::var_os(AS_COMPILER)?;
    let args: Vec<OsString> = std::env::args_os().skip(1).collect();
    let (compiler, args) = args.split_first()?;
    let is = |pair: [&str; 2]| args.windows(2).any(|at| at[0] == pair[0] && at[1] == pair[1]);
    // Cargo's questions about the platform, and what runs on the host while crates are compiled.
    let is_asked = is(["--crate-name", "___"]) || !args.iter().any(|arg| arg == "--crate-name");
    let is_host = is(["--crate-name", "build_script_build"]) || is(["--crate-type", "proc-macro"]);
    let flags: &[&str] = if is_asked || is_host { &[] } else { &FLAGS };
    let status = Command::new(compiler).args(args).args(flags).status();
    let code = status.ok().and_then(|status| status.code()).and_then(|code| u8::try_from(code).ok());
    Some(ExitCode::from(code.unwrap_or(1)))
}

/// Limits of time \[s\] and memory \[MB\] for one input.
const SLOWEST: u32 = 5;
const MOST_MEMORY: u32 = 2048;
/// Longest input \[bytes\].
const LONGEST: u32 = 8192;

/// Builds and runs all targets.
pub fn run(args: &Args) -> Result<(), Failure> {
    match fuzz(args.seconds)? {
        Verdict::Agreed => Ok(()),
        Verdict::Skipped(reason) => {
            println!("skipped: {reason}");
            Ok(())
        }
    }
}

/// Runs every target for some seconds. In continuous integration a missing tool is a failure.
pub fn fuzz(seconds: u32) -> Result<Verdict, Failure> {
    if let Err(reason) = compiler() {
        if std::env::var_os("CI").is_some_and(|ci| ci == "true") {
            return Err(Failure::Failed(format!("fuzzing is needed in continuous integration: {reason}")));
        }
        return Ok(Verdict::Skipped(reason));
    }
    let folder = workspace::target().join("fuzz");
    let this = workspace::tools()?;
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let status = Command::new(cargo)
        // The tools are named for their features, which are those of all builds here.
        .args(["build", "--quiet", "--package", "orchard-fuzz", "--package", "devtools"])
        .args(["--bin", "orchard-fuzz"])
        .current_dir(workspace::root())
        .env("RUSTC_WORKSPACE_WRAPPER", this)
        .env(AS_COMPILER, "1")
        .status()
        .context("cannot run cargo")?;
    if !status.success() {
        return Err(Failure::Failed("the fuzz targets cannot be built".into()));
    }
    valid_files(&folder.join(FILES))?;
    let program = workspace::target().join("debug/orchard-fuzz");
    eprintln!("{} targets, {seconds} s each, one on every processor", TARGETS.len());
    let logs =
        TARGETS.par_iter().with_max_len(1).map(|target| run_target(&folder, &program, target, seconds));
    // All targets end before the first failure is told.
    for log in logs.collect::<Vec<_>>() {
        println!("{}", log?);
    }
    Ok(Verdict::Agreed)
}

/// Folder of the valid files that some targets edit.
const FILES: &str = "files";

/// Writes a plan, an episode's record and a recording into a folder: those of a short run of the benchmark.
fn valid_files(folder: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let run = folder.join("run");
    // Records of other code would not be kept, so nothing old is.
    let _ = std::fs::remove_dir_all(&run);
    let line = "orchard bench-v1 --tasks harvest --conditions nominal --trees 1 --seeds 1 --horizon 0.2 --record --out";
    let line = line.split(' ').map(OsString::from).chain([run.clone().into_os_string()]);
    Program::new().call(line)?;
    for (from, ending, to) in [
        ("", "plan.json", "plan.json"),
        ("episodes", ".json", "record.json"),
        ("recordings", ".mcap", "episode.mcap"),
    ] {
        let from = run.join(from);
        let entries = std::fs::read_dir(&from).with_context(|| from.display().to_string())?;
        let found = entries.flatten().find(|entry| entry.file_name().to_string_lossy().ends_with(ending));
        let found = found.with_context(|| format!("{}: no file {ending}", from.display()))?;
        std::fs::copy(found.path(), folder.join(to)).with_context(|| found.path().display().to_string())?;
    }
    Ok(())
}

/// Runs a target; returns how many inputs it tried.
fn run_target(folder: &Path, program: &Path, target: &str, seconds: u32) -> Result<String, Failure> {
    let corpus = folder.join("corpus").join(target);
    let failures = folder.join("failures");
    for folder in [&corpus, &failures] {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    for (name, bytes) in seeds(target)? {
        write_bytes(&corpus.join(name), &bytes).map_err(|e| Failure::Failed(e.to_string()))?;
    }
    let output = Command::new(program)
        .env("ORCHARD_FUZZ_TARGET", target)
        .env("ORCHARD_FUZZ_FILES", folder.join(FILES))
        .arg(format!("-max_total_time={seconds}"))
        .arg(format!("-timeout={SLOWEST}"))
        .arg(format!("-rss_limit_mb={MOST_MEMORY}"))
        .arg(format!("-max_len={LONGEST}"))
        .args(["-print_final_stats=1", "-verbosity=0"])
        .arg(format!("-artifact_prefix={}/{target}-", failures.display()))
        .arg(&corpus)
        .stdin(Stdio::null())
        .output()
        .with_context(|| program.display().to_string())?;
    let log = String::from_utf8_lossy(&output.stderr);
    if output.status.success() {
        let runs = log.lines().find_map(|line| line.strip_prefix("stat::number_of_executed_units:"));
        return Ok(format!("{target}: {} inputs, none failed", runs.map_or("?", str::trim)));
    }
    eprintln!("{log}");
    Err(Failure::Failed(format!("fuzz target {target} failed; the input is in {}", failures.display())))
}

/// Initial inputs: valid files.
fn seeds(target: &str) -> anyhow::Result<Vec<(&'static str, Vec<u8>)>> {
    if target != "image_files" {
        return Ok(Vec::new());
    }
    let pixels = (0..12).map(|i| 0.1 * i as f32).collect();
    let depth = DepthImage::from_pixels(4, 3, pixels).context("twelve pixels")?;
    let k = Intrinsics::from_vertical_fov(4, 3, 1.0);
    let ros = r#"{"height": 3, "width": 4, "D": [0, 0], "K": [3, 0, 1, 0, 3, 1, 0, 0, 1]}"#;
    let mut seeds = vec![
        ("depth.png", depth_png::write(&depth, depth_png::MILLIMETRE)?),
        ("camera.json", intrinsics::write(&k).into_bytes()),
        ("ros.json", ros.as_bytes().to_vec()),
    ];
    seeds.extend(DetectorConfig::FILES.iter().map(|(name, text)| (*name, text.as_bytes().to_vec())));
    Ok(seeds)
}

/// Checks that libFuzzer can be compiled; the error gives the reason.
fn compiler() -> Result<(), String> {
    let name = std::env::var("CXX").unwrap_or_else(|_| "c++".into());
    match Command::new(&name).arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status() {
        Ok(status) if status.success() => Ok(()),
        _ => Err(format!("C++ compiler {name} not found; libFuzzer needs one (set CXX to use another)")),
    }
}
