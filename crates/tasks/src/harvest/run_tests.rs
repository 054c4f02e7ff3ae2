//! Whole fake runs: bytes, threads, resumption, interruption, damage.

use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use orchard_bench::store::Store;
use orchard_bench::task::{NoProgress, Progress, RunError, Session};
use orchard_scenario::Names;

use crate::backend::Backend;
use crate::fake::progress::{CountingProgress, files};
use crate::fake::{FakeFactory, plan};
use crate::harvest::episode::EpisodeRecord;
use crate::harvest::plan::Plan;
use crate::harvest::run::{RunResult, run};

fn go(
    folder: &Path,
    plan: &Plan,
    threads: usize,
    progress: &impl Progress<EpisodeRecord>,
) -> Result<RunResult, RunError> {
    let store = Store::open(folder).unwrap();
    run(plan, &FakeFactory, &Session::whole(&store, threads, &AtomicBool::new(false)), progress)
}

#[test]
fn same_bytes_for_any_thread_count() {
    let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    for (folder, threads) in folders.iter().zip([1, 2, 2]) {
        go(folder.path(), &plan(), threads, &NoProgress).unwrap();
    }
    let first = files(folders[0].path(), "episodes");
    assert_eq!(first.len(), 9);
    assert!(first.keys().all(|name| name.ends_with(".json")), "{:?}", first.keys());
    assert_eq!(first, files(folders[1].path(), "episodes"));
    assert_eq!(first, files(folders[2].path(), "episodes"));
    assert!(folders[0].path().join("compute.json").exists());
}

#[test]
fn a_world_that_cannot_be_built_is_counted() {
    let folder = tempfile::tempdir().unwrap();
    let result = go(folder.path(), &plan(), 1, &NoProgress).unwrap();
    let nominal = &result.summary.as_ref().unwrap().conditions["nominal"];
    assert_eq!(nominal.outcomes["quarantined"], 2);
    assert_eq!(nominal.metrics["fruit_deposited_per_tree"].n, 8);
    assert_eq!(result.records[2].frames, 0);
}

#[test]
fn whole_episodes_are_reused_and_others_computed_again() {
    let folder = tempfile::tempdir().unwrap();
    go(folder.path(), &plan(), 1, &NoProgress).unwrap();
    let before = files(folder.path(), "episodes");

    let episodes = folder.path().join("episodes");
    fs::remove_file(episodes.join("fake-nominal-7-001.json")).unwrap();
    fs::write(episodes.join("fake-nominal-8-003.json"), "{ \"schema_version\": 1, ").unwrap();
    let progress = CountingProgress::default();
    let result = go(folder.path(), &plan(), 2, &progress).unwrap();
    assert_eq!(progress.counts(), (2, 6));
    assert_eq!(
        progress.notes(),
        ["episodes/fake-nominal-8-003.json is damaged or was edited: it will be computed again"]
    );
    assert_eq!(files(folder.path(), "episodes"), before);
    let walls = result.cost.records.iter().filter(|e| e.wall_s.is_some()).count();
    assert_eq!(walls, 2);

    // Records of another code version are not mixed with these.
    let path = episodes.join("fake-nominal-7-000.json");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replace(orchard_bench::CODE_VERSION, "0.0.0")).unwrap();
    let progress = CountingProgress::default();
    go(folder.path(), &plan(), 1, &progress).unwrap();
    assert_eq!(progress.counts(), (1, 7));
    assert_eq!(files(folder.path(), "episodes"), before);
}

#[test]
fn another_plan_is_refused_before_anything_is_touched() {
    let folder = tempfile::tempdir().unwrap();
    go(folder.path(), &plan(), 1, &NoProgress).unwrap();
    let before = files(folder.path(), "episodes");
    let longer = |mut plan: Plan| {
        plan.conditions[0].params.horizon_s += 1.0;
        plan
    };
    for (other, what) in [
        (Plan { scenario: Names::paper("gardener"), ..plan() }, "controller \"fake\", not \"gardener\""),
        (Plan { config_hash: "0".repeat(64), ..plan() }, "config_hash "),
        (Plan { seeds: vec![7], ..plan() }, "seed 8, not 7"),
        (longer(plan()), "horizon_frames "),
    ] {
        let error = go(folder.path(), &other, 1, &NoProgress).map(|_| ()).unwrap_err();
        assert!(matches!(error, RunError::OtherPlan(_)), "{error}");
        let line = error.to_string();
        assert!(line.contains(what) && line.contains(&folder.path().display().to_string()), "{line}");
        assert_eq!(files(folder.path(), "episodes"), before);
        assert!(folder.path().join("compute.json").exists());
    }

    // The same plan with one more seed continues from there; the error names a file that is not a record.
    fs::write(folder.path().join("episodes/notes.json"), "mine").unwrap();
    let progress = CountingProgress::default();
    go(folder.path(), &Plan { seeds: vec![7, 8, 9], ..plan() }, 1, &progress).unwrap();
    assert_eq!(progress.counts(), (4, 8));
    assert_eq!(progress.notes(), ["episodes/notes.json is not a record and is ignored"]);
}

/// Raises the stop flag in the first frame after three episodes (the third is one that cannot be built).
struct StopEarly<'a> {
    stop: &'a AtomicBool,
    finished: AtomicU32,
}

impl Progress<EpisodeRecord> for StopEarly<'_> {
    fn step(&self) {
        if self.finished.load(Ordering::Relaxed) == 3 {
            self.stop.store(true, Ordering::Relaxed);
        }
    }

    fn record(&self, _: &EpisodeRecord, _: bool) {
        self.finished.fetch_add(1, Ordering::Relaxed);
    }
}

#[test]
fn an_interrupted_run_leaves_whole_files_and_goes_on() {
    let (cut, whole) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    go(whole.path(), &plan(), 1, &NoProgress).unwrap();
    // A summary of an earlier run must not outlive the start of this one.
    fs::write(cut.path().join("summary.json"), "old").unwrap();

    let stop = AtomicBool::new(false);
    let progress = StopEarly { stop: &stop, finished: AtomicU32::new(0) };
    let store = Store::open(cut.path()).unwrap();
    let error =
        run(&plan(), &FakeFactory, &Session::whole(&store, 1, &stop), &progress).map(|_| ()).unwrap_err();
    assert_eq!(
        error.to_string(),
        "interrupted: 3 of 8 episodes are complete; run the same command again to continue"
    );
    let left = files(cut.path(), "episodes");
    assert_eq!(left.len(), 3);
    for (name, text) in &left {
        assert_eq!(*text, files(whole.path(), "episodes")[name]);
    }

    let progress = CountingProgress::default();
    go(cut.path(), &plan(), 2, &progress).unwrap();
    assert_eq!(progress.counts(), (5, 3));
    assert_eq!(files(cut.path(), "episodes"), files(whole.path(), "episodes"));
}

#[test]
fn zero_trees_are_refused_before_anything_is_touched() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("summary.json"), "old").unwrap();
    let mut plan = plan();
    plan.conditions[0].params.trees = 0;
    let error = go(folder.path(), &plan, 1, &NoProgress).map(|_| ()).unwrap_err();
    assert_eq!(error.to_string(), "0 trees: at least 1 tree per seed is needed");
    assert!(folder.path().join("summary.json").exists());
}

fn repeated(repeats: u32) -> Plan {
    let mut plan = plan();
    plan.conditions[0].params.repeats = repeats;
    plan
}

#[test]
fn repeats_have_keys_and_files_of_their_own() {
    let folder = tempfile::tempdir().unwrap();
    let plan = repeated(2);
    let result = go(folder.path(), &plan, 2, &NoProgress).unwrap();
    assert_eq!(result.records.len(), 16);
    let places: Vec<(u64, u32, u32)> =
        result.records.iter().map(|e| (e.key.seed, e.key.world, e.key.repeat)).collect();
    assert!(places.is_sorted(), "{places:?}");
    let files = files(folder.path(), "episodes");
    assert!(
        files.contains_key("fake-nominal-7-001.json") && files.contains_key("fake-nominal-7-001-r1.json")
    );
    assert_eq!(files.len(), 17);
    assert!(result.summary.as_ref().unwrap().conditions["nominal"].variance.is_some());
    // A plan without repeats is refused; a larger plan with these and other episodes reuses the stored ones.
    let other = go(folder.path(), &crate::fake::plan(), 1, &NoProgress);
    assert!(matches!(other, Err(RunError::OtherPlan(_))));
    let progress = CountingProgress::default();
    go(folder.path(), &plan, 1, &progress).unwrap();
    assert_eq!(progress.counts(), (0, 16));
}

/// Records of one backend are not those of the other, although their files have the same names.
#[test]
fn a_folder_holds_episodes_of_one_backend() {
    let on = |backend| Plan { backend, ..plan() };
    for (first, second) in [(Backend::Cpu, Backend::Gpu), (Backend::Gpu, Backend::Cpu)] {
        let folder = tempfile::tempdir().unwrap();
        go(folder.path(), &on(first), 1, &NoProgress).unwrap();
        go(folder.path(), &on(first), 1, &NoProgress).unwrap();
        let e = go(folder.path(), &on(second), 1, &NoProgress).unwrap_err().to_string();
        assert!(e.contains("holds results of another plan") && e.contains("backend"), "{e}");
    }
}
