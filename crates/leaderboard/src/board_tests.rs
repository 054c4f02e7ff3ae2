//! Order and front in closed form; budgets; the board's file.

use orchard_bench::CODE_VERSION;
use orchard_scenario::Scenario;
use orchard_tasks::protocol::Protocol;
use orchard_tasks::seeds::SeedSetName;

use super::*;

/// A hash as long as SHA-256, which begins with the first letter of a name.
fn hash_of(name: &str) -> String {
    let first = name.bytes().next().unwrap_or_default();
    format!("{first:02x}{}", "0".repeat(62))
}

/// An entry with its figures: completeness, snapped, dropped; budget 1 and 2.
fn entry(name: &str, completeness: f64, snapped: f64, dropped: f64) -> Entry {
    let budget = Budget::of_figures(1.0, 2.0).unwrap();
    Entry {
        name: name.into(),
        controller: "fake".into(),
        within_budget: budget.admits(snapped, dropped),
        budget,
        completeness,
        completeness_ci95: [Some(completeness - 0.1), Some((completeness + 0.1).min(1.0))],
        snapped_per_tree: snapped,
        dropped_per_tree: dropped,
        throughput_fruit_per_min: Some(1.0),
        place_success_per_contact_attempt: None,
        place_success_per_attempt: None,
        episodes: 8,
        quarantined: 0,
        gave_up: 0,
        code_version: CODE_VERSION.into(),
        config_hash: "hash".into(),
        records_sha256: hash_of(name),
        checked: Checked { class: Class::ReRun, episodes: 8 },
    }
}

fn scenario() -> Scenario {
    Scenario::of(&[]).unwrap()
}

#[test]
fn order_and_front_in_closed_form() {
    let entries = [
        entry("over", 0.9, 0.0, 3.0),
        entry("b", 0.5, 0.0, 1.0),
        entry("careful", 0.3, 0.0, 0.5),
        entry("a", 0.5, 0.5, 0.5),
        entry("rough", 0.5, 1.0, 2.0),
        entry("worst", 0.1, 0.0, 1.0),
        entry("edge", 0.6, 1.0, 2.0),
    ];
    let order = |budget: Option<&Budget>| -> Vec<(Option<u32>, &str)> {
        ranking(&entries, budget).iter().map(|r| (r.place, r.entry.name.as_str())).collect()
    };
    assert_eq!(
        order(None),
        [
            (Some(1), "edge"),
            (Some(2), "a"),
            (Some(3), "b"),
            (Some(4), "rough"),
            (Some(5), "careful"),
            (Some(6), "worst"),
            (None, "over"),
        ]
    );
    let strict = Budget::of_figures(0.0, 1.0).unwrap();
    let order = order(Some(&strict));
    assert_eq!(order[..3], [(Some(1), "b"), (Some(2), "careful"), (Some(3), "worst")]);
    assert_eq!(order[3..], [(None, "over"), (None, "edge"), (None, "a"), (None, "rough")]);
    // By damage: careful 0.5, a and b 1, both with 0.5, edge and over 3, of which over has more.
    let front: Vec<&str> =
        pareto_front(&entries, Class::ReRun).into_iter().map(|i| entries[i].name.as_str()).collect();
    assert_eq!(front, ["careful", "b", "a", "over"]);
    assert!(pareto_front(&[], Class::ReRun).is_empty());
    // Classes stand apart: a claim has a place among claims only.
    let claim = Checked { class: Class::Claimed, episodes: 0 };
    let mixed = [Entry { checked: claim, ..entry("claim", 0.99, 0.0, 0.0) }, entry("b", 0.5, 0.0, 1.0)];
    let order: Vec<_> = ranking(&mixed, None).iter().map(|r| (r.place, &*r.entry.name, r.on_front)).collect();
    assert_eq!(order, [(Some(1), "b", true), (Some(1), "claim", true)]);
}

#[test]
fn budgets_by_name_and_by_figures() {
    let rules = LeaderboardRules::of(&Protocol::paper()).unwrap();
    let gentle = Budget::of_class(&rules, "gentle").unwrap();
    assert_eq!(gentle.to_string(), "gentle: snapped <= 0.1, dropped <= 1");
    assert!(gentle.admits(0.1, 1.0) && !gentle.admits(0.11, 0.0) && !gentle.admits(0.0, 1.01));
    assert_eq!(Budget::of_class(&rules, "open"), None);
    for (snapped, dropped) in [(-0.1, 1.0), (f64::NAN, 1.0), (0.0, f64::INFINITY)] {
        assert!(Budget::of_figures(snapped, dropped).unwrap_err().contains("is not a number from 0 up"));
    }
}

#[test]
fn a_board_takes_a_result_once_and_a_name_once() {
    let mut board = Board::new("v1", SeedSetName::Tuning, &scenario());
    assert_eq!(board.add(entry("a", 0.4, 0.0, 1.0), false), Ok(Added::New));
    assert_eq!(board.add(entry("b", 0.5, 0.0, 1.0), true), Ok(Added::New));
    assert_eq!(board.entries[0].name, "b", "by place");
    let twice = || BoardError::Twice { name: "a".into() };
    // Neither another name nor another budget makes a new result of the same records.
    let again = Entry { name: "c".into(), ..entry("a", 0.4, 0.0, 1.0) };
    assert_eq!(board.add(again.clone(), false).unwrap_err(), twice());
    let other = Entry { budget: Budget::of_figures(0.0, 0.0).unwrap(), within_budget: false, ..again };
    assert_eq!(board.add(other, true).unwrap_err(), twice());
    assert_eq!(board.add(entry("c", 0.1, 0.0, 1.0), false), Ok(Added::New));
    let better = Entry { records_sha256: hash_of("new"), ..entry("a", 0.6, 0.0, 1.0) };
    let taken = BoardError::NameTaken { name: "a".into() };
    assert_eq!(board.add(better.clone(), false).unwrap_err(), taken);
    match board.add(better, true).unwrap() {
        Added::InPlaceOf(old) => assert_eq!(old.completeness, 0.4),
        Added::New => panic!("the name was there"),
    }
    let names: Vec<&str> = board.entries.iter().map(|e| e.name.as_str()).collect();
    assert_eq!(names, ["a", "b", "c"]);

    let file = board.to_file().unwrap();
    assert_eq!(Board::from_file(&file).unwrap(), board);
    let edit = |from: &str, to: &str| {
        let text = String::from_utf8(file.clone()).unwrap();
        let edited = text.replacen(from, to, 1);
        assert_ne!(edited, text);
        Board::from_file(edited.as_bytes()).unwrap_err().to_string()
    };
    // An edit that no other check finds: the figures stay in their ranges.
    let e = edit("\"throughput_fruit_per_min\": 1.0", "\"throughput_fruit_per_min\": 9.0");
    assert!(e.starts_with("the board does not match its checksum: it is damaged or was edited; take"), "{e}");
    let line = String::from_utf8(file.clone()).unwrap().lines().nth(1).unwrap().to_owned() + "\n";
    assert!(edit(&line, "").starts_with("the board has no checksum; take a copy"));

    let text = serde_json::to_string(&board).unwrap();
    assert_eq!(Board::from_json(&text).unwrap(), board);
    assert_eq!(board.check("v1", SeedSetName::Tuning, &scenario()), Ok(()));
    let e = board.check("v1", SeedSetName::V1, &scenario()).unwrap_err().to_string();
    assert_eq!(e, "the board has seed set Tuning, not V1: give another --board");
    let stereo = Scenario::of(&[("camera", "d435i")]).unwrap();
    let e = board.check("v1", SeedSetName::Tuning, &stereo).unwrap_err().to_string();
    assert_eq!(e, "the board has camera paper, not d435i: give another --board");
    assert!(
        board
            .check("v2", SeedSetName::Tuning, &scenario())
            .unwrap_err()
            .to_string()
            .contains("config_version v1, not v2")
    );
    for (from, to, problem) in [
        ("\"schema_version\":6", "\"schema_version\":7", "schema_version 7, not 6"),
        (
            "\"within_budget\":true",
            "\"within_budget\":false",
            "entry a: within_budget is not what its figures say",
        ),
        ("\"name\":\"b\"", "\"name\":\"a\"", "entry a: the name is there twice"),
        ("\"name\":\"b\"", "\"name\":\"<b>\"", "entry <b>: name \"<b>\": a name has 1 to 40"),
        ("\"controller\":\"fake\"", "\"controller\":\"f|k\"", "controller \"f|k\": a name has"),
        ("\"completeness\":0.6", "\"completeness\":6.0", "completeness = 6 is outside [0, 1]"),
        (
            "\"completeness_ci95\":[0.5,",
            "\"completeness_ci95\":[0.7,",
            "completeness_ci95 = 0.7 is outside [0, 0.6]",
        ),
        ("\"dropped_per_tree\":1.0", "\"dropped_per_tree\":-1.0", "dropped_per_tree = -1 is outside"),
        (
            "\"episodes\":8,\"quarantined\":0",
            "\"episodes\":8,\"quarantined\":9",
            "quarantined = 9 is outside [0, 8]",
        ),
        ("\"gave_up\":0", "\"gave_up\":9", "gave_up = 9 is outside [0, 8]"),
        ("\"class\":\"re_run\"", "\"class\":\"sworn\"", "sworn"),
        ("\"records_sha256\":\"6e", "\"records_sha256\":\"<>", "records_sha256 is no SHA-256"),
        ("\"entries\"", "\"entrees\"", "entrees"),
    ] {
        let bad = text.replacen(from, to, 1);
        assert_ne!(bad, text, "{from}");
        let e = Board::from_json(&bad).unwrap_err().to_string();
        assert!(e.contains(problem), "{e}");
    }
}
