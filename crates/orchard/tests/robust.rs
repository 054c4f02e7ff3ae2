//! Runs that are killed, fill the disk or get another run's folder: a result is correct or absent.

#![cfg(unix)]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use orchard_spec::{Purpose, Stream};

/// A run of six short episodes under three conditions.
const RUN: [&str; 10] = [
    "bench-v1",
    "--conditions",
    "fruit",
    "--trees",
    "2",
    "--seeds",
    "20250704",
    "--horizon",
    "2",
    "--threads",
];

fn bench(out: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_orchard"));
    command.args(RUN).arg("2").arg("--out").arg(out).stdin(Stdio::null());
    command
}

fn output(command: &mut Command) -> Output {
    command.output().unwrap_or_else(|e| panic!("{e}"))
}

/// Exit code and the last line of the error output.
fn end(output: &Output) -> (Option<i32>, String) {
    let text = String::from_utf8_lossy(&output.stderr);
    (output.status.code(), text.lines().last().unwrap_or_default().to_owned())
}

/// Every result file by its name under the folder, except those that depend on a clock.
fn results(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut files = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(&next).unwrap().flatten() {
            let path = entry.path();
            if path.is_dir() {
                folders.push(path);
            } else if !path.ends_with("compute.json") && !path.ends_with(".lock") {
                files.insert(path.strip_prefix(folder).unwrap().to_owned(), fs::read(&path).unwrap());
            }
        }
    }
    files
}

/// Runs the benchmark undisturbed; returns the duration as well.
fn whole(folder: &Path) -> (BTreeMap<PathBuf, Vec<u8>>, Duration) {
    let start = Instant::now();
    let output = output(&mut bench(folder));
    assert!(output.status.success(), "{:?}", end(&output));
    let files = results(folder);
    // Six episodes with their commands, the summary and the plan.
    assert_eq!(files.len(), 14, "{:?}", files.keys());
    (files, start.elapsed())
}

#[test]
fn a_run_that_is_killed_goes_on_to_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let (expected, mut time) = whole(&folder.path().join("whole"));
    let mut moments = Stream::new(1, 0, Purpose::Test);
    let (mut cut_short, mut kill) = (0, 0);
    while cut_short < 20 {
        kill += 1;
        assert!(kill <= 100, "{cut_short} runs were cut short");
        let out = folder.path().join(kill.to_string());
        let mut child = bench(&out).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        std::thread::sleep(time.mul_f64(moments.unit()));
        child.kill().unwrap();
        child.wait().unwrap();
        // A file with its final name is complete.
        let before = if out.is_dir() { results(&out) } else { BTreeMap::new() };
        for (name, bytes) in &before {
            if !name.to_string_lossy().contains(".writing-") {
                assert_eq!(Some(bytes), expected.get(name), "kill {kill}: {}", name.display());
            }
        }
        if before.contains_key(Path::new("summary.json")) {
            // The run was faster than the undisturbed one: on a busy machine durations vary.
            time = time.mul_f64(0.8);
        } else {
            cut_short += 1;
        }
        let again = output(&mut bench(&out));
        assert!(again.status.success(), "kill {kill}: {:?}", end(&again));
        assert_eq!(results(&out), expected, "kill {kill}");
        fs::remove_dir_all(&out).unwrap();
    }
}

/// The system refuses to write more than a few blocks to a file, as a full disk does.
#[test]
fn a_full_disk_is_told_and_leaves_nothing_half_written() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let line = format!(
        "trap '' XFSZ; ulimit -f 100; exec {} {} 2 --record --out {}",
        env!("CARGO_BIN_EXE_orchard"),
        RUN.join(" "),
        out.display()
    );
    let (code, message) = end(&output(Command::new("bash").args(["-c", &line])));
    assert_eq!(code, Some(1), "{message}");
    assert!(message.contains("recordings/") && message.contains("File too large"), "{message}");
    let names: Vec<PathBuf> = results(&out).into_keys().collect();
    let is_complete = |name: &PathBuf| name == Path::new("plan.json") || name.starts_with("commands");
    assert!(names.iter().all(is_complete), "{names:?}");
    // The run continues once there is space again.
    let (expected, _) = whole(&folder.path().join("whole"));
    assert!(output(&mut bench(&out)).status.success());
    assert_eq!(results(&out), expected);
}

/// Starts a run, waits for its first record, and returns it.
fn begun(out: &Path) -> std::process::Child {
    let child = bench(out).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let start = Instant::now();
    while fs::read_dir(out.join("episodes")).map_or(0, |entries| {
        entries.flatten().filter(|entry| entry.path().extension().is_some_and(|e| e == "json")).count()
    }) == 0
    {
        assert!(start.elapsed() < Duration::from_secs(300), "no record was written");
        std::thread::sleep(Duration::from_millis(5));
    }
    child
}

/// SIGTERM, as Slurm and Kubernetes send it, ends a run like Ctrl-C; the exit codes differ.
#[test]
fn signals_end_a_run_with_whole_files() {
    let folder = tempfile::tempdir().unwrap();
    let (expected, _) = whole(&folder.path().join("whole"));
    for (signal, code) in [("TERM", 143), ("INT", 130)] {
        let out = folder.path().join(signal);
        let child = begun(&out);
        let kill = Command::new("kill").args(["-s", signal, &child.id().to_string()]).status().unwrap();
        assert!(kill.success());
        let (found, message) = end(&child.wait_with_output().unwrap());
        assert_eq!(found, Some(code), "{signal}: {message}");
        assert!(message.starts_with("error: interrupted: "), "{message}");
        let left = results(&out);
        assert!(!left.contains_key(Path::new("summary.json")), "{:?}", left.keys());
        assert!(left.iter().all(|(name, bytes)| expected.get(name) == Some(bytes)), "{:?}", left.keys());
        assert!(output(&mut bench(&out)).status.success());
        assert_eq!(results(&out), expected, "{signal}");
    }
}

/// A folder that is moved while a run writes: the run ends with an error, and neither place holds a result that looks whole.
#[test]
fn a_folder_that_is_moved_ends_the_run() {
    let folder = tempfile::tempdir().unwrap();
    let (out, away) = (folder.path().join("out"), folder.path().join("away"));
    let child = begun(&out);
    fs::rename(&out, &away).unwrap();
    let (code, message) = end(&child.wait_with_output().unwrap());
    assert_eq!(code, Some(1), "{message}");
    assert!(message.contains("was moved, removed or replaced while this run wrote into it"), "{message}");
    assert!(!out.exists() && !away.join("summary.json").exists());
    // It continues at the new place.
    let (expected, _) = whole(&folder.path().join("whole"));
    assert!(output(&mut bench(&away)).status.success());
    assert_eq!(results(&away), expected);
}

/// One word in a record, which would change a metric: the record is computed again, and a merge refuses it.
#[test]
fn an_edited_record_is_not_believed() {
    let folder = tempfile::tempdir().unwrap();
    let (out, copy) = (folder.path().join("out"), folder.path().join("copy"));
    let (expected, _) = whole(&out);
    whole(&copy);
    let name = "episodes/baseline-nominal-20250704-000.json";
    let text = String::from_utf8(expected[Path::new(name)].clone()).unwrap();
    let edited = text.replacen("\"on_tree\"", "\"deposited\"", 1);
    assert_ne!(edited, text);
    fs::write(out.join(name), &edited).unwrap();

    for parts in [[&out, &copy], [&copy, &out]] {
        let mut merge = Command::new(env!("CARGO_BIN_EXE_orchard"));
        merge.arg("merge").args(parts).arg("--out").arg(folder.path().join("merged"));
        let (code, message) = end(&output(&mut merge));
        assert_eq!(code, Some(2), "{message}");
        let paths = [&out, &copy].map(|part| part.join(name).display().to_string());
        assert!(paths.iter().all(|path| message.contains(path)), "{message}");
        assert!(message.contains("copies of one record and differ"), "{message}");
        assert!(results(&folder.path().join("merged")).is_empty());
    }

    let mut explain = Command::new(env!("CARGO_BIN_EXE_orchard"));
    let (code, message) = end(&output(explain.arg("explain").arg(out.join(name)).arg("--text")));
    assert_eq!(code, Some(2), "{message}");
    assert!(message.ends_with("does not match its checksum: it is damaged or was edited"), "{message}");

    // Figures and tables do not come from the record, but a report of it would vouch for it.
    let report = |folder: &Path| {
        let mut report = Command::new(env!("CARGO_BIN_EXE_orchard"));
        end(&output(report.arg("report").arg(folder).arg("--no-pictures")))
    };
    let (code, message) = report(&out);
    assert_eq!(code, Some(2), "{message}");
    assert!(message.contains(name) && message.ends_with("it is damaged or was edited"), "{message}");

    let again = output(&mut bench(&out));
    assert!(again.status.success(), "{:?}", end(&again));
    let told = String::from_utf8_lossy(&again.stderr).into_owned();
    assert!(told.contains(&format!("{name} is damaged or was edited: it will be computed again")), "{told}");
    assert_eq!(results(&out), expected);
    fs::write(out.join("summary.json"), "{\n  \"checksum\": \"0\"}").unwrap();
    let (code, message) = report(&out);
    assert_eq!(code, Some(2), "{message}");
    assert!(message.contains("summary.json"), "{message}");
}

/// Commands of another episode in the place of a log: every command that reads the folder notices it.
#[test]
fn a_command_log_that_is_not_the_one_of_its_record_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let (expected, _) = whole(&out);
    let log = |world: u32| format!("commands/baseline-nominal-20250704-{world:03}.postcard.gz");
    fs::copy(out.join(log(1)), out.join(log(0))).unwrap();
    let record = out.join("episodes/baseline-nominal-20250704-000.json");
    let mut explain = Command::new(env!("CARGO_BIN_EXE_orchard"));
    explain.arg("explain").arg(&record).arg("--text");
    let mut report = Command::new(env!("CARGO_BIN_EXE_orchard"));
    report.arg("report").arg(&out).arg("--no-pictures");
    let mut merge = Command::new(env!("CARGO_BIN_EXE_orchard"));
    merge.arg("merge").arg(&out).arg("--out").arg(folder.path().join("merged"));
    for command in [&mut explain, &mut report, &mut merge] {
        let (code, message) = end(&output(command));
        assert_eq!(code, Some(2), "{message}");
        assert!(message.contains(&log(0)) && message.contains("does not match the SHA-256"), "{message}");
    }
    assert!(!folder.path().join("merged/summary.json").exists());
    assert!(output(&mut bench(&out)).status.success());
    assert_eq!(results(&out), expected);
}

#[test]
fn folders_that_cannot_be_used_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    fs::write(&file, "no folder").unwrap();
    let (code, message) = end(&output(&mut bench(&file.join("out"))));
    assert_eq!(code, Some(2), "{message}");
    assert!(message.starts_with("error: --out: ") && message.contains("file/out"), "{message}");

    // A file where the records' folder belongs.
    let out = folder.path().join("out");
    fs::create_dir(&out).unwrap();
    fs::write(out.join("episodes"), "no folder").unwrap();
    let (code, message) = end(&output(&mut bench(&out)));
    assert_eq!(code, Some(1), "{message}");
    assert!(message.contains("out/episodes"), "{message}");

    // Another process uses the folder.
    whole(&folder.path().join("whole"));
    let busy = folder.path().join("busy");
    fs::create_dir(&busy).unwrap();
    let lock = fs::File::create(busy.join(".lock")).unwrap();
    lock.lock().unwrap();
    fs::copy(folder.path().join("whole/compute.json"), busy.join("compute.json")).unwrap();
    let data_set = folder.path().join("data");
    fs::create_dir(&data_set).unwrap();
    let data_lock = fs::File::create(data_set.join(".lock")).unwrap();
    data_lock.lock().unwrap();
    let mut report = Command::new(env!("CARGO_BIN_EXE_orchard"));
    report.arg("report").arg(&busy);
    let mut dataset = Command::new(env!("CARGO_BIN_EXE_orchard"));
    dataset.args(["dataset", "--seeds", "1..2", "--out"]).arg(&data_set);
    for command in [&mut bench(&busy), &mut report, &mut dataset] {
        let (code, message) = end(&output(command));
        assert_eq!(code, Some(2), "{message}");
        assert!(message.contains("another run is using this folder"), "{message}");
    }
}

#[test]
fn parts_make_the_bytes_of_the_whole() {
    let folder = tempfile::tempdir().unwrap();
    let (expected, _) = whole(&folder.path().join("whole"));
    let part = |i: u32| folder.path().join(format!("part-{i}"));
    for i in 1..=3 {
        let output = output(bench(&part(i)).args(["--shard", &format!("{i}/3")]));
        assert!(output.status.success(), "{:?}", end(&output));
        // Two episodes with their commands and the plan; a part sums up to nothing.
        assert_eq!(results(&part(i)).len(), 5);
    }
    let merge = |parts: &[u32], out: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_orchard"));
        command.arg("merge").args(parts.iter().map(|i| part(*i))).arg("--out").arg(folder.path().join(out));
        end(&output(&mut command))
    };
    let (code, message) = merge(&[1, 3], "partial");
    assert_eq!(code, Some(2), "{message}");
    assert!(message.contains("2 of 6 episodes are missing; the first is episodes/baseline-"), "{message}");
    assert!(!folder.path().join("partial/summary.json").exists());
    assert_eq!(merge(&[2, 3, 1], "merged").0, Some(0));
    assert_eq!(results(&folder.path().join("merged")), expected);
}

#[test]
fn bad_input_is_told_before_anything_is_computed() {
    let folder = tempfile::tempdir().unwrap();
    let told = |args: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_orchard"));
        command.arg("bench-v1").args(args).arg("--out").arg(folder.path().join("out"));
        end(&output(&mut command))
    };
    for (args, part) in [
        (&["--trees", "0"][..], "--trees: "),
        (&["--conditions", "windy"], "--conditions: windy is neither a condition nor a group or sweep"),
        (&["--shard", "4/3"], "'4/3' must be I/N"),
        (&["--seeds", "v2"], "use 'tuning', 'v1' or 'field-v1', or whole numbers"),
        (&["--controller", "nobody"], "--controller: no controller 'nobody'; the controllers are:"),
        (&["--preset", "lemon"], "--preset: no preset 'lemon'"),
        (&["--preset", "paper", "--randomisation", "2"], "--randomisation 2: must be a strength in [0, 1]"),
    ] {
        let (code, message) = told(args);
        assert_eq!(code, Some(2), "{args:?}: {message}");
        assert!(message.contains(part), "{args:?}: {message}");
        assert!(!folder.path().join("out").exists(), "{args:?}");
    }
}

/// A world that stopped before the moment to be drawn is told, with the moment and the reason; nothing is drawn.
#[test]
fn a_world_that_stands_still_is_not_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let (config, out) = (folder.path().join("small.toml"), folder.path().join("a.png"));
    let extent =
        "plausible_extent = { value = 1.0, range = [1.0, 1000.0], unit = \"m\", source = \"solver\" }";
    fs::write(&config, format!("preset = \"small\"\nbase = \"paper\"\n[sim]\n{extent}\n")).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_orchard"));
    command.arg("render").arg("--config").arg(&config).args(["--time", "1", "--out"]).arg(&out);
    let (code, message) = end(&output(&mut command));
    assert_eq!(code, Some(2), "{message}");
    assert!(message.contains("--time 1: the world of seed 20250704, tree 0 stands still from "), "{message}");
    assert!(message.contains("left the plausible box of 1 m"), "{message}");
    assert!(!out.exists());
}
