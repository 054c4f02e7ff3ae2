//! Explains a short real episode.

use super::*;
use clap::Parser;
use orchard_bench::checksum::{checked, encode, with_checksum};
use orchard_bench::lock::LOCK_FILE;
use orchard_bench::store::Store;
use orchard_bench::{NoProgress, Session};
use orchard_scenario::Scenario;
use orchard_tasks::harvest::Harvest;
use orchard_tasks::harvest::episode::{ContactAttemptRecord, ContactOutcome};
use orchard_tasks::harvest::run as run_plan;
use std::path::Path;
use std::sync::atomic::AtomicBool;

#[derive(Parser)]
struct Line {
    #[command(flatten)]
    args: Args,
}

fn explain(line: &[&str]) -> Result<(), Failure> {
    let line = [&["explain"], line].concat();
    run(&Line::try_parse_from(line).unwrap_or_else(|e| panic!("{e}")).args, &Program::new())
}

fn refused(line: &[&str]) -> String {
    match explain(line) {
        Err(Failure::BadInput(problem)) => problem,
        other => panic!("{other:?}"),
    }
}

/// A short episode of the baseline, as bench-v1 writes it.
fn record(folder: &Path) -> PathBuf {
    let harvest = Harvest::new(Scenario::of(&[]).unwrap()).unwrap();
    let plan = harvest.plan("quick", vec![20250704], 1, 14.0);
    let store = Store::open(folder).unwrap();
    run_plan(&plan, &harvest, &Session::whole(&store, 1, &AtomicBool::new(false)), &NoProgress).unwrap();
    folder.join("episodes/baseline-nominal-20250704-000.json")
}

#[test]
fn a_short_episode_is_told_and_drawn_and_agrees() {
    let folder = tempfile::tempdir().unwrap();
    let file = record(folder.path());
    let line = file.to_str().unwrap();
    let strips = folder.path().join("strips");
    explain(&[line, "--attempt", "0", "--out", strips.to_str().unwrap()]).unwrap();
    let drawn = std::fs::read_dir(&strips).unwrap().flatten().map(|e| e.file_name());
    let drawn: Vec<_> = drawn.filter(|name| name != LOCK_FILE).collect();
    assert_eq!(drawn.len(), 1);
    assert!(drawn[0].to_string_lossy().starts_with("attempt-000-"));

    let input =
        input::read(&file, &ScenarioArgs::default(), &Program::new()).unwrap_or_else(|e| panic!("{e}"));
    let count = input.record.attempts.len();
    assert!(count >= 1);
    let problem = refused(&[line, "--text", "--attempt", "99"]);
    assert_eq!(problem, format!("--attempt 99: the allowed range is [0, {}]", count - 1));

    // The story holds every state with its time.
    let attempt = &input.record.attempts[0];
    let text = story::attempt(&input.record, attempt, &[]);
    for state in &attempt.states {
        assert!(text.contains(&format!("{:6.2} s  {} begins", state.time, state.state)), "{text}");
    }

    // So do the contact attempts, which are one line each.
    let attempt = ContactAttemptRecord {
        fruit: 7,
        start_frame: 600,
        end_frame: 660,
        start_time: 10.0,
        end_time: 11.0,
        gripped: true,
        detached: false,
        outcome: ContactOutcome::LeftOnTree,
    };
    let touched = EpisodeRecord { contact_attempts: vec![attempt], ..input.record.clone() };
    assert_eq!(
        story::contact_attempts(&touched).lines().last(),
        Some("   10.00 to  11.00 s  fruit 7, gripped: left on tree")
    );
    assert_eq!(replay::difference(&touched, &input.record).as_deref(), Some("contact attempts differ"));

    // Files that cannot be explained: one that was edited; with a fitting checksum another controller or configuration; a cut one.
    let whole = std::fs::read_to_string(&file).unwrap();
    let content = String::from_utf8(checked(whole.as_bytes()).unwrap()).unwrap();
    std::fs::write(&file, whole.replacen("\"time\": ", "\"time\": 1", 1)).unwrap();
    assert!(refused(&[line, "--text"]).contains("does not match its checksum"));
    let changed = |from: &str, to: &str| {
        let text = content.replacen(from, to, 1);
        assert_ne!(text, content);
        std::fs::write(&file, with_checksum(text.as_bytes()).unwrap()).unwrap();
        let problem = refused(&[line, "--text"]);
        std::fs::write(&file, &whole).unwrap();
        problem
    };
    let controller = changed("\"controller\": \"baseline\"", "\"controller\": \"wizard\"");
    assert!(controller.contains("no controller 'wizard'; the controllers are: baseline"), "{controller}");
    let hash = &input.record.key.config_hash;
    // The folder of this record has no plan, so the scenario may be another one.
    let config = changed(hash, &"0".repeat(64));
    assert!(config.contains("config_hash 0000") && config.contains("there is no plan.json"), "{config}");
    // The record says paper, the options say otherwise.
    let other = refused(&[line, "--text", "--preset", "v-trellis"]);
    assert!(
        other.contains("differs from that of this scenario") && !other.contains("there is no plan.json"),
        "{other}"
    );
    assert!(
        input::tests::refused(&whole[..whole.len() / 2]).starts_with("not a record of a bench-v1 episode")
    );

    // A record that was changed by hand is detected by the second run.
    let segment = 3;
    let mut other = input.record.clone();
    other.branches_snapped.push(orchard_tasks::harvest::episode::SnapEvent {
        segment,
        frame: 7,
        time: 0.1,
        at_union: false,
    });
    assert_eq!(replay::difference(&other, &input.record).as_deref(), Some("branches snapped differ"));
    std::fs::write(&file, encode(&other).unwrap()).unwrap();
    match explain(&[line, "--text"]) {
        Err(Failure::Failed(problem)) => assert!(problem.contains("branches snapped differ"), "{problem}"),
        other => panic!("{other:?}"),
    }

    // So is one with fruit that the tree does not have.
    let mut other = input.record.clone();
    let extra = other.fruit[0].clone();
    other.fruit.push(extra);
    let changed = &mut other.attempts[0];
    changed.fruit = Some(input.record.fruit.len() as u32);
    // Absurdly large positions and times do not stop the strips either.
    changed.p_odom_target = [1e300; 3];
    (changed.end_frame, changed.states[0].time) = (u32::MAX, f64::MAX);
    std::fs::write(&file, encode(&other).unwrap()).unwrap();
    match explain(&[line, "--attempt", "0", "--out", strips.to_str().unwrap()]) {
        Err(Failure::Failed(problem)) => assert!(problem.contains("attempt 0 differs"), "{problem}"),
        other => panic!("{other:?}"),
    }
}

#[test]
fn what_is_not_there_is_refused() {
    assert!(refused(&["no such file.json", "--text"]).starts_with("no such file.json: "));
    let folder = tempfile::tempdir().unwrap();
    let summary = folder.path().join("summary.json");
    std::fs::write(&summary, "{\"schema_version\": 2, \"conditions\": {}}").unwrap();
    assert!(refused(&[summary.to_str().unwrap()]).contains("not a record of a bench-v1 episode"));
}
