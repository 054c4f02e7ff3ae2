//! Tests of verification: accepted results, and refused ones with the reason.

use std::fs;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use orchard_bench::CODE_VERSION;
use orchard_bench::checksum::{checked, with_checksum};
use orchard_bench::gather;
use orchard_bench::store::Store;
use orchard_bench::{NoProgress, Session, run_task};
use orchard_scenario::{Names, Scenario};
use orchard_tasks::fake::progress::CountingProgress;
use orchard_tasks::fake::{FakeFactory, plan};
use orchard_tasks::harvest::command_log::{CommandLogs, path_of};
use orchard_tasks::harvest::episode::{ContactOutcome, EpisodeRecord};
use orchard_tasks::harvest::plan::Plan;
use orchard_tasks::harvest::summary::Summary;
use orchard_tasks::harvest::{Episodes, Harvest, WorldFactory, never_started};
use orchard_tasks::plan_file::Backend;
use orchard_tasks::protocol::Protocol;
use orchard_tasks::seeds::{SeedSetLabel, SeedSetName};

use super::*;

/// A result of the fake plan, with its command logs.
fn result() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).unwrap();
    let (plan, logs) = (plan(), CommandLogs::new(folder.path()));
    let task = Episodes { plan: &plan, factory: &FakeFactory, watch: &logs };
    run_task(&task, &Session::whole(&store, 1, &AtomicBool::new(false)), &NoProgress).unwrap();
    folder
}

/// Reads a submission, grows its trees, and runs `sample` of its episodes again.
fn verified(folder: &Path, plan: &Plan, sample: usize) -> Result<Submission, String> {
    let submission = grown(folder, plan)?;
    let chosen = drawn(7, submission.records.len(), sample);
    repeated(&submission, &FakeFactory, &chosen).map_err(|e| e.to_string())?;
    Ok(submission)
}

fn grown(folder: &Path, plan: &Plan) -> Result<Submission, String> {
    let submission = Submission::read(folder, plan).map_err(|e| e.to_string())?;
    let stop = AtomicBool::new(false);
    submission.check_trees(plan, &FakeFactory, 2, &stop, &NoProgress).map_err(|e| e.to_string())?;
    Ok(submission)
}

fn repeated<F: WorldFactory>(submission: &Submission, factory: &F, chosen: &[usize]) -> Result<(), Refusal> {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).unwrap();
    let stop = AtomicBool::new(false);
    submission.repeat(&plan(), factory, chosen, &Session::whole(&store, 2, &stop), &NoProgress)
}

/// Replaces a text in a file of a folder, and its checksum, as a clever forger would.
fn change(folder: &Path, file: &str, from: &str, to: &str) {
    let path = folder.join(file);
    let text = String::from_utf8(checked(&fs::read(&path).unwrap()).unwrap()).unwrap();
    assert!(text.contains(from), "{file} has no {from}");
    fs::write(path, with_checksum(text.replacen(from, to, 1).as_bytes()).unwrap()).unwrap();
}

/// Writes the summary that the records in a folder give, as a clever forger would.
fn sum_up_again(folder: &Path) {
    let store = Store::open(folder).unwrap();
    let records = gather::<EpisodeRecord>(&plan().episodes(), &[&store]).unwrap();
    store.write("summary.json", &Summary::of_run(&plan(), &records)).unwrap();
}

#[test]
fn an_honest_result_is_run_again_and_replayed() {
    let folder = result();
    let mut verified = verified(folder.path(), &plan(), 1000).unwrap();
    assert_eq!((verified.records_sha256.len(), verified.records.len()), (64, 8));
    assert!(verified.has_commands());
    let all: Vec<usize> = (0..8).collect();
    repeated(&verified, &verified.replays(&FakeFactory), &all).unwrap();

    let checked = Checked { class: Class::ReRun, episodes: 8 };
    let entry = Entry::new("mine", Budget::of_figures(10.0, 10.0).unwrap(), &verified, checked).unwrap();
    entry.check().unwrap();
    let nominal = &verified.summary.conditions["nominal"];
    assert_eq!(Some(entry.completeness), nominal.metrics["harvest_completeness"].mean);
    assert_eq!(Some(entry.dropped_per_tree), nominal.metrics["fruit_dropped_per_tree"].mean);
    assert_eq!((entry.episodes, entry.quarantined, entry.within_budget), (8, 2, true));
    verified.summary.gave_up = [("no_action".into(), 1), ("action_not_finite".into(), 2)].into();
    let strict = Entry::new("mine", Budget::of_figures(0.0, 0.0).unwrap(), &verified, checked).unwrap();
    assert!(!strict.within_budget && strict.damage() > 0.0);
    assert_eq!((entry.gave_up, strict.gave_up), (0, 3));
}

#[test]
fn versions_seeds_and_plans_of_others_are_refused() {
    let folder = result();
    let refused = |file: &Path, plan: &Plan| verified(file, plan, 1).unwrap_err();
    let here = folder.path();
    let e = refused(here, &Plan { config_hash: "0".repeat(64), ..plan() });
    assert!(e.starts_with("summary.json: config_hash \"") && e.contains("this build has \"000"), "{e}");
    let whole = SeedSetLabel { name: SeedSetName::V1, whole: true };
    let e = refused(here, &Plan { seed_set: whole, ..plan() });
    assert_eq!(e, "summary.json: seed set custom (in part), but the board is of v1");
    let e = refused(here, &Plan { seeds: vec![7, 9], ..plan() });
    assert!(e.contains("seed set custom (in part) with seeds [7, 8]"), "{e}");
    let e = refused(here, &Plan { scenario: Names::paper("gardener"), ..plan() });
    assert_eq!(e, "summary.json: controller fake, but the official matrix has gardener");
    let e = refused(here, &Plan { profile: "full".into(), ..plan() });
    assert_eq!(e, "summary.json: profile quick, but the official matrix has full");
    let e = refused(here, &Plan { backend: Backend::Gpu, ..plan() });
    assert_eq!(e, "summary.json: backend cpu, but the official matrix has gpu");

    for (from, to, what) in [
        (
            "\"schema_version\": 6",
            "\"schema_version\": 3",
            "summary.json: schema_version 3, but this build has 6",
        ),
        (
            "\"config_version\": \"v1\"",
            "\"config_version\": \"v0\"",
            "summary.json: config_version \"v0\", but",
        ),
        (CODE_VERSION, "0.0.1", "summary.json: code_version \"0.0.1\", but this build has \""),
    ] {
        let folder = result();
        change(folder.path(), "summary.json", from, to);
        let e = refused(folder.path(), &plan());
        assert!(e.starts_with(what), "{e}");
    }
    // A summary that lies about the code does not help its records.
    let folder = result();
    change(folder.path(), "episodes/fake-nominal-8-001.json", CODE_VERSION, "0.0.1");
    let e = refused(folder.path(), &plan());
    assert!(e.contains("fake-nominal-8-001.json belongs to another plan, config or code version"), "{e}");
}

#[test]
fn partial_and_swollen_results_are_refused() {
    let folder = result();
    let file = folder.path().join("episodes/fake-nominal-7-003.json");
    let text = fs::read_to_string(&file).unwrap();
    fs::remove_file(&file).unwrap();
    let e = verified(folder.path(), &plan(), 1).unwrap_err();
    assert!(
        e.starts_with("1 of 8 episodes are missing; the first is episodes/fake-nominal-7-003.json"),
        "{e}"
    );
    fs::write(&file, &text[..text.len() - 9]).unwrap();
    let e = verified(folder.path(), &plan(), 1).unwrap_err();
    assert!(e.ends_with("fake-nominal-7-003.json is damaged or was edited"), "{e}");
    fs::write(&file, &text).unwrap();
    fs::write(folder.path().join("episodes/fake-windy-7-000.json"), &text).unwrap();
    let e = verified(folder.path(), &plan(), 1).unwrap_err();
    assert!(e.starts_with("episodes/fake-windy-7-000.json is not of the official matrix"), "{e}");

    let empty = tempfile::tempdir().unwrap();
    for text in [None, Some(""), Some("{}"), Some("[4]"), Some("{\"schema_version\": 6}")] {
        if let Some(text) = text {
            fs::write(empty.path().join("summary.json"), text).unwrap();
        }
        let e = verified(empty.path(), &plan(), 1).unwrap_err();
        assert!(e.contains("summary.json") && e.contains("a result folder of a harvest that ended"), "{e}");
    }
    let nowhere = empty.path().join("nowhere");
    assert!(verified(&nowhere, &plan(), 1).is_err() && !nowhere.exists());
}

#[test]
fn an_edited_summary_is_refused_by_its_field() {
    let folder = result();
    let store = Store::open(folder.path()).unwrap();
    let text = fs::read_to_string(folder.path().join("summary.json")).unwrap();
    let mut summary: Summary = serde_json::from_str(&text).unwrap();
    let own = summary.conditions["nominal"].metrics["harvest_completeness"].mean.unwrap();
    let nominal = summary.conditions.get_mut("nominal").unwrap();
    nominal.metrics.get_mut("harvest_completeness").unwrap().mean = Some(0.99);
    store.write("summary.json", &summary).unwrap();
    assert_eq!(
        verified(folder.path(), &plan(), 1).unwrap_err(),
        format!(
            "summary.json is not what its records give: conditions.nominal.metrics.harvest_completeness.mean is 0.99, not {own}"
        )
    );
    // Not even another space is taken.
    fs::write(folder.path().join("summary.json"), text.replacen(": ", ":  ", 1)).unwrap();
    let e = verified(folder.path(), &plan(), 1).unwrap_err();
    assert!(e.contains("written in another way"), "{e}");
}

#[test]
fn a_record_with_one_number_changed_is_refused() {
    let episode = "episodes/fake-nominal-7-001.json";
    // The summary gives it away,
    let folder = result();
    change(folder.path(), episode, "\"final_state\": \"dropped\"", "\"final_state\": \"deposited\"");
    assert!(
        verified(folder.path(), &plan(), 1).unwrap_err().starts_with("summary.json is not what its records")
    );
    // or, where the summary is forged as well, the record itself,
    sum_up_again(folder.path());
    let e = verified(folder.path(), &plan(), 1).unwrap_err();
    assert!(e.starts_with(episode) && e.contains("is in the bucket, but no deposit is listed"), "{e}");
    // or, where the record is consistent, the episode that is run again.
    let folder = result();
    change(folder.path(), episode, "\"max_finger_force_n\": 8.0", "\"max_finger_force_n\": 7.5");
    sum_up_again(folder.path());
    assert_eq!(
        verified(folder.path(), &plan(), 8).unwrap_err(),
        format!(
            "{episode} comes out otherwise when run again: attempts[0].max_finger_force_n is 7.5, not 8.0"
        )
    );
}

#[test]
fn a_stopped_verification_says_so() {
    let folder = result();
    let submission = Submission::read(folder.path(), &plan()).unwrap();
    let stop = AtomicBool::new(true);
    let e = submission.check_trees(&plan(), &FakeFactory, 1, &stop, &NoProgress).unwrap_err();
    assert!(matches!(e, Refusal::Interrupted), "{e}");
    let kept = tempfile::tempdir().unwrap();
    let store = Store::open(kept.path()).unwrap();
    let again = |stop: bool| {
        let (stop, progress) = (AtomicBool::new(stop), CountingProgress::default());
        let session = Session::whole(&store, 1, &stop);
        (submission.repeat(&plan(), &FakeFactory, &[0, 1, 3], &session, &progress), progress.counts())
    };
    assert!(matches!(again(true), (Err(Refusal::Interrupted), (0, 0))));
    assert!(matches!(again(false), (Ok(()), (3, 0))));
    // What is kept is not run again.
    assert!(matches!(again(false), (Ok(()), (0, 3))));
}

#[test]
fn records_made_up_from_one_tree_are_refused() {
    let folder = result();
    let store = Store::open(folder.path()).unwrap();
    let records = gather::<EpisodeRecord>(&plan().episodes(), &[&store]).unwrap();
    let best = records.iter().max_by_key(|record| record.deposited().count()).unwrap();
    for key in plan().episodes().into_iter().filter(|key| *key != best.key) {
        store.write_record(&EpisodeRecord { key, ..best.clone() }).unwrap();
    }
    sum_up_again(folder.path());
    // The log of the copied record is not that of the tree; without logs its trees give the result away.
    let e = grown(folder.path(), &plan()).unwrap_err();
    assert!(e.contains(".postcard.gz: does not match the SHA-256 in its record"), "{e}");
    let leave_out_logs = |folder: &Path| fs::remove_dir_all(folder.join("commands")).unwrap();
    leave_out_logs(folder.path());
    let e = grown(folder.path(), &plan()).unwrap_err();
    assert!(e.contains(".json is not of the tree of its seed: "), "{e}");
    // Nor is a tree that cannot be built made up, or one left out that can be built.
    let folder = result();
    let store = Store::open(folder.path()).unwrap();
    let key = plan().episodes().remove(0);
    store.write_record(&never_started(key, "no static equilibrium".into())).unwrap();
    leave_out_logs(folder.path());
    sum_up_again(folder.path());
    let e = grown(folder.path(), &plan()).unwrap_err();
    assert!(e.starts_with("episodes/fake-nominal-7-000.json is not of the tree of its seed"), "{e}");
}

#[test]
fn forged_episodes_and_commands_do_not_replay() {
    let episode = "episodes/fake-nominal-7-001.json";
    let folder = result();
    change(folder.path(), episode, "\"max_finger_force_n\": 8.0", "\"max_finger_force_n\": 7.5");
    sum_up_again(folder.path());
    let submission = grown(folder.path(), &plan()).unwrap();
    let replayed = |submission: &Submission| {
        let all: Vec<usize> = (0..8).collect();
        repeated(submission, &submission.replays(&FakeFactory), &all).map_err(|e| e.to_string())
    };
    let e = replayed(&submission).unwrap_err();
    assert!(e.starts_with(&format!("{episode} comes out otherwise")) && e.contains("7.5, not 8"), "{e}");
    // The log of another episode is none of this one: the record's hash tells, and so does the replay.
    let folder = result();
    let submission = grown(folder.path(), &plan()).unwrap();
    let log = |world: u32| {
        let key = plan().episodes().into_iter().find(|key| key.seed == 7 && key.world == world).unwrap();
        folder.path().join(path_of(&key))
    };
    fs::copy(log(0), log(1)).unwrap();
    let e = Submission::read(folder.path(), &plan()).unwrap_err().to_string();
    assert!(e.contains("fake-nominal-7-001.postcard.gz: does not match the SHA-256 in its record"), "{e}");
    let e = replayed(&submission).unwrap_err();
    assert!(e.contains("comes out otherwise"), "{e}");
    fs::remove_file(log(1)).unwrap();
    assert!(!submission.has_commands());
}

#[test]
fn what_contradicts_itself() {
    let folder = result();
    let store = Store::open(folder.path()).unwrap();
    let records = gather::<EpisodeRecord>(&plan().episodes(), &[&store]).unwrap();
    assert!(records.iter().all(|record| consistency::contradiction(record, plan().frame).is_none()));
    let honest = records.iter().find(|record| !record.attempts.is_empty()).unwrap();
    let said = |lie: fn(&mut EpisodeRecord)| {
        let mut record = honest.clone();
        lie(&mut record);
        consistency::contradiction(&record, plan().frame).unwrap_or_default()
    };
    assert!(said(|r| r.frames = r.key.horizon_frames + 1).contains("more than the horizon"));
    assert!(said(|r| r.duration_s += 0.5).contains("duration_s is"));
    assert!(said(|r| r.fruit_total += 1).contains("fruit are listed"));
    assert!(said(|r| r.fruit[0].id = 9).contains("ids of the fruit"));
    assert!(said(|r| r.reachable_count -= 1).contains("fruit are reachable"));
    assert!(said(|r| r.zone_census.clear()).contains("zone_census"));
    assert!(said(|r| r.fruit_deposited.clear()).contains("no deposit is listed"));
    assert!(said(|r| r.fruit_deposited[0].time += 1.0).contains("has the time"));
    assert!(
        said(|r| r.fruit_detached.clear()).contains("fruit 0 is in the bucket and never came off its stem")
    );
    assert!(said(|r| r.fruit_detached[0].frame = 8).contains("never came off its stem"));
    assert!(said(|r| r.contact_attempts[0].gripped = false).contains("neither gripped nor knocked off"));
    assert!(said(|r| r.contact_attempts.clear()).contains("neither gripped nor knocked off"));
    assert!(said(|r| r.contact_attempts[0].outcome = ContactOutcome::Dropped).contains("its outcome"));
    assert!(said(|r| r.contact_attempts[2].outcome = ContactOutcome::Placed).contains("its outcome"));
    assert!(said(|r| r.contact_attempts.push(r.contact_attempts[0].clone())).contains("in their order"));
    assert!(said(|r| r.contact_attempts[0].end_frame = 0).contains("within the episode"));
    assert!(said(|r| r.contact_attempts[0].end_time = 0.0).contains("times are not"));
    assert!(said(|r| r.detection.recalled = 1000).contains("fruit were found"));
    assert!(said(|r| r.attempts[0].placed.clear()).contains("attempt 0: its outcome"));
    assert!(said(|r| r.attempts[0].cycle_time = Some(0.1)).contains("cycle_time is not"));
    assert!(said(|r| r.attempts[0].end_frame = 0).contains("outside the episode"));
}

#[test]
fn samples_follow_from_the_verifiers_number() {
    let of = |draw| drawn(draw, 198, 3);
    assert_eq!(of(1), of(1));
    assert_ne!(of(1), of(2));
    for draw in 0..50 {
        let drawn = of(draw);
        assert!(drawn.len() == 3 && drawn.is_sorted_by(|a, b| a < b) && drawn[2] < 198);
    }
    assert_eq!(drawn(7, 4, 9), [0, 1, 2, 3]);
    assert!(drawn(7, 0, 3).is_empty());
    // All places are drawn about alike: 2,000 samples of 3 in 10 take each 600 times, with a deviation of 20.
    let mut counts = [0; 10];
    for draw in 0..2000 {
        for index in drawn(draw, 10, 3) {
            counts[index] += 1;
        }
    }
    assert!(counts.iter().all(|count| (500..700).contains(count)), "{counts:?}");
}

#[test]
fn where_two_values_part() {
    let first = |a: &str, b: &str| {
        let value = |text| serde_json::from_str(text).unwrap();
        first_difference(&value(a), &value(b)).map(|d| d.to_string())
    };
    assert_eq!(first(r#"{"a": [1, {"b": 2}]}"#, r#"{"a": [1, {"b": 2}]}"#), None);
    assert_eq!(first(r#"{"a": [1, {"b": 2}]}"#, r#"{"a": [1, {"b": 3}]}"#).unwrap(), "a[1].b is 2, not 3");
    assert_eq!(first(r#"{"a": [1]}"#, r#"{"a": [1, [2, 3]]}"#).unwrap(), "a[1] is absent, not a list of 2");
    assert_eq!(first(r#"{"c": 1, "b": 1}"#, r#"{"c": 2}"#).unwrap(), "b is 1, not absent");
    assert_eq!(first("1", "{}").unwrap(), "the document is 1, not an object of 0 fields");
}

#[test]
fn the_official_matrix_is_the_full_profile_on_a_whole_set() {
    let protocol = Protocol::paper();
    let harvest = Harvest::new(Scenario::of(&[]).unwrap()).unwrap();
    for (set, trees, repeats) in [(SeedSetName::V1, 30, 3), (SeedSetName::Tuning, 18, 1)] {
        let plan = harvest.plan_of(official(&protocol, set).unwrap()).unwrap();
        plan.check().unwrap();
        assert_eq!(plan.seed_set, SeedSetLabel { name: set, whole: true });
        let of = |condition: &str| plan.episodes().iter().filter(|key| key.condition == condition).count();
        assert_eq!((of("nominal"), of("fruit-20")), (trees * repeats, trees));
        for name in &protocol.full.conditions {
            assert!(
                plan.conditions.iter().any(|c| c.name == *name)
                    || plan.sweeps.iter().any(|s| s.name == *name)
            );
        }
    }
    assert_eq!(official(&protocol, SeedSetName::Custom), None);
}
