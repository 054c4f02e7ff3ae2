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
        place_success_per_attempt: Some(0.75),
        episodes: 330,
        quarantined: 0,
        code_version: "0.1.0+abc".into(),
        config_hash: "hash".into(),
        records_sha256: name.repeat(8),
        sample: vec!["episodes/a.json".into()],
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
        board.add(entry).unwrap();
    }
    board
}

#[test]
fn a_board_is_kept_as_file_table_and_figure() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("new/board.json");
    save(&board(), &file).unwrap();
    assert_eq!(Board::from_json(&fs::read_to_string(&file).unwrap()).unwrap(), board());
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
    assert!(
        table.contains("All entries are ranked under one budget per tree, snapped <= 0, dropped <= 0.5"),
        "{table}"
    );
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
    assert!(said(&["show", "--board", &board]).ends_with("b.json: no such board"));
    assert!(said(&["show", "--board", &path("b.txt")]).contains("the file name must end in .json"));
    let e = said(&["add", &here, "--board", &board]);
    assert_eq!(e, "the budget is missing: give --budget gentle or paper, or --snapped B --dropped D");
    let e = said(&["add", &here, "--budget", "open"]);
    assert_eq!(e, "--budget open: the budgets are gentle, paper");
    let e = said(&["add", &here, "--snapped", "-1", "--dropped", "1"]);
    assert_eq!(e, "--snapped, --dropped: snapped = -1 per tree: must be a finite number >= 0");
    assert!(said(&["add", &here, "--snapped", "1"]).contains("--dropped"));
    assert!(said(&["add", "--budget", "gentle"]).contains("<RESULT>"));
    assert!(said(&["add", &here, "--budget", "gentle", "--sample", "0"]).contains("--sample"));
    assert!(said(&["add", &here, "--budget", "gentle", "--name", "a|b"]).contains("must have 1 to 40"));
    let e = said(&["add", &here, &here, "--budget", "gentle", "--name", "x"]);
    assert!(e.starts_with("--name: only with a single RESULT"), "{e}");
    fs::write(&board, "{}").unwrap();
    assert!(said(&["show", "--board", &board]).contains("the board has schema_version none"));
}

#[test]
fn a_controller_that_the_program_lacks_is_refused() {
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
    let stop = std::sync::atomic::AtomicBool::new(false);
    let refused = |args: &AddArgs| match checked(args, folder.path(), &scenario(), &Program::new(), &stop) {
        Err(Failure::BadInput(e)) => e,
        other => panic!("{other:?}"),
    };
    let e = refused(&args);
    assert!(e.contains("no controller 'greeter'; the controllers are: baseline, paper, expert"), "{e}");
    assert!(e.contains("docs/leaderboard.md"), "{e}");
    // A known one is compared with this build's versions.
    let summary = folder.path().join("summary.json");
    let text = fs::read_to_string(&summary).unwrap();
    fs::write(&summary, text.replace("greeter", "expert")).unwrap();
    assert!(refused(&args).contains("refused: summary.json: code_version \"x\", but this build has"));
}
