//! `cargo xtask test`: everything that a change must pass.

mod beside;
mod changed;
#[cfg(test)]
mod shared_builds;

use std::fs;
use std::path::PathBuf;
use std::process::Command;
use std::time::{Duration, Instant};

use orchard_program::commands::validate;
use orchard_program::{Failure, Verdict};

use crate::{check_learning, check_python, fuzz, reuse, tidy, workspace};

/// Checks format, lints and order, then runs all tests.
#[derive(clap::Args)]
#[command(
    after_help = "Steps: cargo fmt --check, cargo clippy -D warnings, cargo doc -D warnings, cargo test --workspace, view (the viewer's window), packages (cargo package of\n\
                  every crate, and a controller built outside the workspace on the packaged crates), validate gpu, fuzz. Beside them run tidy, combinations (every\n\
                  preset x camera x controller, a short episode each), judge, check-statistics, read-back, check-report, check-web, check-network, check-python, check-site.\n\
                  All steps run; the last lines list the results and times of the steps, and the number of tests skipped without a graphics\n\
                  adapter. A step whose tools are missing is skipped with a message; with CI=true in the environment it fails.\n\n\
                  With --learning: the adapters for Stable-Baselines3, rsl_rl, skrl, TorchRL, PufferLib, vla-eval and LeRobot (lerobot-eval, too), each at a tiny\n\
                  size with the real package. PufferLib is skipped unless it is installed (docs/learning.md).\n\
                  It needs the network on the first run: 6 GB go into target/learning/venv. LeRobot needs Python 3.12 as python3, else its\n\
                  checks are skipped with a message.\n\n\
                  With --quick: format, tidy, lints and tests of the crates that differ from the last commit (or, if none does, of those\n\
                  that the last commit changed)."
)]
pub struct Args {
    /// Only the checks and tests of the changed crates
    #[arg(long)]
    quick: bool,
    /// Only the adapters of the Python package, with the packages that they are for: torch, which brings gigabytes, and others
    #[arg(long, conflicts_with = "quick")]
    learning: bool,
}

/// File that lists the tests skipped without a graphics adapter, a line each.
const SKIPPED: &str = "ORCHARD_SKIPPED";

/// Package that needs a C++ compiler; its own step builds it.
const FUZZ: &str = "orchard-fuzz";

/// Packages that have steps of their own.
const APART: [&str; 4] = ["--exclude", FUZZ, "--exclude", check_python::PACKAGE];

type Step = (&'static str, Box<dyn Fn() -> Result<Verdict, Failure>>);

/// Result and time of a step.
struct Outcome {
    name: &'static str,
    result: Result<Verdict, Failure>,
    time: Duration,
}

pub fn run(args: &Args) -> Result<(), Failure> {
    let skipped = workspace::target().join("skipped-tests.txt");
    let _ = fs::remove_file(&skipped);
    let start = Instant::now();
    workspace::tools()?;
    let whole = !(args.quick || args.learning);
    let beside = whole.then(|| std::thread::spawn(beside::run));
    let steps: Vec<Step> = match args {
        Args { learning: true, .. } => vec![("learning", Box::new(check_learning::check))],
        Args { quick: true, .. } => quick_steps(&skipped)?,
        _ => all_steps(&skipped),
    };
    let mut outcomes = Vec::new();
    for (name, step) in steps {
        eprintln!("== {name}");
        let start = Instant::now();
        outcomes.push(Outcome { name, result: step(), time: start.elapsed() });
    }
    if let Some(beside) = beside {
        outcomes.extend(
            beside.join().map_err(|_| Failure::Failed("the checks beside the builds panicked".into()))?,
        );
    }
    eprintln!("==");
    for Outcome { name, result, time } in &outcomes {
        let seconds = time.as_secs();
        match result {
            Ok(Verdict::Agreed) => eprintln!("pass  {name} ({seconds} s)"),
            Ok(Verdict::Skipped(reason)) => eprintln!("SKIPPED  {name}: {reason}"),
            Err(failure) => eprintln!("FAIL  {name} ({seconds} s): {failure}"),
        }
    }
    let without_adapter = fs::read_to_string(&skipped).map_or(0, |text| text.lines().count());
    if without_adapter > 0 {
        eprintln!("{without_adapter} tests skipped, no adapter");
    }
    let failed = outcomes.iter().filter(|outcome| outcome.result.is_err()).count();
    if failed > 0 {
        return Err(Failure::Failed(format!("{failed} of {} steps failed", outcomes.len())));
    }
    let left_out =
        outcomes.iter().filter(|outcome| matches!(outcome.result, Ok(Verdict::Skipped(_)))).count();
    let passed = outcomes.len() - left_out;
    if whole {
        eprintln!(
            "not run: the adapters for learning, whose packages take gigabytes (cargo xtask test --learning)"
        );
    }
    eprintln!(
        "{passed} of {} steps passed, {left_out} skipped, in {} s",
        outcomes.len(),
        start.elapsed().as_secs()
    );
    Ok(())
}

fn all_steps(skipped: &std::path::Path) -> Vec<Step> {
    let (skipped, of_window) = (skipped.to_owned(), skipped.to_owned());
    vec![
        ("format", Box::new(|| cargo(&["fmt", "--all", "--check"], &[]))),
        ("clippy", Box::new(|| cargo(&[&CLIPPY[..], &["--", "-D", WARNINGS]].concat(), &[]))),
        ("docs", Box::new(docs)),
        (
            "tests",
            Box::new(move || {
                let all = ["test", "--workspace", "--quiet", "--no-fail-fast"];
                cargo(&[&all[..], &APART].concat(), &[(SKIPPED, skipped.as_ref())])
            }),
        ),
        ("view", Box::new(move || window(&of_window))),
        ("packages", Box::new(reuse::check)),
        ("gpu", Box::new(validate::check_gpu)),
        ("fuzz", Box::new(|| fuzz::fuzz(fuzz::SECONDS))),
    ]
}

/// The Python package is among them: it has no targets that need Python to be compiled.
const CLIPPY: [&str; 6] = ["clippy", "--workspace", "--exclude", FUZZ, "--all-targets", "--quiet"];
const WARNINGS: &str = "warnings";

/// Documents all libraries. Cargo is given clippy's compiler and options, so that it uses the crates that the step before has checked and compiles
/// none of them again.
fn docs() -> Result<Verdict, Failure> {
    let all = ["doc", "--workspace", "--no-deps", "--quiet"];
    let compiler =
        workspace::sysroot()?.join("bin").join(format!("clippy-driver{}", std::env::consts::EXE_SUFFIX));
    // The form in which cargo-clippy passes options to its compiler: this word after each.
    let options = ["-D", WARNINGS].map(|option| format!("{option}__CLIPPY_HACKERY__")).concat();
    let variables = [
        ("RUSTDOCFLAGS", "-D warnings".as_ref()),
        ("RUSTC_WORKSPACE_WRAPPER", compiler.as_os_str()),
        ("CLIPPY_ARGS", options.as_ref()),
    ];
    cargo(&[&all[..], &APART].concat(), &variables)
}

/// Tests the viewer's window, whose libraries no other step compiles, on pictures without a screen.
fn window(skipped: &std::path::Path) -> Result<Verdict, Failure> {
    // With the tools, so that all other crates are those of the other steps.
    let packages = ["--package", "orchard-view", "--package", "devtools"];
    let features =
        ["window", "recording", "demos", "live"].map(|feature| format!("orchard-view/{feature}")).join(",");
    let suites = ["window", "recording", "demos", "live"].iter().flat_map(|suite| ["--test", suite]);
    let only = ["--features", &features, "--quiet"].into_iter().chain(suites);
    let args: Vec<&str> = ["test"].into_iter().chain(packages).chain(only).collect();
    cargo(&args, &[(SKIPPED, skipped.as_ref())])
}

fn quick_steps(skipped: &std::path::Path) -> Result<Vec<Step>, Failure> {
    let crates = changed::crates()?;
    if crates.is_empty() {
        eprintln!("no crate changed, neither since the last commit nor in it: only format and tidy run");
    } else {
        eprintln!("changed: {}", crates.join(", "));
    }
    let mut steps: Vec<Step> = vec![
        ("format", Box::new(|| cargo(&["fmt", "--all", "--check"], &[]))),
        ("tidy", Box::new(|| tidy::run(&tidy::Args::reading()).map(|()| Verdict::Agreed))),
    ];
    if !crates.is_empty() {
        let of = |first: &[&'static str], last: &[&'static str]| -> Vec<String> {
            // With the tools, whose features are those of all builds here, no dependency is compiled again.
            let names = crates.iter().map(String::as_str).chain(["devtools"]);
            let packages = names.flat_map(|name| ["-p".to_owned(), name.to_owned()]);
            let first = first.iter().map(|arg| (*arg).to_owned());
            first.chain(packages).chain(last.iter().map(|arg| (*arg).to_owned())).collect()
        };
        let clippy = of(&["clippy", "--quiet"], &["--all-targets", "--", "-D", "warnings"]);
        let tests = of(&["test", "--quiet"], &[]);
        let skipped: PathBuf = skipped.to_owned();
        steps.push(("clippy", Box::new(move || cargo(&clippy, &[]))));
        steps.push(("tests", Box::new(move || cargo(&tests, &[(SKIPPED, skipped.as_ref())]))));
    }
    Ok(steps)
}

fn cargo<S: AsRef<std::ffi::OsStr>>(
    args: &[S],
    variables: &[(&str, &std::ffi::OsStr)],
) -> Result<Verdict, Failure> {
    let program = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let name = args[0].as_ref().to_string_lossy().into_owned();
    let mut command = Command::new(program);
    command.args(args).current_dir(workspace::root()).envs(variables.iter().copied());
    match command.status() {
        Ok(status) if status.success() => Ok(Verdict::Agreed),
        Ok(status) => Err(Failure::Failed(format!("cargo {name} ended with {status}"))),
        Err(e) => Err(Failure::Failed(format!("cannot run cargo {name}: {e}"))),
    }
}
