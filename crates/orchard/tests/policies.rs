//! Learned policies by the program itself: run, recorded, replayed, explained, verified; files and tasks that do not fit are refused.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use orchard_env::{Settings, Task, TaskEnv};
use orchard_policy::{Pixels, Spaces};
use orchard_scenario::Scenario;

/// The official matrix, cut down to one tree and one second a seed.
const SCENARIO: &str = "controller = 'onnx:harvest.onnx'
[rules.full]
trees = { value = 1, range = [1, 100000], unit = 'trees a seed', source = 'protocol' }
horizon = { value = 1.0, range = [0.1, 36000.0], unit = 's', source = 'protocol' }
conditions = ['nominal']
";

/// Trials of one second.
const SHORT: &str = "controller = 'onnx:pixels.onnx'
[rules.component.grasp]
time = { value = 1.0, range = [0.1, 36000.0], unit = 's', source = 'protocol' }
[rules.component.gentle]
time = { value = 1.0, range = [0.1, 36000.0], unit = 's', source = 'protocol' }
";

/// Runs the program in a folder; returns its exit code and what it printed.
fn orchard(folder: &Path, line: &str) -> (i32, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_orchard"))
        .args(line.split(' '))
        .current_dir(folder)
        .stdin(Stdio::null())
        .output()
        .unwrap_or_else(|e| panic!("{e}"));
    let said = [output.stdout, output.stderr].concat();
    (output.status.code().unwrap_or(-1), String::from_utf8_lossy(&said).into_owned())
}

fn done(folder: &Path, line: &str) -> String {
    let (code, said) = orchard(folder, line);
    assert_eq!(code, 0, "{line}: {said}");
    said
}

/// Writes a policy as a training script does: a network of random weights, and the interface of the environment.
fn policy(folder: &Path, name: &str, task: Task) {
    let settings = Settings::of(task);
    let pixels = Some(Pixels { height: 24, width: 32, hz: 5 }).filter(|_| name == "pixels");
    let spaces = Spaces { depth: task == Task::Harvest, pixels, ..settings.spaces.clone() };
    let env = TaskEnv::new(&Scenario::of(&[]).unwrap(), &Settings { spaces, ..settings }, 0..1).unwrap();
    fs::write(folder.join(format!("{name}.json")), serde_json::to_string(env.interface()).unwrap()).unwrap();
    let network = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(format!("../../tests/network/{name}.onnx"));
    fs::copy(network, folder.join(format!("{name}.onnx"))).unwrap();
}

#[test]
fn a_policy_is_run_recorded_replayed_explained_and_ranked() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    policy(at, "harvest", Task::Harvest);
    let run = "bench-v1 --controller onnx:harvest.onnx --tasks harvest --conditions nominal --trees 1 --horizon 1 --record --out";
    done(at, &format!("{run} first"));
    done(at, &format!("{run} second"));
    let [record, recording] = [
        "episodes/onnx-harvest-nominal-20250704-000.json",
        "recordings/onnx-harvest-nominal-20250704-000.mcap",
    ];
    for file in [record, recording, "plan.json", "summary.json"] {
        let [a, b] = ["first", "second"]
            .map(|run| fs::read(at.join(run).join(file)).unwrap_or_else(|e| panic!("{file}: {e}")));
        assert_eq!(a, b, "{file}");
    }
    // The result holds the policy: its files are not needed any more.
    let kept = at.join("elsewhere");
    fs::create_dir(&kept).unwrap();
    fs::rename(at.join("harvest.onnx"), kept.join("harvest.onnx")).unwrap();
    fs::rename(at.join("harvest.json"), kept.join("harvest.json")).unwrap();
    let said = done(at, &format!("replay first/{recording}"));
    assert!(
        said.contains("controller: agrees in every byte")
            && said.contains("file: the replay has the same bytes"),
        "{said}"
    );
    done(at, &format!("explain first/{record}"));

    fs::write(kept.join("small.toml"), SCENARIO).unwrap();
    done(
        at,
        "bench-v1 --scenario elsewhere/small.toml --tasks harvest --profile full --seeds tuning --out official",
    );
    fs::write(at.join("board.toml"), SCENARIO.replace("controller = 'onnx:harvest.onnx'\n", "")).unwrap();
    let said = done(
        at,
        "leaderboard add official --seed-set tuning --budget gentle --scenario board.toml --board board.json",
    );
    assert!(said.contains("re-run"), "{said}");
}

#[test]
fn the_policy_that_learned_here_holds_fruit() {
    let folder = tempfile::tempdir().unwrap();
    let learned = concat!(env!("CARGO_MANIFEST_DIR"), "/../../policies/reach-ppo.onnx");
    done(
        folder.path(),
        &format!("bench-v1 --tasks reach-and-grasp --controller onnx:{learned} --trees 2 --out run"),
    );
    let text = fs::read_to_string(folder.path().join("run/reach-and-grasp.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&text).unwrap();
    let successes = summary["outcomes"]["success"].as_u64();
    assert!(successes >= Some(4), "{text}");
}

#[test]
fn the_policy_that_was_cloned_here_harvests_by_its_camera() {
    let folder = tempfile::tempdir().unwrap();
    let cloned = concat!(env!("CARGO_MANIFEST_DIR"), "/../../policies/harvest-clone.onnx");
    let run =
        "bench-v1 --tasks harvest --conditions nominal --seeds 20250704 --trees 1 --horizon 40 --out run";
    done(folder.path(), &format!("{run} --controller onnx:{cloned}"));
    let text = fs::read_to_string(folder.path().join("run/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&text).unwrap();
    let episode = &summary["conditions"]["nominal"]["episodes"][0];
    assert!(episode["deposited"].as_u64() >= Some(1), "{episode}");
}

#[test]
fn a_policy_that_sees_colour_runs_in_every_task() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    policy(at, "pixels", Task::Harvest);
    let run = "bench-v1 --controller onnx:pixels.onnx --tasks harvest --conditions nominal --trees 1 --horizon 0.5 --record --out seen";
    done(at, run);
    let said = done(at, "replay seen/recordings/onnx-pixels-nominal-20250704-000.mcap");
    assert!(said.contains("controller: agrees in every byte"), "{said}");
    let said = done(at, "explain seen/episodes/onnx-pixels-nominal-20250704-000.json");
    assert!(!said.contains("GAVE UP"), "{said}");
    fs::write(at.join("small.toml"), SCENARIO.replace("harvest.onnx", "pixels.onnx")).unwrap();
    done(at, "bench-v1 --scenario small.toml --tasks harvest --profile full --seeds tuning --out official");
    fs::write(at.join("board.toml"), SCENARIO.replace("controller = 'onnx:harvest.onnx'\n", "")).unwrap();
    let said = done(
        at,
        "leaderboard add official --seed-set tuning --budget gentle --scenario board.toml --board board.json",
    );
    assert!(said.contains("re-run"), "{said}");

    policy(at, "pixels", Task::Gentle);
    fs::write(at.join("short.toml"), SHORT).unwrap();
    done(
        at,
        "bench-v1 --scenario short.toml --tasks reach-and-grasp,gentle --seeds 20250704 --trees 1 --out pushed",
    );
    for task in ["reach-and-grasp", "gentle"] {
        let summary = fs::read_to_string(at.join(format!("pushed/{task}.json"))).unwrap();
        assert!(summary.contains("time_over") && !summary.contains("gave_up"), "{summary}");
    }
}

#[test]
fn a_network_that_gives_no_numbers_is_told_and_counted() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    policy(at, "fault", Task::Harvest);
    let said = done(
        at,
        "bench-v1 --controller onnx:fault.onnx --tasks harvest --conditions nominal --trees 1 --horizon 1 --record --out ill",
    );
    assert!(said.contains("THE CONTROLLER GAVE UP") && said.contains("action_not_finite 1"), "{said}");
    let name = "onnx-fault-nominal-20250704-000";
    let record = fs::read_to_string(at.join(format!("ill/episodes/{name}.json"))).unwrap();
    let record: serde_json::Value = serde_json::from_str(&record).unwrap();
    // At 10 Hz the third action is the first after 0.15 s.
    assert_eq!(record["gave_up"]["fault"], "action_not_finite");
    assert!((record["gave_up"]["time"].as_f64().unwrap() - 0.2).abs() < 1e-9, "{}", record["gave_up"]);
    let summary = fs::read_to_string(at.join("ill/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    assert_eq!(summary["gave_up"]["action_not_finite"], 1);
    let said = done(at, &format!("explain ill/episodes/{name}.json"));
    assert!(
        said.contains("the controller GAVE UP at 0.2 s and held the robot still: action not finite"),
        "{said}"
    );
    let said = done(at, &format!("replay ill/recordings/{name}.mcap"));
    assert!(said.contains("controller: agrees in every byte"), "{said}");
}

#[test]
fn tasks_and_files_that_do_not_fit_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    policy(at, "harvest", Task::Harvest);
    policy(at, "reach", Task::Reach);
    let refused = |line: &str| {
        let (code, said) = orchard(at, line);
        assert_eq!(code, 2, "{line}: {said}");
        said
    };
    let said = refused("bench-v1 --controller onnx:harvest.onnx --tasks reach-and-grasp --trees 1");
    assert!(said.contains("controller onnx-harvest cannot be given a goal"), "{said}");
    let said = refused("bench-v1 --controller onnx:reach.onnx --tasks harvest --trees 1");
    assert!(said.contains("controller onnx-reach needs a goal"), "{said}");
    let said = refused("render --controller onnx:reach.onnx --out a.png");
    assert!(said.contains("controller onnx-reach: it needs a goal"), "{said}");
    let said = refused("scenario show --controller onnx:reach.onnx --camera d435i --robot fr3-fixed");
    assert!(said.contains("the policy was made for robot ridgeback-fr3"), "{said}");
    fs::write(at.join("harvest.onnx"), b"\xff\xff\xff\xff").unwrap();
    let said = refused("bench-v1 --controller onnx:harvest.onnx --tasks harvest --trees 1");
    assert!(
        said.contains("--controller onnx:harvest.onnx: the network: not a model in ONNX format"),
        "{said}"
    );
    let said = done(at, "scenario show --controller onnx:reach.onnx --preset tall-spindle");
    assert!(
        said.contains("note: controller onnx-reach: the policy learned Reach-v1 in another scene"),
        "{said}"
    );
}
