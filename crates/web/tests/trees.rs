//! Digitised trees that a visitor opens, against the command line's.

use orchard_digitised::{json, mtg};
use orchard_scenario::Scenario;
use orchard_spec::Spec;
use orchard_web::{Ask, Files, Tab, TreeBytes, grow};

/// Opens a file of these bytes on the page; the unit is that of an MTG file.
fn page(name: &str, bytes: &[u8], unit: Option<&str>) -> Result<Tab, String> {
    let ask = Ask {
        tree_file: Some(name.to_owned()),
        tree_unit: unit.map(str::to_owned),
        driver: "nobody".to_owned(),
        ..Ask::default()
    };
    let tree = TreeBytes { name: name.to_owned(), bytes: bytes.to_vec() };
    grow(&ask, &Files { tree: Some(tree), ..Files::default() }).map_err(|e| e.to_string())
}

fn options<'a>(path: &'a str, unit: Option<&'a str>) -> Vec<(&'static str, &'a str)> {
    [("tree", path)].into_iter().chain(unit.map(|unit| ("tree-unit", unit))).collect()
}

/// A tree moves as it does under `--tree`, bit for bit, from either format.
#[test]
fn a_tree_moves_as_on_the_command_line() {
    let folder = tempfile::tempdir().unwrap();
    let grown = orchard_treegen::grow(&Spec::paper(), 7, 0).unwrap();
    // Without its units, as other programs write it.
    let bare = mtg::write(&grown).replace("# unit: m\n", "");
    for (name, text, unit) in [("tree.json", json::write(&grown), None), ("tree.mtg", bare, Some("m"))] {
        let path = folder.path().join(name);
        std::fs::write(&path, &text).unwrap();
        let scenario = Scenario::of(&options(path.to_str().unwrap(), unit)).unwrap();
        let mut world = scenario.world(20250704, 0, 0).unwrap();
        let mut tab = page(name, text.as_bytes(), unit).unwrap();
        let hold = scenario.robot().start_command();
        for _ in 0..10 {
            world.step(&hold);
            tab.step();
        }
        assert_eq!(tab.session().world().state_digest(), world.state_digest(), "{name}");
        assert_eq!(tab.notes(), scenario.digitised_tree().unwrap().notes());
    }
}

/// The page says of bad files what the command line says.
#[test]
fn bad_files_get_the_sentences_of_the_command_line() {
    let folder = tempfile::tempdir().unwrap();
    let grown = orchard_treegen::grow(&Spec::paper(), 7, 0).unwrap();
    let good = json::write(&grown);
    let later = good.replace("\"schema_version\": 1", "\"schema_version\": 9");
    let bad = [
        ("no-tree.json", b"{".to_vec(), None),
        ("later.json", later.into_bytes(), None),
        ("latin.json", vec![0xe4], None),
        ("tree.json", good.into_bytes(), Some("mm")),
        ("no-tree.mtg", b"apple".to_vec(), None),
        ("unit.mtg", mtg::write(&grown).into_bytes(), Some("furlong")),
    ];
    for (name, bytes, unit) in bad {
        let path = folder.path().join(name);
        std::fs::write(&path, &bytes).unwrap();
        let native = Scenario::of(&options(path.to_str().unwrap(), unit)).unwrap_err().to_string();
        let e = page(name, &bytes, unit).map(|_| ()).unwrap_err();
        let problem = e.strip_prefix(&format!("tree {name}: ")).unwrap_or_else(|| panic!("{e}"));
        assert!(native.ends_with(problem) && problem.len() > 10, "{native}\n{e}");
    }
}

#[test]
fn a_tree_that_is_not_here_or_of_another_kind_is_told() {
    let refused = |ask: &Ask| grow(ask, &Files::default()).map(|_| ()).unwrap_err().to_string();
    let ask = Ask { tree_file: Some("mine.mtg".to_owned()), ..Ask::default() };
    assert_eq!(refused(&ask), "tree mine.mtg: its file is not here: open mine.mtg");
    let ask = Ask { tree_unit: Some("mm".to_owned()), ..Ask::default() };
    assert_eq!(refused(&ask), "tree_unit is of a tree from a file, and no file is named");
    let e = page("tree.ply", b"ply", None).map(|_| ()).unwrap_err();
    assert_eq!(e, "tree tree.ply: the file name must end in .json or .mtg");
    let large = vec![b' '; orchard_input::TREE as usize + 1];
    let e = page("large.json", &large, None).map(|_| ()).unwrap_err();
    assert_eq!(e, "tree large.json: has more than 33554432 bytes, the largest size that is read");
}
