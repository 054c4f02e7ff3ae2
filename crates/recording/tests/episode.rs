//! A moment of a real episode, recorded, read back and replayed.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::AtomicBool;

use mcap::records::MessageHeader;
use mcap::{Attachment, WriteOptions, Writer};
use orchard_bench::store::Store;
use orchard_bench::{Progress, Session, run_task};
use orchard_recording::channel::Origin;
use orchard_recording::file::Header;
use orchard_recording::replay::{Differs, Replayed, replay};
use orchard_recording::{Channel, Message, Recording, RecordingConfig, RecordingError, Recordings, name_of};
use orchard_scenario::Scenario;
use orchard_tasks::harvest::Episodes;
use orchard_tasks::harvest::Harvest;
use orchard_tasks::harvest::episode::EpisodeRecord;
use orchard_tasks::harvest::plan::Plan;
use orchard_tasks::protocol::Protocol;

/// Long enough for some images and some movement \[s\].
const SECONDS: f64 = 1.0;

fn plan(harvest: &Harvest, seeds: &[u64]) -> Plan {
    harvest.plan("quick", seeds.to_vec(), 1, SECONDS)
}

/// Counts the records that were reused.
#[derive(Default)]
struct Reused(std::sync::atomic::AtomicU32);

impl Progress<EpisodeRecord> for Reused {
    fn record(&self, _: &EpisodeRecord, reused: bool) {
        self.0.fetch_add(u32::from(reused), std::sync::atomic::Ordering::Relaxed);
    }
}

/// Records episodes into a folder; how many records were reused.
fn record(folder: &Path, seeds: &[u64], threads: usize) -> u32 {
    record_as(&[], folder, seeds, threads)
}

/// Records episodes of the scenario that options make.
fn record_as(options: &[(&str, &str)], folder: &Path, seeds: &[u64], threads: usize) -> u32 {
    let harvest = Harvest::new(Scenario::of(options).unwrap()).unwrap();
    let store = Store::open(folder).unwrap();
    let recordings = Recordings::new(folder, RecordingConfig::paper(), harvest.scenario());
    let (plan, reused, never) = (plan(&harvest, seeds), Reused::default(), AtomicBool::new(false));
    let task = Episodes { plan: &plan, factory: &harvest, watch: &recordings };
    run_task(&task, &Session::whole(&store, threads, &never), &reused).unwrap();
    reused.0.into_inner()
}

/// One recording for all tests that only read it.
fn recorded() -> &'static Path {
    static FILE: OnceLock<(tempfile::TempDir, PathBuf)> = OnceLock::new();
    let (_, file) = FILE.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        record(folder.path(), &[20250704], 1);
        let key = plan(&Harvest::new(Scenario::of(&[]).unwrap()).unwrap(), &[20250704]).episodes().remove(0);
        let file = folder.path().join(name_of(&key));
        (folder, file)
    });
    file
}

fn replayed(file: &Path) -> Replayed {
    let harvest = Harvest::new(Scenario::of(&[]).unwrap()).unwrap();
    let recording = Recording::open(file).unwrap();
    let (protocol, never) = (Protocol::paper(), AtomicBool::new(false));
    let config = RecordingConfig::paper();
    let frame = harvest.frame();
    replay(&recording, &harvest, &protocol, frame, &config, &never, &mut || ()).unwrap()
}

#[test]
fn the_same_bytes_for_any_number_of_threads_and_a_lost_one_is_made_again() {
    let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    let seeds = [20250704, 20250705];
    assert_eq!(record(folders[0].path(), &seeds, 1), 0);
    assert_eq!(record(folders[1].path(), &seeds, 2), 0);
    let names: Vec<String> = plan(&Harvest::new(Scenario::of(&[]).unwrap()).unwrap(), &seeds)
        .episodes()
        .iter()
        .map(name_of)
        .collect();
    let bytes = |i: usize| names.iter().map(|n| fs::read(folders[i].path().join(n)).unwrap()).collect();
    let first: Vec<Vec<u8>> = bytes(0);
    assert!(first[0] != first[1]);
    assert_eq!(first, bytes(1));

    // One is lost and one is cut off: both are made again, and then both are kept.
    fs::remove_file(folders[1].path().join(&names[0])).unwrap();
    fs::write(folders[1].path().join(&names[1]), &first[1][..first[1].len() / 2]).unwrap();
    assert_eq!(record(folders[1].path(), &seeds, 2), 0);
    assert_eq!(first, bytes(1));
    assert_eq!(record(folders[1].path(), &seeds, 2), 2);
    let files = fs::read_dir(folders[1].path().join("recordings")).unwrap();
    assert_eq!(files.count(), 2, "something was left behind");
}

#[test]
fn a_recording_holds_every_frame() {
    let recording = Recording::open(recorded()).unwrap();
    let frames = (SECONDS * 60.0) as u64;
    let count = |channel| recording.counts().get(&channel).copied().unwrap_or(0);
    // The world moves on while it settles, without observations.
    assert_eq!(count(Channel::JointStates), frames);
    assert!(count(Channel::Command) >= frames);
    assert_eq!(count(Channel::StateHash), count(Channel::Command) + 1);
    assert_eq!(count(Channel::Depth), 5);
    assert_eq!(count(Channel::Depth), count(Channel::Calibration));
    assert_eq!(count(Channel::Depth), count(Channel::Points));
    for channel in [Channel::Ground, Channel::Wood, Channel::Leaves, Channel::Fruit, Channel::Robot] {
        assert_eq!(count(channel), 1, "{}", channel.topic());
    }
    assert!(count(Channel::Transforms) > frames / 2 && count(Channel::Detections) > 0);
    let times: Vec<u64> = recording.messages().unwrap().map(|m| m.unwrap().log_time).collect();
    assert!(times.is_sorted());
    let record: EpisodeRecord = serde_json::from_slice(recording.record()).unwrap();
    assert_eq!((u64::from(record.frames), &record.key), (frames, &recording.header().key));
}

/// The pressure in the cup is recorded in every frame of a robot that has one, and in none of another.
#[test]
fn a_cup_is_recorded_with_its_pressure() {
    let options = [("robot", "rail-xarm6-suction"), ("controller", "expert")];
    let folder = tempfile::tempdir().unwrap();
    record_as(&options, folder.path(), &[20250704], 1);
    let harvest = Harvest::new(Scenario::of(&options).unwrap()).unwrap();
    let file = folder.path().join(name_of(&plan(&harvest, &[20250704]).episodes().remove(0)));
    let recording = Recording::open(&file).unwrap();
    assert_eq!(recording.counts()[&Channel::Cup], (SECONDS * 60.0) as u64);
    let first =
        recording.messages().unwrap().map(Result::unwrap).find(|m| m.channel == Channel::Cup).unwrap();
    let message: serde_json::Value = serde_json::from_slice(&first.data).unwrap();
    assert_eq!(message["pressure"], 0.0);
    let other = Recording::open(recorded()).unwrap();
    assert_eq!(other.counts().get(&Channel::Cup), None);
}

#[test]
fn a_replay_gives_the_same_bytes() {
    let replayed = replayed(recorded());
    assert!(replayed.agrees(), "{replayed:?}");
    let recording = Recording::open(recorded()).unwrap();
    for (channel, count) in recording.counts() {
        assert_eq!(replayed.tallies[channel].agreed, *count, "{}", channel.topic());
    }
}

/// Rewrites a recording with other messages and with valid checksums.
fn rewrite(file: &Path, change: impl Fn(usize, &mut Message) -> bool) -> tempfile::TempPath {
    let recording = Recording::open(file).unwrap();
    let mut out = tempfile::NamedTempFile::new().unwrap();
    let options = WriteOptions::new().compression_threads(0);
    let mut writer: Writer<_> = options.create(out.as_file_mut()).unwrap();
    let Header { format, key, config, scenario } = recording.header();
    let fields = [("format", format.to_string()), ("recording_config", config.clone())]
        .into_iter()
        .chain([("key", serde_json::to_string(key).unwrap())])
        .chain([("scenario", serde_json::to_string(scenario).unwrap())])
        .map(|(name, value)| (name.to_owned(), value));
    let metadata =
        mcap::records::Metadata { name: "orchardbench.episode".into(), metadata: fields.collect() };
    writer.write_metadata(&metadata).unwrap();
    let ids: Vec<u16> = Channel::ALL
        .iter()
        .map(|channel| {
            writer.add_channel(0, channel.topic(), channel.encoding(), &Default::default()).unwrap()
        })
        .collect();
    for (i, message) in recording.messages().unwrap().enumerate() {
        let mut message = message.unwrap();
        if change(i, &mut message) {
            let channel = Channel::ALL.iter().position(|c| *c == message.channel).unwrap();
            let (channel_id, log_time) = (ids[channel], message.log_time);
            let header = MessageHeader { channel_id, sequence: 0, log_time, publish_time: log_time };
            writer.write_to_known_channel(&header, &message.data).unwrap();
        }
    }
    let data = recording.record().into();
    let name = "episode.json".to_owned();
    let attachment = Attachment { log_time: 0, create_time: 0, name, media_type: String::new(), data };
    writer.attach(&attachment).unwrap();
    writer.finish().unwrap();
    drop(writer);
    out.into_temp_path()
}

const HALF: u64 = 500_000_000;

#[test]
fn an_altered_command_is_found_in_the_world_and_at_the_controller() {
    // The first joint's target is changed by one digit, a milliradian.
    let altered = rewrite(recorded(), |_, message| {
        if message.channel == Channel::Command && message.log_time == HALF {
            let mut command: serde_json::Value = serde_json::from_slice(&message.data).unwrap();
            let q = command["arm_q"][0].as_f64().unwrap();
            command["arm_q"][0] = (q + 1e-3).into();
            message.data = serde_json::to_vec(&command).unwrap();
        }
        true
    });
    let found = replayed(&altered);
    assert!(!found.agrees());
    let controller = found.differences[&Origin::Controller];
    assert_eq!((controller.channel, controller.log_time), (Channel::Command, HALF));
    assert_eq!(controller.differs, Differs::OtherCommand);
    // The next frame begins in another state.
    let world = found.differences[&Origin::World];
    assert_eq!(world.log_time, 516_666_667, "{world}");
    assert_eq!(world.channel, Channel::StateHash, "{world}");
    // Up to there all agreed.
    assert!(found.tallies[&Channel::StateHash].agreed >= 31);
}

#[test]
fn altered_missing_and_added_messages_are_found() {
    let lie = rewrite(recorded(), |_, message| {
        if message.channel == Channel::Depth && message.log_time == 600_000_000 {
            let last = message.data.len() - 1;
            message.data[last] ^= 1;
        }
        true
    });
    let found = replayed(&lie);
    assert_eq!(found.differences.len(), 1);
    let world = found.differences[&Origin::World];
    assert_eq!((world.channel, world.log_time, world.differs), (Channel::Depth, 600_000_000, Differs::Bytes));
    assert!(!found.file_agrees && found.record_agrees);

    let less = rewrite(recorded(), |_, m| !(m.channel == Channel::JointStates && m.log_time == HALF));
    let world = replayed(&less).differences[&Origin::World];
    assert_eq!(
        (world.channel, world.log_time, world.differs),
        (Channel::JointStates, HALF, Differs::Surplus)
    );

    // Nothing but the compression is another: the messages agree, the file does not.
    let same = replayed(&rewrite(recorded(), |_, _| true));
    assert!(same.differences.is_empty() && same.record_agrees && !same.file_agrees);
}

/// Reading a damaged file is an error, never a panic.
#[test]
fn files_that_are_cut_off_damaged_or_foreign_are_refused() {
    let bytes = fs::read(recorded()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.mcap");
    let open = |bytes: &[u8]| {
        fs::write(&path, bytes).unwrap();
        Recording::open(&path)
    };
    assert!(open(&bytes).is_ok());
    assert!(matches!(open(b"").unwrap_err(), RecordingError::Damaged { .. }));
    assert!(matches!(open(b"{\"a\": 1}").unwrap_err(), RecordingError::NotMcap { .. }));
    for part in [4, 8, 100, 5_000, bytes.len() / 2, bytes.len() - 1] {
        assert!(open(&bytes[..part]).is_err(), "{part} bytes");
    }
    assert!(open(&[&bytes[..], b"more"].concat()).is_err());
    // One byte anywhere.
    for i in 0..100 {
        let at = i * (bytes.len() / 100) + i % 7;
        let mut damaged = bytes.clone();
        damaged[at] ^= 0x10;
        assert!(open(&damaged).is_err(), "byte {at} of {}", bytes.len());
    }
    // An MCAP file of nothing.
    let mut nothing = std::io::Cursor::new(Vec::new());
    Writer::new(&mut nothing).unwrap().finish().unwrap();
    let error = open(nothing.get_ref()).unwrap_err();
    assert!(error.to_string().ends_with("not a recording of an episode: it names no episode"), "{error}");
    let gone = Recording::open(Path::new("nowhere.mcap")).unwrap_err();
    assert!(matches!(gone, RecordingError::Io { .. }));
}

#[test]
fn other_code_and_other_configs_are_told() {
    let recording = Recording::open(recorded()).unwrap();
    let here = recording.header().clone();
    recording.check(&here).unwrap();
    let told = |change: fn(&mut Header)| {
        let mut other = here.clone();
        change(&mut other);
        recording.check(&other).unwrap_err().to_string()
    };
    assert!(told(|h| h.key.code_version = "9.9".into()).contains("recorded with code version 0.1.0"));
    assert!(told(|h| h.key.config_hash = "x".into()).contains("recorded under the configs"));
    assert!(told(|h| h.config = "x".into()).contains("with the recording's config"));
}
