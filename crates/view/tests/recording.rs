//! Recorded episodes, written by the benchmark, opened from their files.
#![cfg(feature = "recording")]

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use orchard_bench::digest::sha256;
use orchard_bench::store::Store;
use orchard_bench::task::NoProgress;
use orchard_bench::{Session, run_task};
use orchard_play::Sight;
use orchard_recording::file::Header;
use orchard_recording::{Channel, Recording, RecordingConfig, Recordings, name_of};
use orchard_scenario::{Options, Scenario};
use orchard_tasks::harvest::{Episodes, Harvest};
use orchard_view::{Dials, NOBODY, RECORDED, Stage};
use orchard_world::World;

/// Length of the episode \[s\].
const SECONDS: f64 = 0.5;

fn harvest() -> Harvest {
    Harvest::new(Scenario::of(&[("controller", "expert")]).unwrap()).unwrap()
}

/// Records an episode, as `orchard bench-v1 --record` does.
fn record(folder: &Path) -> PathBuf {
    let harvest = harvest();
    let plan = harvest.plan("quick", vec![20250704], 1, SECONDS);
    let recordings = Recordings::new(folder, RecordingConfig::paper(), harvest.scenario());
    let (store, never) = (Store::open(folder).unwrap(), AtomicBool::new(false));
    let task = Episodes { plan: &plan, factory: &harvest, watch: &recordings };
    run_task(&task, &Session::whole(&store, 1, &never), &NoProgress).unwrap();
    folder.join(name_of(&plan.episodes()[0]))
}

fn open(recording: &Recording) -> Stage {
    let controllers = orchard_scenario::controllers();
    orchard_view::recorded(recording, &harvest(), Options::default(), &controllers).unwrap()
}

/// The hashes of the recorded world, by frame.
fn hashes(recording: &Recording) -> Vec<String> {
    let messages = recording.messages().unwrap().map(Result::unwrap);
    let states = messages.filter(|message| message.channel == Channel::StateHash);
    states
        .map(|message| serde_json::from_slice::<serde_json::Value>(&message.data).unwrap())
        .map(|state| state["sha256"].as_str().unwrap().to_owned())
        .collect()
}

/// The world on show has the recorded hash at every frame that the controller saw, and the same state wherever one goes, forward and back.
#[test]
fn a_file_is_shown_frame_by_frame() {
    let folder = tempfile::tempdir().unwrap();
    let recording = Recording::open(&record(folder.path())).unwrap();
    let hashes = hashes(&recording);
    let mut stage = open(&recording);
    let frames = stage.recorded_frames().unwrap();
    assert_eq!(frames as usize + 1, hashes.len());
    // After the episode's time the benchmark looks no more, so that its camera stands still.
    let seen = recording.counts()[&Channel::JointStates] as u32;
    assert_eq!(f64::from(seen), SECONDS * 60.0);
    for expected in &hashes[..seen as usize] {
        let mut hash = String::new();
        let mut before = |world: &World, _: &Sight<'_>| hash = sha256(&world.snapshot().to_bytes());
        stage.session_mut().step_seen(&mut before);
        assert_eq!(hash, *expected, "frame {}", stage.session().world().frame() - 1);
    }
    stage.reset();
    let digest = |stage: &Stage| stage.session().world().state_digest();
    let mut digests = vec![digest(&stage)];
    while stage.step() {
        digests.push(digest(&stage));
    }
    assert!(digests.len() == hashes.len() && stage.is_as_recorded());
    for frame in [7, frames, 0, 21] {
        stage.seek(frame).unwrap();
        assert_eq!(digest(&stage), digests[frame as usize], "frame {frame}");
    }
    assert_eq!(stage.dials().driver, RECORDED);
    stage.drive_by(NOBODY).unwrap();
    stage.turn(Dials { seed: 3, ..stage.dials().clone() }).unwrap();
    assert!(stage.recorded_frames().is_none());
}

/// Files that cannot be shown are refused with what to do.
#[test]
fn other_files_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = record(folder.path());
    let refused = |bytes: &[u8]| {
        fs::write(&file, bytes).unwrap();
        Recording::open(&file).unwrap_err().advised()
    };
    let whole = fs::read(&file).unwrap();
    let recording = Recording::open(&file).unwrap();
    let mut here = Header::new(&recording.header().key, "x".to_owned(), recording.header().scenario.clone());
    here.key.code_version = "0123".to_owned();
    let other = recording.check(&here).unwrap_err().advised();
    assert!(
        other.contains("recorded with code version ") && other.contains(", this is 0123; take the program"),
        "{other}"
    );
    let cut = refused(&whole[..whole.len() / 2]);
    assert!(
        cut.contains(": the file is cut off or damaged: ") && cut.contains("; copy it again, or"),
        "{cut}"
    );
    let text = refused(b"a diary, long enough to be anything");
    assert!(text.contains(": not an MCAP file; recordings of episodes stand in "), "{text}");
    fs::remove_file(&file).unwrap();
    let missing = Recording::open(&file).unwrap_err().advised();
    assert!(missing.starts_with(&file.display().to_string()), "{missing}");
}
