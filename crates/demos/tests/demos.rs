//! Demonstrations end to end: written, read back, simulated again, continued, damaged.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use orchard_bench::store::Store;
use orchard_bench::task::{NoProgress, RunError, Session};
use orchard_demos::{
    Column, DemosError, DemosResult, Drive, DrivenDemos, PERSON, Plan, Table, Verdict, verify,
};
use orchard_env::{Settings, Task, Via};
use orchard_policy::{Control, Pixels, Spaces};
use orchard_scenario::{Scenario, controllers};

fn scenario() -> Scenario {
    Scenario::of(&[("controller", "expert")]).unwrap()
}

/// Reaches with depth and small pictures.
fn settings(control: Control) -> Settings {
    let pixels = Some(Pixels { height: 24, width: 32, hz: 5 });
    let settings = Settings::of(Task::Reach);
    Settings { spaces: Spaces { depth: true, pixels, control, ..settings.spaces }, ..settings }
}

fn plan(via: Via, episodes: u32) -> Plan {
    Plan::new(scenario(), settings(Control::JointDelta), via, vec![1, 2], episodes).unwrap()
}

fn run(plan: &Plan, folder: &Path, threads: usize) -> DemosResult {
    let (store, never) = (Store::open(folder).unwrap(), AtomicBool::new(false));
    orchard_demos::run(plan, &Session::whole(&store, threads, &never), &NoProgress).unwrap()
}

fn verified(folder: &Path) -> Verdict {
    verify(folder, &controllers(), 2, &AtomicBool::new(false), &|| ()).unwrap()
}

/// All files but the cost, by name.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut all = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.is_dir() {
            all.extend(files(&path).into_iter().map(|(file, bytes)| (format!("{name}/{file}"), bytes)));
        } else if name != "compute.json" && name != ".lock" {
            all.insert(name, fs::read(path).unwrap());
        }
    }
    all
}

#[test]
fn episodes_are_read_back_and_come_out_with_the_same_bytes() {
    for via in [Via::Commands, Via::Actions] {
        let folder = tempfile::tempdir().unwrap();
        let plan = plan(via, 3);
        let done = run(&plan, folder.path(), 2);
        let summary = done.summary.unwrap();
        assert_eq!((summary.all.episodes, summary.trees, summary.never_began), (3, 3, 0));
        assert!(summary.all.successes >= 2, "{via:?}: {:?}", summary.outcomes);
        assert!(done.cost.records_per_core_hour.unwrap() > 0.0);
        assert_eq!(verified(folder.path()), Verdict { episodes: 3, problems: Vec::new() });

        // The tables hold what a policy would have seen and done.
        let record = done.records[0].demonstration.as_ref().unwrap();
        let steps = Table::from_parquet(fs::read(folder.path().join(&record.steps.path)).unwrap()).unwrap();
        assert_eq!(steps.rows(), record.statistics.length as usize);
        let (width, actions) = steps.floats("action").unwrap();
        assert_eq!((width, actions.len()), (11, 11 * steps.rows()));
        assert!(actions.iter().all(|a| (-1.0..=1.0).contains(a)));
        assert_eq!(steps.floats("target").unwrap().0, 4);
        assert!(steps.texts("phase").unwrap().iter().any(|phase| phase == "grasp"));
        let commands =
            Table::from_parquet(fs::read(folder.path().join(&record.commands.path)).unwrap()).unwrap();
        assert_eq!(commands.rows(), record.frames as usize);
        // Each image is one file, also where the camera is slower than the policy.
        let depth = steps.texts("depth").unwrap();
        let mut shown: Vec<&String> = depth.iter().filter(|path| !path.is_empty()).collect();
        shown.dedup();
        assert!(shown.len() > 2 && shown.len() < steps.rows(), "{}", shown.len());
        assert!(shown.iter().all(|path| folder.path().join(path).is_file()));
        let Some(Column::Flag(ends)) = steps.column("terminated") else { panic!() };
        assert_eq!(ends.iter().filter(|end| **end).count(), usize::from(record.success));
    }
}

/// Images that only the controller saw do not change the saved state.
#[test]
fn stored_actions_lead_to_the_stored_state_without_images_too() {
    for (control, depth) in [(Control::JointAbsolute, false), (Control::EeDelta, true)] {
        let folder = tempfile::tempdir().unwrap();
        let settings = Settings::of(Task::Reach);
        let settings = Settings { spaces: Spaces { depth, control, ..settings.spaces }, ..settings };
        run(&Plan::new(scenario(), settings, Via::Actions, vec![1, 2], 2).unwrap(), folder.path(), 2);
        assert_eq!(verified(folder.path()), Verdict { episodes: 2, problems: Vec::new() });
    }
}

/// The target of the gentle task is a point with a heading, which the files state.
#[test]
fn the_gentle_task_is_demonstrated_too() {
    let folder = tempfile::tempdir().unwrap();
    let plan = Plan::new(scenario(), Settings::of(Task::Gentle), Via::Actions, vec![1], 1).unwrap();
    assert!(run(&plan, folder.path(), 1).summary.is_some());
    let meta = String::from_utf8(files(folder.path())["meta.json"].clone()).unwrap();
    assert!(meta.contains("Gentle-v1") && meta.contains("\"heading\""), "{meta}");
    assert_eq!(verified(folder.path()), Verdict { episodes: 1, problems: Vec::new() });
}

#[test]
fn a_run_continues_and_grows_and_does_not_depend_on_threads() {
    let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    run(&plan(Via::Commands, 1), folders[0].path(), 1);
    let grown = run(&plan(Via::Commands, 2), folders[0].path(), 2);
    // The first episode was there.
    let walls: Vec<bool> = grown.cost.records.iter().map(|record| record.wall_s.is_some()).collect();
    assert_eq!(walls, [false, true]);
    run(&plan(Via::Commands, 2), folders[1].path(), 1);
    assert_eq!(files(folders[0].path()), files(folders[1].path()));

    // A lost image and an edited table are found, and made again.
    let root = folders[0].path();
    let before = files(root);
    let image = before.keys().find(|name| name.starts_with("depth/")).unwrap();
    fs::remove_file(root.join(image)).unwrap();
    let problems = verified(root).problems;
    assert!(problems.len() == 1 && problems[0].contains(image.as_str()), "{problems:?}");
    let table = before.keys().rfind(|name| name.starts_with("steps/")).unwrap();
    let mut bytes = before[table].clone();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(root.join(table), bytes).unwrap();
    let problems = verified(root).problems;
    assert!(problems.iter().any(|p| p.contains("does not match its SHA-256")), "{problems:?}");
    run(&plan(Via::Commands, 2), root, 2);
    assert_eq!(files(root), before);

    // Another plan is refused, and nothing is written.
    let (store, never) = (Store::open(root).unwrap(), AtomicBool::new(false));
    let other = plan(Via::Actions, 2);
    let refused = orchard_demos::run(&other, &Session::whole(&store, 1, &never), &NoProgress);
    let e = match refused {
        Err(RunError::OtherPlan(e)) => e.to_string(),
        other => panic!("{other:?}"),
    };
    assert!(e.contains("via"), "{e}");
    assert_eq!(files(root), before);
}

#[test]
fn what_cannot_be_demonstrated_is_refused() {
    let with = |seeds: Vec<u64>, episodes| {
        Plan::new(scenario(), Settings::of(Task::Reach), Via::Commands, seeds, episodes).unwrap_err()
    };
    let official = 59_313_826_611_509;
    assert!(matches!(with(vec![1, official], 2), DemosError::Official(seed) if seed == official));
    assert_eq!(with(Vec::new(), 1).to_string(), "no seed given");
    assert_eq!(with(vec![3, 3], 2).to_string(), "seed 3 is given twice");
    assert_eq!(with(vec![3], 70_000).to_string(), "--episodes 70000: 1 seeds give at most 65536");
    assert!(with(vec![3], 0).to_string().starts_with("0 trees"));
    let folder = tempfile::tempdir().unwrap();
    let e =
        verify(folder.path(), &controllers(), 1, &AtomicBool::new(false), &|| ()).unwrap_err().to_string();
    assert!(e.contains("meta.json"), "{e}");
}

/// Frames of a drive.
const DRIVEN: usize = 130;

/// A drive of so many frames: the expert's commands, as a person might give them.
fn drive(seed: u64) -> Drive {
    let scenario = scenario();
    let (mut world, mut controller) = (scenario.world(seed, 0, 0).unwrap(), scenario.controller());
    let mut drive = Drive::default();
    for frame in 0..DRIVEN {
        let command = controller.act(&world.observe());
        world.step(&command);
        drive.push(command, if frame < 60 { PERSON } else { "scan" });
    }
    drive
}

/// An episode that a person drove is written, read and verified like that of a controller.
#[test]
fn what_a_person_drove_is_a_demonstration() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).unwrap();
    let settings = Settings::of(Task::Harvest);
    let settings = Settings { spaces: Spaces { depth: true, ..settings.spaces.clone() }, ..settings };
    let demos = DrivenDemos::new(&scenario(), &settings, &store).unwrap();
    for seed in [5, 3] {
        let record = demos.add(seed, &drive(seed)).unwrap();
        let demo = record.demonstration.unwrap();
        // Steps of six frames; what is left of the drive is no step.
        assert_eq!((demo.frames, demo.outcome.as_str(), demo.success), (126, "stopped", false));
    }
    assert_eq!(demos.seeds().unwrap(), [5, 3]);
    let verdict = verified(folder.path());
    assert_eq!((verdict.episodes, verdict.problems), (2, vec![]));
    let steps =
        Table::from_parquet(fs::read(folder.path().join("steps/000005-00000.parquet")).unwrap()).unwrap();
    assert_eq!(steps.rows(), 21);
    let Some((_, Column::Flag(truncated))) = steps.columns.iter().find(|(name, _)| name == "truncated")
    else {
        panic!()
    };
    assert!(truncated[20] && truncated[..20].iter().all(|cut| !cut));
    let phases = steps.texts("phase").unwrap();
    assert_eq!((phases[9].as_str(), phases[10].as_str()), (PERSON, "scan"));
    assert!(steps.floats("action").unwrap().1.iter().any(|number| *number != 0.0));
    // A seed once, none of the official set, and nothing without a step.
    let refused = |seed, frames| {
        let mut short = Drive::default();
        let command = scenario().robot().start_command();
        (0..frames).for_each(|_| short.push(command, PERSON));
        demos.add(seed, &short).unwrap_err().to_string()
    };
    assert!(refused(3, 60).starts_with("seed 3 has a demonstration"));
    let official = 59_313_826_611_509;
    assert!(refused(official, 60).starts_with(&format!("seed {official} is one of the official set")));
    assert!(refused(4, 5).starts_with("5 frames are less than a step of 6"));
    // A folder of a controller's demonstrations takes none of a person's.
    let other = tempfile::tempdir().unwrap();
    run(&plan(Via::Commands, 1), other.path(), 1);
    let store = Store::open(other.path()).unwrap();
    assert!(DrivenDemos::new(&scenario(), &settings, &store).is_err());
}
