//! The leaderboard by the program itself. The result of a controller that only its author's program has is replayed, run again by that
//! program, and refused when its commands were edited; results added by several processes at once are all kept.

#![cfg(unix)]

use std::fs;
use std::io::ErrorKind;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::thread;
use std::time::Duration;

use orchardbench::{Command as RobotCommand, Controller, Observation, Program, Record, custom};

/// Variable with the command line of the author's program, for [`the_authors_program`].
const LINE: &str = "ORCHARD_TEST_LINE";

/// The official matrix, cut down to one tree and one second a seed.
const SCENARIO: &str = "[rules.full]
trees = { value = 1, range = [1, 100000], unit = 'trees a seed', source = 'protocol' }
horizon = { value = 1.0, range = [0.1, 36000.0], unit = 's', source = 'protocol' }
conditions = ['nominal']
";

/// Drives forward and never picks anything.
struct Drive(RobotCommand, Record);

impl Controller for Drive {
    fn act(&mut self, _: &Observation) -> RobotCommand {
        RobotCommand { base_velocity: [0.1, 0.0, 0.0], ..self.0 }
    }
    fn record(&self) -> &Record {
        &self.1
    }
}

/// No test: the author's program, which [`program`] starts in a process of its own.
#[test]
fn the_authors_program() {
    let Ok(line) = std::env::var(LINE) else { return };
    let drive = custom("drive", "1", |robot, _| Drive(robot.start_command(), Record::default()));
    let words = std::iter::once("drive").chain(line.split_whitespace());
    Program::new().with(drive).call(words).unwrap();
}

/// A file that starts the author's program.
fn program(folder: &Path) -> PathBuf {
    let (path, this) = (folder.join("program"), std::env::current_exe().unwrap());
    let text = format!(
        "#!/bin/sh\n{LINE}=\"$*\" exec '{}' --exact the_authors_program --nocapture\n",
        this.display()
    );
    fs::write(&path, text).unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
    path
}

fn small_scenario(folder: &Path) -> PathBuf {
    let path = folder.join("small.toml");
    fs::write(&path, SCENARIO).unwrap();
    path
}

/// Runs a command. A child that another thread has just started may hold the script open for a moment, as it was when it was written.
fn output(command: &mut Command) -> Output {
    loop {
        match command.stdin(Stdio::null()).output() {
            Err(e) if e.kind() == ErrorKind::ExecutableFileBusy => thread::sleep(Duration::from_millis(10)),
            output => return output.unwrap_or_else(|e| panic!("{e}")),
        }
    }
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn a_foreign_result_is_replayed_or_run_again_and_an_edited_one_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (program, out) = (program(folder.path()), folder.path().join("result"));
    let scenario = small_scenario(folder.path());
    let mut bench = Command::new(&program);
    bench.args([
        "bench-v1",
        "--tasks",
        "harvest",
        "--profile",
        "full",
        "--controller",
        "drive",
        "--scenario",
    ]);
    let ran = output(bench.arg(&scenario).arg("--out").arg(&out));
    assert!(ran.status.success(), "{}{}", text(&ran.stdout), text(&ran.stderr));

    let add = |board: &str, more: &[&Path]| {
        let mut add = Command::new(env!("CARGO_BIN_EXE_orchard"));
        add.args(["leaderboard", "add"])
            .arg(&out)
            .args(["--seed-set", "tuning", "--scenario"])
            .arg(&scenario);
        add.args(["--snapped", "9", "--dropped", "99", "--board"]).arg(folder.path().join(board)).args(more);
        let ended = output(&mut add);
        (ended.status.code(), text(&ended.stdout), text(&ended.stderr))
    };
    let warning = "is executed with your rights; run a program that you do not trust in a sandbox";
    let (code, said, notes) = add("replayed.json", &[]);
    assert_eq!(code, Some(0), "{notes}");
    assert!(said.contains(": replayed, 3 of 3 episodes; on the board as drive"), "{said}");
    assert!(!notes.contains(warning), "{notes}");

    let (code, said, notes) = add("run.json", &[Path::new("--run-program"), &program]);
    assert_eq!(code, Some(0), "{notes}");
    assert!(said.contains(": re-run, 3 of 3 episodes; on the board as drive"), "{said}");
    assert!(notes.contains(&format!("warning: {} {warning}", program.display())), "{notes}");
    let class = |board: &str| {
        let board = fs::read_to_string(folder.path().join(board)).unwrap();
        ["re_run", "replayed"].map(|class| board.contains(&format!("\"class\": \"{class}\"")))
    };
    assert_eq!((class("replayed.json"), class("run.json")), ([false, true], [true, false]));

    // A program that does something else, or nothing at all.
    let (code, _, notes) = add("false.json", &[Path::new("--run-program"), Path::new("/bin/false")]);
    assert_eq!(code, Some(2), "{notes}");
    // The commands of another tree.
    let log = |seed: &str| out.join(format!("commands/drive-nominal-{seed}-000.postcard.gz"));
    fs::copy(log("20250705"), log("20250704")).unwrap();
    for more in [&[][..], &[Path::new("--run-program"), &program]] {
        let (code, _, notes) = add("edited.json", more);
        assert_eq!(code, Some(2), "{notes}");
        let path = log("20250704").display().to_string();
        assert!(
            notes.contains(&path) && notes.contains("does not match the SHA-256 in its record"),
            "{notes}"
        );
    }
    for board in ["false.json", "edited.json"] {
        assert!(!folder.path().join(board).exists(), "{board}");
    }
}

#[test]
fn results_that_processes_add_at_once_are_all_kept() {
    let folder = tempfile::tempdir().unwrap();
    let scenario = small_scenario(folder.path());
    let orchard = || {
        let mut command = Command::new(env!("CARGO_BIN_EXE_orchard"));
        command.current_dir(folder.path()).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        command
    };
    let controllers = ["baseline", "paper", "expert"];
    for controller in controllers {
        let mut bench = orchard();
        bench.args(["bench-v1", "--tasks", "harvest", "--profile", "full", "--controller", controller]);
        let ran = bench.args(["--out", controller, "--scenario"]).arg(&scenario).output().unwrap();
        assert!(ran.status.success(), "{}", text(&ran.stderr));
    }
    let adds = controllers.map(|controller| {
        let mut add = orchard();
        add.args(["leaderboard", "add", controller, "--name", controller, "--board", "board.json"]);
        add.args(["--seed-set", "tuning", "--snapped", "9", "--dropped", "99", "--scenario"]);
        add.arg(&scenario).spawn().unwrap()
    });
    for add in adds {
        let ended = add.wait_with_output().unwrap();
        assert!(ended.status.success(), "{}", text(&ended.stderr));
    }
    let board = fs::read_to_string(folder.path().join("board.json")).unwrap();
    for controller in controllers {
        assert!(board.contains(&format!("\"name\": \"{controller}\"")), "{controller}: {board}");
    }
}
