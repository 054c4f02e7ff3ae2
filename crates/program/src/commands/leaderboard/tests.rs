use std::fs;

use orchard_bench::sweep::Scenario as Sweep;
use orchard_scenario::Scenario;

use super::*;

fn scenario() -> Scenario {
    Scenario::of(&[]).unwrap()
}

/// An entry with its figures: completeness, snapped, dropped.
fn entry(name: &str, budget: &Budget, completeness: f64, snapped: f64, dropped: f64) -> Entry {
    Entry {
        name: name.into(),
        controller: "expert".into(),
        budget: budget.clone(),
        within_budget: budget.admits(snapped, dropped),
        completeness,
        completeness_ci95: [Some(completeness - 0.05), Some(completeness + 0.05)],
        snapped_per_tree: snapped,
        dropped_per_tree: dropped,
        throughput_fruit_per_min: Some(3.25),
        place_success_per_contact_attempt: Some(0.7),
        place_success_per_attempt: Some(0.75),
        episodes: 330,
        quarantined: 0,
        gave_up: 7,
        code_version: "0.1.0+abc".into(),
        config_hash: "hash".into(),
        records_sha256: format!(
            "{:064x}",
            name.bytes().fold(0_u128, |sum, byte| 31 * sum + u128::from(byte))
        ),
        checked: Checked { class: Class::ReRun, episodes: 330 },
    }
}

fn board() -> Board {
    let protocol = Protocol::paper();
    let of = |class| Budget::of_class(&LeaderboardRules::of(&protocol).unwrap(), class).unwrap();
    let (gentle, paper) = (of("gentle"), of("paper"));
    let mut board = Board::new(&protocol.version, SeedSetName::Tuning, &scenario());
    for entry in [
        entry("expert", &gentle, 0.41, 0.05, 0.6),
        entry("hasty", &gentle, 0.5, 0.2, 3.0),
        entry("baseline", &paper, 0.16, 0.15, 2.0),
        entry("careful", &gentle, 0.3, 0.0, 0.1),
        entry("expert again", &gentle, 0.40, 0.05, 0.66),
    ] {
        board.add(entry, false).unwrap();
    }
    board
}

#[test]
fn a_board_is_kept_as_file_table_and_figure() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("new/board.json");
    let place = BoardFile::new(file.clone(), SeedSetName::Tuning).unwrap();
    let lock = place.lock().unwrap();
    place.save(&board()).unwrap();
    drop(lock);
    assert_eq!(place.read(&Protocol::paper(), &scenario()).unwrap(), Some(board()));
    let table = fs::read_to_string(file.with_extension("md")).unwrap();
    let lines: Vec<&str> = table.lines().filter(|line| line.starts_with("| ")).collect();
    assert!(lines[0].contains("| records") && !table::short(&board(), None).contains("records"));
    let starts = [
        "| 1     | expert * ",
        "| 2     | expert again ",
        "| 3     | careful * ",
        "| 4     | baseline ",
        "| -     | hasty * ",
    ];
    for (line, start) in lines[1..].iter().zip(starts) {
        assert!(line.starts_with(start), "{table}");
    }
    assert_eq!(lines.iter().filter(|line| line.contains("OVER BUDGET")).count(), 1);
    assert!(lines[0].contains("| quarantined | gave up |"), "{table}");
    assert_eq!(lines.iter().filter(|line| line.contains("| 0           | 7       |")).count(), 5, "{table}");
    let svg = fs::read_to_string(file.with_extension("svg")).unwrap();
    for name in ["expert", "careful", "baseline", "hasty", "budget gentle", "practice"] {
        assert!(svg.contains(name), "{name}");
    }
    // A board without entries has a figure as well.
    orchard_report::pareto(&Board::new("v1", SeedSetName::V1, &scenario())).unwrap();
}

#[test]
fn one_budget_for_all_moves_entries() {
    let budget = Budget::of_figures(0.0, 0.5).unwrap();
    let table = table::short(&board(), Some(&budget));
    assert_eq!(table.matches("OVER BUDGET").count(), 4, "{table}");
    assert!(table.contains("under one budget per tree, snapped <= 0, dropped <= 0.5"), "{table}");
}

#[derive(clap::Parser)]
struct Line {
    #[command(flatten)]
    args: Args,
}

fn said(line: &[&str]) -> String {
    let line = [&["leaderboard"], line].concat();
    match <Line as clap::Parser>::try_parse_from(line) {
        Err(e) => e.to_string(),
        Ok(line) => match run(&line.args, &Program::new()) {
            Err(Failure::BadInput(e)) => e,
            other => panic!("{other:?}"),
        },
    }
}

#[test]
fn bad_input_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (board, here) = (path("b.json"), folder.path().display().to_string());
    assert!(said(&["show", "--board", &board]).ends_with("b.json: there is no such board"));
    assert!(said(&["show", "--board", &path("b.txt")]).contains("a name that ends in .json is needed"));
    let e = said(&["add", &here, "--board", &board]);
    assert_eq!(e, "a submission has a budget: --budget gentle or paper, or --snapped B --dropped D");
    let e = said(&["add", &here, "--budget", "open"]);
    assert_eq!(e, "--budget open: there are gentle, paper");
    let e = said(&["add", &here, "--snapped", "-1", "--dropped", "1"]);
    assert_eq!(e, "--snapped, --dropped: snapped = -1 is not a number from 0 up, a tree");
    assert!(said(&["add", &here, "--snapped", "1"]).contains("--dropped"));
    assert!(said(&["add", "--budget", "gentle"]).contains("<RESULT>"));
    assert!(said(&["add", &here, "--budget", "gentle", "--sample", "0"]).contains("--sample"));
    assert!(said(&["add", &here, "--budget", "gentle", "--name", "a|b"]).contains("a name has 1 to 40"));
    let e = said(&["add", &here, &here, "--budget", "gentle", "--name", "x"]);
    assert!(e.starts_with("--name is for one RESULT"), "{e}");
    fs::write(&board, "{}").unwrap();
    assert!(said(&["show", "--board", &board]).contains("the board has schema_version none"));
    // A figure that an editor changed within its range.
    let empty = Board::new(&Protocol::paper().version, SeedSetName::V1, &scenario());
    let text = String::from_utf8(empty.to_file().unwrap()).unwrap();
    fs::write(&board, text.replace("\"seed_set\": \"v1\"", "\"seed_set\": \"tuning\"")).unwrap();
    for line in [&["show", "--board", &board][..], &["add", &here, "--budget", "gentle", "--board", &board]] {
        let e = said(line);
        assert!(
            e.contains("b.json: the board does not match its checksum: it is damaged or was edited"),
            "{e}"
        );
    }
}

/// A change that is cut short anywhere leaves the old board or the new one, and can be made again.
#[test]
fn a_change_of_a_board_survives_every_fault() {
    let protocol = Protocol::paper();
    let budget = Budget::of_figures(1.0, 2.0).unwrap();
    let add = |folder: &std::path::Path, name: &str| -> Result<(), String> {
        let place = BoardFile::new(folder.join("board.json"), SeedSetName::Tuning).unwrap();
        let said = |e: Failure| format!("{e:?}");
        let _lock = place.lock().map_err(said)?;
        let empty = || Board::new(&protocol.version, SeedSetName::Tuning, &scenario());
        let mut board = place.read(&protocol, &scenario()).map_err(said)?.unwrap_or_else(empty);
        board.add(entry(name, &budget, 0.4, 0.0, 1.0), false).map_err(|e| e.to_string())?;
        place.save(&board).map_err(said)
    };
    let parts = (&["board.json"][..], &["board.md", "board.svg"][..]);
    let new = Sweep {
        prepare: &|_| (),
        run: &|folder| add(folder, "first"),
        last: parts.0,
        derived: parts.1,
        timed: &[],
    };
    // Begin, write and name the table, the figure and the board.
    assert_eq!(new.sweep(), 9);
    let changed = Sweep {
        prepare: &|folder| add(folder, "first").unwrap(),
        run: &|folder| add(folder, "second"),
        last: parts.0,
        derived: parts.1,
        timed: &[],
    };
    assert_eq!(changed.sweep(), 9);
}

#[test]
fn entries_added_at_once_are_all_kept() {
    let folder = tempfile::tempdir().unwrap();
    let place = BoardFile::new(folder.path().join("board.json"), SeedSetName::Tuning).unwrap();
    let protocol = Protocol::paper();
    let budget = Budget::of_figures(1.0, 2.0).unwrap();
    std::thread::scope(|scope| {
        for i in 0..8 {
            let (place, protocol, budget) = (&place, &protocol, &budget);
            scope.spawn(move || {
                let _lock = place.lock().unwrap();
                let empty = || Board::new(&protocol.version, SeedSetName::Tuning, &scenario());
                let mut board = place.read(protocol, &scenario()).unwrap().unwrap_or_else(empty);
                board.add(entry(&format!("entry {i}"), budget, 0.4, 0.0, 1.0), false).unwrap();
                place.save(&board).unwrap();
            });
        }
    });
    assert_eq!(place.read(&protocol, &scenario()).unwrap().unwrap().entries.len(), 8);
}

#[test]
fn the_board_as_json_has_places() {
    let text = json::text(&board(), None).unwrap();
    let value: serde_json::Value = serde_json::from_str(&text).unwrap();
    let of = |i: usize, field: &str| value["entries"][i][field].clone();
    assert_eq!((of(0, "place"), of(0, "name"), of(0, "on_front")), (1.into(), "expert".into(), true.into()));
    assert_eq!(value["entries"][0]["checked"]["class"], "re_run");
    assert!(of(4, "place").is_null());
}

#[test]
fn results_without_a_plan_and_of_other_code_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let schema = orchard_bench::SCHEMA_VERSION;
    let head = format!(
        "{{\"schema_version\": {schema}, \"code_version\": \"x\", \"config_version\": \"v1\", \"config_hash\": \"x\", \"profile\": \"full\", \
         \"controller\": \"greeter\", \"seed_set\": {{\"name\": \"v1\", \"whole\": true}}, \"seeds\": [1]}}"
    );
    fs::write(folder.path().join("summary.json"), head).unwrap();
    let here = folder.path().display().to_string();
    let line = <Line as clap::Parser>::try_parse_from(["x", "add", &here, "--budget", "gentle"]).unwrap();
    let Command::Add(args) = line.args.command else { panic!() };
    let board = BoardFile::new(folder.path().join("board.json"), SeedSetName::V1).unwrap();
    let stop = std::sync::atomic::AtomicBool::new(false);
    let refused =
        || match verification::verified(&args, folder.path(), &scenario(), &Program::new(), &board, &stop) {
            Err(Failure::BadInput(e)) => e,
            other => panic!("{other:?}"),
        };
    // A controller that this program lacks comes with its config texts, in the plan.
    let e = refused();
    assert!(e.contains("plan.json") && e.contains("a result folder of bench-v1 is needed"), "{e}");
    // A known one is compared with this build's versions.
    let summary = folder.path().join("summary.json");
    let text = fs::read_to_string(&summary).unwrap();
    fs::write(&summary, text.replace("greeter", "expert")).unwrap();
    assert!(refused().contains("refused: summary.json: code_version \"x\", but this build has"));
}
