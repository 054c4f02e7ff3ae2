//! Input that would take too much memory or time, and output that cannot be written.

#![cfg(unix)]

use std::fs::{self, OpenOptions};
use std::path::Path;
use std::process::{Command, Output, Stdio};

use orchard_bench::Shard;
use orchard_bench::checksum::{checked, with_checksum};
use orchard_bench::store::Store;
use orchard_scenario::Scenario;
use orchard_tasks::harvest::Extent;
use orchard_tasks::plan_file::{PlanFile, TaskPlan};

fn orchard(args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_orchard"));
    command.args(args).stdin(Stdio::null());
    command
}

fn output(command: &mut Command) -> Output {
    command.output().unwrap_or_else(|e| panic!("{e}"))
}

/// The program in at most 1 GiB of memory and 10 s of processor time, which a busy machine does not lengthen: an allocation or a second beyond them ends the process by a signal.
fn bounded(args: &[&str]) -> Command {
    let mut command = Command::new("sh");
    command
        .args(["-c", "ulimit -v 1048576; ulimit -t 10; exec \"$@\"", "sh", env!("CARGO_BIN_EXE_orchard")])
        .args(args);
    // The C library reserves addresses for every thread that allocates, used or not.
    command.env("MALLOC_ARENA_MAX", "2").stdin(Stdio::null());
    command
}

/// The one line with which a command refuses its input, within the bounds of [`bounded`]; SECURITY.md has the times on an idle machine.
fn refusal(args: &[&str]) -> String {
    let output = output(&mut bounded(args));
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{args:?}: {text}");
    let lines: Vec<&str> = text.lines().filter(|line| !line.starts_with("note: ")).collect();
    assert_eq!(lines.len(), 1, "{text}");
    lines[0].to_owned()
}

fn file(folder: &Path, name: &str, text: &str) -> String {
    let path = folder.join(name);
    fs::write(&path, text).unwrap();
    path.to_string_lossy().into_owned()
}

#[test]
fn a_device_is_no_input_file() {
    for args in [
        &["scenario", "show", "--config", "/dev/zero"][..],
        &["scenario", "show", "--scenario", "/dev/zero"],
        &["robot", "check", "--urdf", "/dev/zero"],
        &["robot", "check", "--urdf", "/dev/null"],
        &["detect", "--depth", "/dev/zero", "--intrinsics", "/dev/zero"],
        &["explain", "/dev/zero", "--text"],
        &["replay", "/dev/zero"],
    ] {
        let line = refusal(args);
        assert!(line.contains("is no regular file"), "{line}");
    }
    let folder = tempfile::tempdir().unwrap();
    let large = file(folder.path(), "large.toml", &"# x\n".repeat(300_000));
    assert!(refusal(&["scenario", "show", "--config", &large]).contains("more than 1048576 bytes"));
}

#[test]
fn products_of_options_are_bounded() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out").to_string_lossy().into_owned();
    let line = refusal(&["bench-v1", "--trees", "100000", "--repeats", "1000", "--out", &out]);
    assert!(line.contains("records; a task has at most 100000"), "{line}");
    assert!(!Path::new(&out).exists());
    let line = refusal(&["dataset", "--seeds", "0..18446744073709551615", "--out", &out]);
    assert!(line.contains("exceeds the limit of 10000000 images per data set"), "{line}");
}

/// A plan of one short episode in a result folder, after an edit with a fitting checksum.
fn edited_plan(folder: &Path, edit: impl Fn(String) -> String) {
    let extent = Extent {
        profile: "quick".into(),
        conditions: vec!["nominal".into()],
        seeds: vec![7],
        trees: 1,
        repeats: 1,
        horizon_s: 1.0,
    };
    let store = Store::open(folder).unwrap();
    let scenario = Scenario::of(&[]).unwrap().stored();
    PlanFile::write(
        &store,
        &[TaskPlan::Harvest { extent, backend: Default::default() }],
        &scenario,
        Shard::WHOLE,
    )
    .unwrap();
    let path = folder.join(PlanFile::FILE);
    let text = String::from_utf8(checked(&fs::read(&path).unwrap()).unwrap()).unwrap();
    let edited = edit(text.clone());
    assert_ne!(edited, text);
    fs::write(path, with_checksum(edited.as_bytes()).unwrap()).unwrap();
}

#[test]
fn a_plan_that_merge_reads_is_bounded() {
    let folder = tempfile::tempdir().unwrap();
    let part = folder.path().join("part").to_string_lossy().into_owned();
    let out = folder.path().join("out").to_string_lossy().into_owned();
    let refused = |edit: &dyn Fn(String) -> String| {
        edited_plan(Path::new(&part), edit);
        let line = refusal(&["merge", &part, "--out", &out]);
        assert!(!Path::new(&out).exists(), "{line}");
        line
    };
    let field = |name: &str, old: &str, new: &str| {
        let (from, to) = (format!("\"{name}\": {old}"), format!("\"{name}\": {new}"));
        refused(&|text| text.replacen(&from, &to, 1))
    };
    let line = field("trees", "1", "4000000000");
    assert!(line.contains("harvest: trees: 4000000000 is outside"), "{line}");
    assert!(field("repeats", "1", "4000000000").contains("harvest: repeats: 4000000000 is outside"));
    assert!(field("horizon_s", "1.0", "1e9").contains("harvest: horizon_s"));
    // Each number in its range, and their product is not.
    let line = refused(&|text| {
        text.replacen("\"trees\": 1", "\"trees\": 100000", 1).replacen(
            "\"repeats\": 1",
            "\"repeats\": 1000",
            1,
        )
    });
    assert!(line.contains("records; a task has at most 100000"), "{line}");
    // Lists as long as the file may be.
    let list = |name: &str, item: &dyn Fn(usize) -> String| {
        refused(&|text| {
            let start = text.find(&format!("\"{name}\": [")).unwrap();
            let end = start + text[start..].find(']').unwrap();
            let items: Vec<String> = (0..2_000_000).map(item).collect();
            format!("{}\"{name}\": [{}{}", &text[..start], items.join(","), &text[end..])
        })
    };
    let line = list("seeds", &|i| i.to_string());
    assert!(line.contains("2000000 records; a task has at most 100000"), "{line}");
    let line = list("conditions", &|i| if i == 1_999_999 { "\"hail\"" } else { "\"nominal\"" }.to_owned());
    assert!(line.contains("hail is neither a condition nor a group"), "{line}");
    // Nothing but brackets, as long as a file may be.
    let path = Path::new(&part).join(PlanFile::FILE);
    fs::write(&path, format!("{{\"a\": [{}0]}}", "[],".repeat(10_000_000))).unwrap();
    let line = refusal(&["merge", &part, "--out", &out]);
    assert!(line.contains("schema_version none"), "{line}");
    fs::write(&path, "[".repeat(30_000_000)).unwrap();
    let line = refusal(&["merge", &part, "--out", &out]);
    assert!(line.contains("not a plan of bench-v1"), "{line}");
}

#[test]
fn a_config_cannot_raise_a_count_by_a_range_of_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let huge = |unit: &str| {
        format!("{{ value = 4000000000, range = [0, 4000000000], unit = '{unit}', source = 'protocol' }}")
    };
    let text = format!("base = 'paper'\npreset = 'x'\n[fruit]\ncount = {}", huge("fruit"));
    let line = refusal(&["scenario", "show", "--config", &file(folder.path(), "a.toml", &text)]);
    assert!(line.contains("fruit.count: 4000000000 is more than 400"), "{line}");
    let bare = "base = 'paper'\npreset = 'x'\n[fruit]\ncount = { value = 4000000000, unit = 'fruit', source = 'protocol' }";
    let line = refusal(&["scenario", "show", "--config", &file(folder.path(), "bare.toml", bare)]);
    assert!(line.contains("range"), "{line}");
    let text = format!("base = 'paper'\n[fit]\neffort = {}", huge("looks a pixel"));
    let line = refusal(&["scenario", "show", "--detector", &file(folder.path(), "b.toml", &text)]);
    assert!(line.contains("4000000000"), "{line}");
    // A count by which other figures are checked, and a list that is longer than its items are large.
    let text = format!("[rules.seed_sets.v1]\nseeds = {}", huge("seeds"));
    let line = refusal(&["bench-v1", "--scenario", &file(folder.path(), "seeds.toml", &text)]);
    assert!(line.contains("seed_sets.v1.seeds: 4000000000 is more than 1000"), "{line}");
    let values: Vec<String> = (0..12_000)
        .map(|i| {
            format!(
                "{{ value = {}, range = [0.0, 3.0], unit = '1', source = 'protocol' }}",
                1e-4 * f64::from(i)
            )
        })
        .collect();
    let text = format!("[rules.sweeps.foliage]\nvalues = [{}]", values.join(","));
    let line = refusal(&["bench-v1", "--scenario", &file(folder.path(), "sweep.toml", &text)]);
    assert!(line.contains("sweeps.foliage: 12000 values are more than 100"), "{line}");
    let text = format!("[rules.detect]\nviews = {}", huge("views a tree"));
    let line = refusal(&["bench-v1", "--scenario", &file(folder.path(), "c.toml", &text)]);
    assert!(line.contains("detect.views: 4000000000 is more than 100000"), "{line}");
}

#[test]
fn a_config_that_is_no_toml_is_refused_with_line_and_column() {
    let folder = tempfile::tempdir().unwrap();
    let line = refusal(&["scenario", "show", "--config", &file(folder.path(), "a.toml", "a = 1\nb = = 2\n")]);
    assert!(line.contains("line 2, column "), "{line}");
}

#[test]
fn a_robot_that_is_nested_too_deep_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let deep = format!("<robot name='r'>{}{}</robot>", "<x>".repeat(20_000), "</x>".repeat(20_000));
    let line = refusal(&["robot", "check", "--urdf", &file(folder.path(), "deep.urdf", &deep)]);
    assert!(line.contains("elements inside one another"), "{line}");
    let many = format!("<robot name='r'>{}</robot>", "<joint name='j' type='fixed'/>".repeat(100_000));
    let line = refusal(&["robot", "check", "--urdf", &file(folder.path(), "many.urdf", &many)]);
    assert!(line.contains("links, joints and shapes"), "{line}");
    let mass = "<robot name='r'><link name='a'><inertial><mass value='NaN'/>\
                <inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial></link></robot>";
    let line = refusal(&["robot", "check", "--urdf", &file(folder.path(), "nan.urdf", mass)]);
    assert!(line.contains("link `a`") && line.contains("not finite"), "{line}");
}

#[test]
fn a_tree_of_too_many_segments_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = String::from(
        "# unit: m\nCODE:\tFORM-A\n\nCLASSES:\nSYMBOL\tSCALE\tDECOMPOSITION\tINDEXATION\tDEFINITION\n$\t0\tFREE\tFREE\tIMPLICIT\n\
         P\t1\tFREE\tFREE\tEXPLICIT\nI\t2\tFREE\tFREE\tEXPLICIT\n\nDESCRIPTION:\nLEFT\tRIGHT\tRELTYPE\tMAX\n\n\
         FEATURES:\nNAME\tTYPE\nXX\tREAL\nYY\tREAL\nZZ\tREAL\nTopDia\tREAL\n\nMTG:\nENTITY-CODE\tXX\tYY\tZZ\tTopDia\n/P1\n",
    );
    let first = text.clone();
    let chain = |text: &mut String, count: usize| {
        for i in 1..=count {
            let (edge, z) = (if i == 1 { "/" } else { "<" }, 1e-3 * i as f64);
            text.push_str(&format!("^{edge}I{i}\t0\t0\t{z}\t0.01\n"));
        }
    };
    chain(&mut text, 90_000);
    let out = folder.path().join("tree.xml").to_string_lossy().into_owned();
    let tree = file(folder.path(), "tree.mtg", &text);
    let line = refusal(&["export-tree", "--tree", &tree, "--format", "mjcf", "--out", &out]);
    assert!(line.contains("a tree has at most 50000"), "{line}");
    // Fewer, but each inside the one before.
    let mut text = first;
    chain(&mut text, 3_000);
    let tree = file(folder.path(), "chain.mtg", &text);
    let ended = output(&mut orchard(&["export-tree", "--tree", &tree, "--format", "mjcf", "--out", &out]));
    let text = String::from_utf8_lossy(&ended.stderr);
    assert!(!ended.status.success() && text.contains("more than 1000 links are below one another"), "{text}");
}

#[test]
fn control_characters_do_not_reach_the_terminal() {
    let line = refusal(&["scenario", "show", "--config", "no\x1b[2Jsuch\nfile.toml"]);
    assert!(line.contains("no\\u{1b}[2Jsuch\\nfile.toml"), "{line}");
}

#[test]
fn a_gallery_is_a_png() {
    let line = refusal(&["gallery", "--out", "x.txt"]);
    assert!(line.contains("--out x.txt: pictures are PNG"), "{line}");
}

/// A device that refuses every byte, as a full disk does.
fn full() -> Option<Stdio> {
    OpenOptions::new().write(true).open("/dev/full").ok().map(Stdio::from)
}

#[test]
fn a_standard_output_that_cannot_be_written_is_an_error() {
    for args in [&["presets"][..], &["scenario", "show"], &["--help"], &["bench-v1", "--help"]] {
        let Some(full) = full() else { return };
        let ended = output(orchard(args).stdout(full));
        let text = String::from_utf8_lossy(&ended.stderr);
        assert_eq!(ended.status.code(), Some(1), "{args:?}: {text}");
        assert!(text.contains("cannot write to the standard output"), "{args:?}: {text}");
    }
}

#[test]
fn an_error_output_that_cannot_be_written_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("tree.json").to_string_lossy().into_owned();
    let Some(stderr) = full() else { return };
    let ended =
        output(orchard(&["export-tree", "--seed", "1", "--format", "json", "--out", &out]).stderr(stderr));
    assert_eq!(ended.status.code(), Some(0));
    assert!(Path::new(&out).is_file());
    let Some(stderr) = full() else { return };
    let ended = output(orchard(&["scenario", "show", "--config", "/dev/zero"]).stderr(stderr));
    assert_eq!(ended.status.code(), Some(2));
}
