//! Whole fake runs: bytes, threads, resumption, interruption, damage.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use crate::episode::EpisodeRecord;
use crate::fake::{FakeFactory, plan};
use crate::plan::Plan;
use crate::run::{RunResult, run};
use crate::store::Store;
use crate::task::{Progress, RunError, Silent};

fn go(
    folder: &Path,
    plan: &Plan,
    threads: usize,
    progress: &impl Progress<EpisodeRecord>,
) -> Result<RunResult, RunError> {
    let store = Store::open(folder).unwrap();
    run(plan, &FakeFactory, &store, threads, &AtomicBool::new(false), progress)
}

/// All result files but the one that a clock may change.
fn files(folder: &Path) -> BTreeMap<String, String> {
    let mut files = BTreeMap::new();
    for dir in [folder.to_owned(), folder.join("episodes")] {
        for entry in fs::read_dir(dir).unwrap().flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            if entry.path().is_file() && name != "compute.json" {
                files.insert(name, fs::read_to_string(entry.path()).unwrap());
            }
        }
    }
    files
}

#[derive(Default)]
struct Heard {
    computed: AtomicU32,
    reused: AtomicU32,
    notes: Mutex<Vec<String>>,
}

impl Progress<EpisodeRecord> for Heard {
    fn record(&self, _: &EpisodeRecord, reused: bool) {
        let counter = if reused { &self.reused } else { &self.computed };
        counter.fetch_add(1, Ordering::Relaxed);
    }

    fn note(&self, line: &str) {
        self.notes.lock().unwrap().push(line.to_owned());
    }
}

impl Heard {
    fn counts(&self) -> (u32, u32) {
        (self.computed.load(Ordering::Relaxed), self.reused.load(Ordering::Relaxed))
    }
}

#[test]
fn same_bytes_for_any_thread_count() {
    let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    for (folder, threads) in folders.iter().zip([1, 2, 2]) {
        go(folder.path(), &plan(), threads, &Silent).unwrap();
    }
    let first = files(folders[0].path());
    assert_eq!(first.len(), 9);
    assert!(first.keys().all(|name| name.ends_with(".json")), "{:?}", first.keys());
    assert_eq!(first, files(folders[1].path()));
    assert_eq!(first, files(folders[2].path()));
    assert!(folders[0].path().join("compute.json").exists());
}

#[test]
fn a_world_that_cannot_be_built_is_counted() {
    let folder = tempfile::tempdir().unwrap();
    let result = go(folder.path(), &plan(), 1, &Silent).unwrap();
    let nominal = &result.summary.conditions["nominal"];
    assert_eq!(nominal.outcomes["quarantined"], 2);
    assert_eq!(nominal.metrics["fruit_deposited_per_tree"].n, 8);
    assert_eq!(result.episodes[2].frames, 0);
}

#[test]
fn whole_episodes_are_reused_and_others_computed_again() {
    let folder = tempfile::tempdir().unwrap();
    go(folder.path(), &plan(), 1, &Silent).unwrap();
    let before = files(folder.path());

    let episodes = folder.path().join("episodes");
    fs::remove_file(episodes.join("fake-nominal-7-001.json")).unwrap();
    fs::write(episodes.join("fake-nominal-8-003.json"), "{ \"schema_version\": 1, ").unwrap();
    let heard = Heard::default();
    let result = go(folder.path(), &plan(), 2, &heard).unwrap();
    assert_eq!(heard.counts(), (2, 6));
    assert_eq!(
        *heard.notes.lock().unwrap(),
        ["episodes/fake-nominal-8-003.json is damaged and is computed again"]
    );
    assert_eq!(files(folder.path()), before);
    let walls = result.compute.episodes.iter().filter(|e| e.wall_s.is_some()).count();
    assert_eq!(walls, 2);

    // Another config: nothing may be reused.
    let other = Plan { config_hash: "0".repeat(64), ..plan() };
    let heard = Heard::default();
    go(folder.path(), &other, 1, &heard).unwrap();
    assert_eq!(heard.counts(), (8, 0));

    // Fewer seeds: the rest is named, not mixed in.
    let fewer = Plan { seeds: vec![7], ..other };
    let heard = Heard::default();
    let result = go(folder.path(), &fewer, 1, &heard).unwrap();
    assert_eq!(heard.counts(), (0, 4));
    assert_eq!(heard.notes.lock().unwrap().len(), 4);
    assert_eq!(result.summary.conditions["nominal"].episodes.len(), 4);
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
    go(whole.path(), &plan(), 1, &Silent).unwrap();
    // A summary of an earlier run must not outlive the start of this one.
    fs::write(cut.path().join("summary.json"), "old").unwrap();

    let stop = AtomicBool::new(false);
    let progress = StopEarly { stop: &stop, finished: AtomicU32::new(0) };
    let store = Store::open(cut.path()).unwrap();
    let error = run(&plan(), &FakeFactory, &store, 1, &stop, &progress).map(|_| ()).unwrap_err();
    assert_eq!(
        error.to_string(),
        "interrupted: 3 of 8 episodes are whole; the same command goes on from there"
    );
    let left = files(cut.path());
    assert_eq!(left.len(), 3);
    for (name, text) in &left {
        assert_eq!(*text, files(whole.path())[name]);
    }

    let heard = Heard::default();
    go(cut.path(), &plan(), 2, &heard).unwrap();
    assert_eq!(heard.counts(), (5, 3));
    assert_eq!(files(cut.path()), files(whole.path()));
}

#[test]
fn zero_trees_are_refused_before_anything_is_touched() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("summary.json"), "old").unwrap();
    let mut plan = plan();
    plan.conditions[0].params.trees = 0;
    let error = go(folder.path(), &plan, 1, &Silent).map(|_| ()).unwrap_err();
    assert_eq!(error.to_string(), "0 trees: at least 1 tree a seed is needed");
    assert!(folder.path().join("summary.json").exists());
}

#[test]
fn repeats_have_keys_and_files_of_their_own() {
    let folder = tempfile::tempdir().unwrap();
    let plan = plan().repeated("nominal", 2).repeated("exhaustion", 9);
    let result = go(folder.path(), &plan, 2, &Silent).unwrap();
    assert_eq!(result.episodes.len(), 16);
    let places: Vec<(u64, u32, u32)> =
        result.episodes.iter().map(|e| (e.key.seed, e.key.world, e.key.repeat)).collect();
    assert!(places.is_sorted(), "{places:?}");
    let files = files(folder.path());
    assert!(
        files.contains_key("fake-nominal-7-001.json") && files.contains_key("fake-nominal-7-001-r1.json")
    );
    assert_eq!(files.len(), 17);
    assert!(result.summary.conditions["nominal"].variance.is_some());
    // A run without repeats is the same in them: its episodes are reused, the others named.
    let heard = Heard::default();
    go(folder.path(), &crate::fake::plan(), 1, &heard).unwrap();
    assert_eq!((heard.counts(), heard.notes.lock().unwrap().len()), ((0, 8), 8));
}
