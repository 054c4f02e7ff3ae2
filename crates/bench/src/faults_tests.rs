//! Every fault at every operation of a small benchmark and of a merge; and edits, folders that go away.

use std::fs;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::AtomicBool;

use crate::atomic_file::AtomicFile;
use crate::fake::{Sum, SumKey, keys};
use crate::fake_task::Sums;
use crate::gather::merge;
use crate::record::Record;
use crate::shard::Shard;
use crate::store::Store;
use crate::sweep::Scenario;
use crate::task::{NoProgress, Progress, Session, finish, run_task};

/// A run of the first keys into a folder, in part or whole.
fn run(folder: &Path, keys: &[SumKey], shard: &str, progress: &impl Progress<Sum>) -> Result<(), String> {
    let store = Store::open(folder).map_err(|e| e.to_string())?;
    let _lock = store.lock().map_err(|e| e.to_string())?;
    let stop = AtomicBool::new(false);
    let shard: Shard = shard.parse()?;
    let session = Session { store: &store, threads: 1, shard, stop: &stop };
    run_task(&Sums(keys.to_vec()), &session, progress).map(drop).map_err(|e| e.to_string())
}

#[test]
fn a_benchmark_survives_every_fault() {
    let scenario = Scenario {
        prepare: &|_| (),
        run: &|folder| run(folder, &keys()[..3], "1/1", &NoProgress),
        last: &["sums.json"],
        derived: &[],
        timed: &["compute.json"],
    };
    // Two folders, an old summary removed; begin, write and name three records, the cost and the summary.
    assert_eq!(scenario.sweep(), 3 + 3 * 5);
}

#[test]
fn a_larger_benchmark_in_the_same_folder_survives_every_fault() {
    let scenario = Scenario {
        prepare: &|folder| run(folder, &keys()[..2], "1/1", &NoProgress).unwrap(),
        run: &|folder| run(folder, &keys()[..4], "1/1", &NoProgress),
        last: &["sums.json"],
        derived: &[],
        timed: &["compute.json"],
    };
    scenario.sweep();
}

#[test]
fn a_merge_survives_every_fault() {
    let parts = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    for (part, shard) in parts.iter().zip(["1/2", "2/2"]) {
        run(part.path(), &keys()[..4], shard, &NoProgress).unwrap();
    }
    let scenario = Scenario {
        // An older result of a smaller plan is there.
        prepare: &|folder| run(folder, &keys()[..1], "1/1", &NoProgress).unwrap(),
        run: &|folder: &Path| -> Result<(), String> {
            let from: Vec<Store> = parts.iter().map(|part| Store::open(part.path()).unwrap()).collect();
            let into = Store::open(folder).map_err(|e| e.to_string())?;
            let _lock = into.lock().map_err(|e| e.to_string())?;
            let task = Sums(keys()[..4].to_vec());
            let records = merge(&task, &[&from[0], &from[1]], &into).map_err(|e| e.to_string())?;
            finish(&task, &records, &into).map(drop).map_err(|e| e.to_string())
        },
        last: &["sums.json"],
        derived: &[],
        timed: &["compute.json"],
    };
    scenario.sweep();
}

#[test]
fn an_atomic_file_survives_every_fault() {
    let scenario = Scenario {
        prepare: &|_| (),
        run: &|folder: &Path| -> Result<(), String> {
            let store = Store::open(folder).map_err(|e| e.to_string())?;
            let _lock = store.lock().map_err(|e| e.to_string())?;
            let mut file = AtomicFile::begin(&folder.join("recordings/a")).map_err(|e| e.to_string())?;
            std::io::Write::write_all(&mut file, b"bytes").map_err(|e| e.to_string())?;
            file.finish().map_err(|e| e.to_string())
        },
        last: &["recordings/a"],
        derived: &[],
        timed: &[],
    };
    assert_eq!(scenario.sweep(), 4);
}

/// Collects notes.
#[derive(Default)]
struct Notes(Mutex<Vec<String>>);

impl Progress<Sum> for Notes {
    fn note(&self, line: &str) {
        self.0.lock().unwrap().push(line.to_owned());
    }
}

/// Resuming does not believe an edited record: it is named and computed again.
#[test]
fn an_edited_record_is_computed_again_and_named() {
    let folder = tempfile::tempdir().unwrap();
    run(folder.path(), &keys()[..3], "1/1", &NoProgress).unwrap();
    let files =
        || ["sums/fake-7-001.json", "sums.json"].map(|name| fs::read(folder.path().join(name)).unwrap());
    let whole = files();
    let text = String::from_utf8(whole[0].clone()).unwrap();
    fs::write(folder.path().join("sums/fake-7-001.json"), text.replace("\"sum\": 8", "\"sum\": 800"))
        .unwrap();
    let notes = Notes::default();
    run(folder.path(), &keys()[..3], "1/1", &notes).unwrap();
    let told = notes.0.lock().unwrap().clone();
    assert_eq!(told, ["sums/fake-7-001.json is damaged or was edited: it will be computed again"]);
    assert_eq!(files(), whole);
}

/// Moves a folder, or removes a file, after the second record.
struct Meddle<'a>(Mutex<u32>, &'a (dyn Fn() + Sync));

impl Progress<Sum> for Meddle<'_> {
    fn record(&self, _: &Sum, _: bool) {
        let mut done = self.0.lock().unwrap();
        *done += 1;
        if *done == 2 {
            self.1();
        }
    }
}

#[cfg(unix)]
#[test]
fn a_run_ends_when_its_files_go_away() {
    let place = tempfile::tempdir().unwrap();
    let (out, away) = (place.path().join("out"), place.path().join("away"));
    let meddled = |meddle: &(dyn Fn() + Sync)| {
        let e = run(&out, &keys()[..3], "1/1", &Meddle(Mutex::new(0), meddle)).unwrap_err();
        for folder in [&out, &away] {
            assert!(!folder.join("sums.json").exists(), "{e}");
        }
        let _ = fs::remove_dir_all(&out);
        let _ = fs::remove_dir_all(&away);
        e
    };
    let moved = "was moved, removed or replaced while this run wrote into it";
    let e = meddled(&|| fs::rename(&out, &away).unwrap());
    assert!(e.contains(moved) && !out.exists(), "{e}");
    let e = meddled(&|| fs::remove_dir_all(out.join(Sum::FOLDER)).unwrap());
    assert!(e.contains(moved), "{e}");
    let e = meddled(&|| fs::remove_file(out.join("sums/fake-7-000.json")).unwrap());
    assert!(e.contains("fake-7-000.json: was removed during the run"), "{e}");
    // Two folders of the same path one after the other.
    let e = meddled(&|| {
        fs::remove_dir_all(&out).unwrap();
        fs::create_dir_all(out.join(Sum::FOLDER)).unwrap();
    });
    assert!(e.contains(moved), "{e}");
}
