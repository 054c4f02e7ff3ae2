//! Tests of result folders: damage, whole files, folders that are moved or removed.

use super::*;
use crate::fake::{Sum, SumKey, record};
#[cfg(unix)]
use crate::faults::{Fault, Kind, Watch, moved};

fn stored(store: &Store, key: &SumKey) -> Stored<Sum> {
    store.stored(key)
}

#[test]
fn stored_records_are_told_apart() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).unwrap();
    let record = record(0);
    assert!(matches!(stored(&store, &record.key), Stored::Missing));
    store.write_record(&record).unwrap();
    match stored(&store, &record.key) {
        Stored::Whole(read) => assert_eq!(*read, record),
        other => panic!("{other:?}"),
    }
    let other = SumKey { config_hash: "other".into(), ..record.key.clone() };
    assert!(matches!(stored(&store, &other), Stored::Other));

    let path = folder.path().join(Sum::path(&record.key));
    let text = fs::read_to_string(&path).unwrap();
    let without = String::from_utf8(encode_plain(&record).unwrap()).unwrap();
    let edited = text.replace("\"sum\": 7", "\"sum\": 9");
    assert_ne!(edited, text);
    for damaged in
        [&edited, &without, &text[..text.len() / 2], &text.replace("\"sum\": 7", "\"sum\":  7"), ""]
    {
        fs::write(&path, damaged).unwrap();
        assert!(matches!(stored(&store, &record.key), Stored::Damaged), "{damaged}");
    }
    // Older code wrote no checksums.
    fs::write(&path, without.replace(crate::CODE_VERSION, "0.0.1")).unwrap();
    assert!(matches!(stored(&store, &record.key), Stored::Other));
}

#[test]
fn a_damaged_file_is_told_when_it_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).unwrap();
    assert!(store.read("summary.json").unwrap().is_none());
    store.write("summary.json", &record(0)).unwrap();
    assert_eq!(store.read("summary.json").unwrap().unwrap(), encode_plain(&record(0)).unwrap());
    let path = folder.path().join("summary.json");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replace("\"sum\": 7", "\"sum\": 9")).unwrap();
    let e = store.read("summary.json").unwrap_err().to_string();
    assert!(e.ends_with("summary.json: does not match its checksum: it is damaged or was edited"), "{e}");
}

#[test]
fn nothing_but_whole_files_is_left() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).unwrap();
    store.write("summary.json", &record(1)).unwrap();
    store.write("summary.json", &record(0)).unwrap();
    assert_eq!(fs::read(folder.path().join("summary.json")).unwrap(), encode(&record(0)).unwrap());
    store.remove("summary.json").unwrap();
    store.remove("summary.json").unwrap();
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    assert!(store.write("nowhere/x.json", &record(0)).unwrap_err().to_string().contains("nowhere/x.json"));
}

/// Moves, removes or replaces a folder between two writes; the second must fail and write nothing.
#[cfg(unix)]
#[test]
fn a_folder_that_goes_away_ends_the_run() {
    type Change = fn(&Path, &Path);
    let changes: [Change; 3] = [
        |folder, away| fs::rename(folder, away).unwrap(),
        |folder, _| fs::remove_dir_all(folder).unwrap(),
        |folder, away| {
            fs::rename(folder, away).unwrap();
            fs::create_dir_all(folder.join("sums")).unwrap();
        },
    ];
    for change in changes {
        for of in ["", "sums"] {
            let place = tempfile::tempdir().unwrap();
            let (out, away) = (place.path().join("out"), place.path().join("away"));
            let store = Store::open(&out).unwrap();
            store.write_record(&record(0)).unwrap();
            change(&if of.is_empty() { out.clone() } else { out.join(of) }, &away);
            let told = "was moved, removed or replaced while this run wrote into it";
            let e = store.write_record(&record(1)).unwrap_err().to_string();
            assert!(e.contains(told), "{e}");
            let e = store.check_files([Sum::path(&record(0).key)]).unwrap_err().to_string();
            assert!(e.contains("was removed during the run"), "{e}");
            if of.is_empty() {
                let e = store.write("summary.json", &record(0)).unwrap_err().to_string();
                assert!(e.contains(told), "{e}");
                let e = store.remove("summary.json").unwrap_err().to_string();
                assert!(e.contains(told), "{e}");
            }
            assert!(!out.join(Sum::path(&record(1).key)).exists() && !out.join("summary.json").exists());
        }
    }
}

/// Moves the folder in the middle of a write, at each of its operations; each end tells of the move.
#[cfg(unix)]
#[test]
fn a_folder_that_goes_away_during_a_write_is_told() {
    // Makes the folder of the records; begins, writes and names a record; removes a file.
    for at in 0..5 {
        let place = tempfile::tempdir().unwrap();
        let out = place.path().join("out");
        let store = Store::open(&out).unwrap();
        let _watch = Watch::begin(&out, Some(Fault { kind: Kind::Move, at }));
        let e = store
            .write_record(&record(0))
            .and_then(|()| store.remove("summary.json"))
            .unwrap_err()
            .to_string();
        assert!(e.contains("was moved, removed or replaced while this run wrote into it"), "{at}: {e}");
        assert!(!out.exists() && moved(&out).is_dir());
    }
}
