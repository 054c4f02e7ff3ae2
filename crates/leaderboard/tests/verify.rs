//! A small submission of real episodes is run again and replayed, and refused when an episode is forged.

use std::sync::atomic::AtomicBool;

use orchard_bench::store::Store;
use orchard_bench::{NoProgress, Session, run_task};
use orchard_leaderboard::{Budget, Checked, Class, Entry, Refusal, Submission};
use orchard_robot::io::Command;
use orchard_scenario::Scenario;
use orchard_tasks::harvest::command_log::{CommandLog, CommandLogs, path_of};
use orchard_tasks::harvest::summary::Summary;
use orchard_tasks::harvest::{Episodes, Extent, Harvest, WorldFactory};

#[test]
fn real_episodes_come_out_as_they_were_submitted() {
    let harvest = Harvest::new(Scenario::of(&[("controller", "expert")]).unwrap()).unwrap();
    let extent = Extent {
        profile: "full".into(),
        conditions: vec!["nominal".into(), "fruit-20".into()],
        seeds: vec![20250704],
        trees: 1,
        repeats: 2,
        horizon_s: 1.0,
    };
    let plan = harvest.plan_of(extent).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let (store, stop) = (Store::open(folder.path()).unwrap(), AtomicBool::new(false));
    let logs = CommandLogs::new(folder.path());
    let task = Episodes { plan: &plan, factory: &harvest, watch: &logs };
    let result = run_task(&task, &Session::whole(&store, 2, &stop), &NoProgress).unwrap();
    assert_eq!(logs.size().0, 3);

    let submission = Submission::read(folder.path(), &plan).unwrap();
    submission.check_trees(&plan, &harvest, 2, &stop, &NoProgress).unwrap();
    repeat(&submission, &plan, &harvest).unwrap();
    repeat(&submission, &plan, &submission.replays(&harvest)).unwrap();
    assert_eq!(Some(&submission.summary), result.summary.as_ref());
    let checked = Checked { class: Class::ReRun, episodes: 3 };
    let entry = Entry::new("expert", Budget::of_figures(0.0, 0.0).unwrap(), &submission, checked).unwrap();
    assert_eq!((entry.episodes, entry.quarantined, entry.completeness), (3, 0, 0.0));

    // A forged log whose hash stands in a forged record has a frame more than the episode.
    let mut records = result.records.clone();
    let key = records[1].key.clone();
    let path = folder.path().join(path_of(&key));
    let honest = std::fs::read(&path).unwrap();
    let mut forged = CommandLog::read(folder.path(), &key).unwrap();
    forged.push(&Command::still(&harvest.build(&key).unwrap().0.observe()), &[]);
    std::fs::write(&path, forged.to_bytes().unwrap()).unwrap();
    records[1].commands_sha256 = Some(forged.sha256());
    store.write_record(&records[1]).unwrap();
    store.write("summary.json", &Summary::of_run(&plan, &records)).unwrap();
    let submission = Submission::read(folder.path(), &plan).unwrap();
    let e = repeat(&submission, &plan, &submission.replays(&harvest)).unwrap_err().to_string();
    assert!(e.contains("comes out otherwise when run again: commands_sha256 is"), "{e}");
    std::fs::write(&path, honest).unwrap();

    // A position in the 17th digit, with a summary to match, is found by its tree;
    let mut records = result.records;
    let p = &mut records[1].fruit[3].p_world[2];
    *p = p.next_up();
    let forge = |records: &[_]| {
        store.write_record(&records[1]).unwrap();
        store.write("summary.json", &Summary::of_run(&plan, records)).unwrap();
        Submission::read(folder.path(), &plan).unwrap()
    };
    let forged = forge(&records);
    let e = forged.check_trees(&plan, &harvest, 2, &stop, &NoProgress).unwrap_err().to_string();
    let file = "episodes/expert-nominal-20250704-000-r1.json";
    assert!(e.starts_with(&format!("{file} is not of the tree of its seed: fruit[3].p_world[2]")), "{e}");
    // a force, by its episode: run again or replayed.
    let p = &mut records[1].fruit[3].p_world[2];
    *p = p.next_down();
    records[1].max_stem_pull_n = records[1].max_stem_pull_n.map(f64::next_up);
    let forged = forge(&records);
    forged.check_trees(&plan, &harvest, 2, &stop, &NoProgress).unwrap();
    for e in [repeat(&forged, &plan, &harvest), repeat(&forged, &plan, &forged.replays(&harvest))] {
        let e = e.unwrap_err().to_string();
        assert!(e.starts_with(&format!("{file} comes out otherwise when run again: max_stem_pull_n")), "{e}");
    }
}

/// Runs all episodes again.
fn repeat<F: WorldFactory>(
    submission: &Submission,
    plan: &orchard_tasks::harvest::plan::Plan,
    factory: &F,
) -> Result<(), Refusal> {
    let folder = tempfile::tempdir().unwrap();
    let (store, stop) = (Store::open(folder.path()).unwrap(), AtomicBool::new(false));
    let all: Vec<usize> = (0..submission.records.len()).collect();
    submission.repeat(plan, factory, &all, &Session::whole(&store, 2, &stop), &NoProgress)
}
