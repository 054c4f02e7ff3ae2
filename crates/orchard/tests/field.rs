//! The benchmark in the field on the command line: its files, resuming, parts, reports, and bad input.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

fn orchard(folder: &Path, line: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_orchard"));
    command.args(line.split_whitespace()).current_dir(folder).stdin(Stdio::null());
    command.output().unwrap_or_else(|e| panic!("{e}"))
}

fn run(folder: &Path, line: &str) -> String {
    let output = orchard(folder, line);
    assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn refused(folder: &Path, line: &str) -> String {
    let output = orchard(folder, line);
    assert_eq!(output.status.code(), Some(2), "{line}");
    String::from_utf8_lossy(&output.stderr).into_owned()
}

const RUN: &str = "bench-field --conditions nominal,wind-3,odometry-0.1,d435i,husky-ur5e-2f85,calibrated --seeds 3 --trees 1 --horizon 0.2";

/// Files that depend on neither clock nor parts.
fn results(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut files = vec![("summary.json".to_owned(), fs::read(folder.join("summary.json")).unwrap())];
    let mut episodes: Vec<_> =
        fs::read_dir(folder.join("episodes")).unwrap().map(|e| e.unwrap().path()).collect();
    episodes.sort();
    files.extend(
        episodes
            .iter()
            .map(|path| (path.file_name().unwrap().to_string_lossy().into_owned(), fs::read(path).unwrap())),
    );
    files
}

#[test]
fn conditions_are_run_resumed_parted_and_reported() {
    let folder = tempfile::tempdir().unwrap();
    let home = folder.path();
    let said = run(home, &format!("{RUN} --out whole"));
    assert!(said.contains("condition wind-3:") && said.contains("conditions outside sweeps"), "{said}");
    let whole = results(&home.join("whole"));
    assert_eq!(whole.len(), 7);
    // What is there is not computed again, and what is missing is.
    fs::remove_file(home.join("whole/episodes").join(&whole[1].0)).unwrap();
    fs::remove_file(home.join("whole/summary.json")).unwrap();
    run(home, &format!("{RUN} --out whole"));
    assert!(results(&home.join("whole")) == whole);
    for part in ["1/2", "2/2"] {
        run(home, &format!("{RUN} --shard {part} --out part-{}", &part[..1]));
    }
    run(home, "merge part-1 part-2 --out merged");
    assert!(results(&home.join("merged")) == whole);
    run(home, "report merged --no-pictures");
    let page = fs::read_to_string(home.join("merged/report.html")).unwrap();
    for part in ["id=\"conditions\"", "id=\"sweep-wind\"", "husky-ur5e-2f85"] {
        assert!(page.contains(part), "{part}");
    }
    assert!(!page.contains("No foliage sweep"));
    // Another benchmark in the same folder is another plan.
    let e = refused(home, "bench-v1 --conditions nominal --seeds 3 --trees 1 --horizon 0.2 --out merged");
    assert!(e.contains("--out"), "{e}");
}

#[test]
fn bad_input_names_what_is_allowed() {
    let folder = tempfile::tempdir().unwrap();
    let home = folder.path();
    let e = refused(home, "bench-field --conditions rain --out x");
    assert!(
        e.contains("rain is neither a condition nor a group or sweep of them") && e.contains("populations"),
        "{e}"
    );
    let e = refused(home, "bench-field --seeds v1 --out x");
    assert!(e.contains("--seeds v1: the sets of this benchmark are tuning and field-v1"), "{e}");
    let e = refused(home, "bench-v1 --seeds field-v1 --out x");
    assert!(e.contains("the sets of this benchmark are tuning and v1"), "{e}");
    let e = refused(home, "bench-field --profile huge --out x");
    assert!(e.contains("quick") && e.contains("full"), "{e}");
    let e = refused(home, "bench-field --trees 0 --out x");
    assert!(e.contains("--trees"), "{e}");
    let rules = "[rules]\nbase = 'moon'\n";
    fs::write(home.join("moon.toml"), rules).unwrap();
    let e = refused(home, "bench-v1 --scenario moon.toml --out x");
    assert!(e.contains("rules: base: no protocol 'moon'; the protocols are: v1, field"), "{e}");
    assert!(!home.join("x").exists());
}
