use super::*;

#[derive(clap::Parser)]
struct Line {
    #[command(flatten)]
    args: Args,
}

fn args(line: &[&str]) -> Args {
    let line = [&["bench-v1"], line].concat();
    <Line as clap::Parser>::try_parse_from(line).unwrap_or_else(|e| panic!("{e}")).args
}

fn orders_of(line: &[&str]) -> Result<Vec<Order>, String> {
    orders(&args(line), &Protocol::paper()).map_err(|e| match e {
        Failure::BadInput(e) => e,
        other => panic!("{other}"),
    })
}

fn extent_of(line: &[&str]) -> Extent {
    match orders_of(line).unwrap().remove(0) {
        Order::Harvest { extent, .. } => extent,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_run_is_all_tasks_unless_told_otherwise() {
    let tasks =
        |line: &[&str]| -> Vec<&'static str> { orders_of(line).unwrap().iter().map(Order::task).collect() };
    assert_eq!(tasks(&[]), ["harvest", "detect", "reach-and-grasp", "gentle", "scaling"]);
    assert_eq!(tasks(&["--shard", "1/2"]), ["harvest", "detect", "reach-and-grasp", "gentle"]);
    let e = orders_of(&["--shard", "1/2", "--tasks", "scaling"]).unwrap_err();
    assert_eq!(e, "--shard: the task scaling has no parts; run it alone");
    assert_eq!(tasks(&["--tasks", "gentle,harvest"]), ["harvest", "gentle"]);
    assert_eq!(tasks(&["--conditions", "nominal"]), ["harvest"]);
    assert_eq!(tasks(&["--camera", "ideal"]), ["detect"]);
    assert_eq!(tasks(&["--camera", "ideal", "--horizon", "3"]), ["harvest", "detect"]);
}

#[test]
fn a_seed_set_brings_its_trees_and_repeats() {
    let protocol = Protocol::paper();
    let of = |line: &[&str]| {
        let extent = extent_of(line);
        (extent.seeds, extent.trees, extent.repeats)
    };
    assert_eq!(of(&[]), (vec![20250704], 6, 1));
    assert_eq!(of(&["--seeds", "v1"]), (protocol.v1_seeds(), 6, 3));
    assert_eq!(of(&["--seeds", "tuning", "--repeats", "2"]), (protocol.tuning_seeds.clone(), 6, 2));
    assert_eq!(of(&["--seeds", "v1", "--trees", "1", "--repeats", "1"]), (protocol.v1_seeds(), 1, 1));
    for (line, option) in [(["--repeats", "0"], "--repeats: "), (["--trees", "0"], "--trees: ")] {
        let problem = orders_of(&line).unwrap_err();
        assert!(problem.starts_with(option), "{problem}");
    }
}

#[test]
fn conditions_and_sweeps_by_name() {
    let conditions = |line: &[&str]| extent_of(line).conditions;
    assert_eq!(conditions(&[]).len(), 10);
    assert_eq!(
        conditions(&["--conditions", "terrain-0.2,fruit"]),
        ["nominal", "fruit-20", "fruit-60", "terrain-0.2"]
    );
    let refused = |line: &[&str]| orders_of(line).unwrap_err();
    let e = refused(&["--conditions", "windy"]);
    assert!(
        e.starts_with("--conditions: windy is neither a condition nor a sweep; there are foliage,"),
        "{e}"
    );
    assert!(
        refused(&["--conditions", "fruit-20", "--repeats", "2"])
            .starts_with("--repeats: these are of the nominal")
    );
    assert!(
        refused(&["--conditions", "exhaustion", "--horizon", "2"])
            .starts_with("--horizon: exhaustion has one")
    );
    assert!(refused(&["--horizon", "-1"]).starts_with("--horizon: "));
}

#[test]
fn options_of_tasks_that_are_not_run() {
    let refused = |line: &[&str]| orders_of(line).unwrap_err();
    assert_eq!(
        refused(&["--tasks", "harvest", "--camera", "ideal"]),
        "--camera is for the task detect, which --tasks does not name"
    );
    assert!(refused(&["--tasks", "detect", "--conditions", "nominal"]).starts_with("--conditions is for"));
    assert!(refused(&["--tasks", "detect", "--controller", "expert"]).starts_with("--controller is for"));
    assert_eq!(refused(&["--controller", "nobody"]), "--controller nobody: there are baseline, paper, expert");
}

#[test]
fn the_backend_is_of_the_scaling_task() {
    let backend = |line: &[&str]| match orders_of(line).unwrap().pop() {
        Some(Order::Scaling { backend, .. }) => backend.name(),
        other => panic!("{other:?}"),
    };
    assert_eq!(backend(&["--tasks", "scaling"]), "cpu");
    assert_eq!(backend(&["--tasks", "scaling", "--backend", "gpu"]), "gpu");
    // The other tasks are run as ever.
    assert_eq!(backend(&["--backend", "gpu"]), "gpu");
    assert_eq!(orders_of(&["--backend", "gpu"]).unwrap().len(), 5);
    assert_eq!(
        orders_of(&["--tasks", "detect", "--backend", "gpu"]).unwrap_err(),
        "--backend is for the task scaling, which --tasks does not name"
    );
    let line = ["bench-v1", "--backend", "tpu"];
    let e = <Line as clap::Parser>::try_parse_from(line).err().unwrap().to_string();
    assert!(e.contains("'tpu'") && e.contains("--backend") && e.contains("there are cpu and gpu"), "{e}");
}

#[test]
fn plans_in_common_use_have_folders_of_their_own() {
    let out = |line: &[&str]| default_out(&args(line)).display().to_string();
    assert_eq!(out(&[]), "results/bench-v1-quick");
    assert_eq!(out(&["--controller", "baseline"]), "results/bench-v1-quick");
    assert_eq!(
        out(&["--profile", "full", "--controller", "expert", "--seeds", "v1", "--conditions", "exhaustion"]),
        "results/bench-v1-full-expert-v1-exhaustion"
    );
    assert_eq!(out(&["--shard", "2/8"]), "results/bench-v1-quick-2of8");
}

#[test]
fn detectors_by_name_and_file() {
    let bad = |detector: &str| match named_detector(detector) {
        Err(Failure::BadInput(line)) => line,
        other => panic!("{other:?}"),
    };
    assert_eq!(named_detector("paper").unwrap(), ("paper".to_owned(), DetectorConfig::paper()));
    assert_eq!(bad("eagle"), "--detector: no detector 'eagle'; the detectors are: paper, paper-single, d435i");
    assert!(bad("no/such.toml").starts_with("--detector no/such.toml: "));
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("mine.toml");
    let path = file.to_string_lossy().into_owned();
    let paper = orchard_perception::config::PAPER_TOML;
    std::fs::write(&file, paper.replacen("refine = true", "refine = false", 1)).unwrap();
    let (name, config) = named_detector(&path).unwrap();
    assert_eq!((&*name, config.fit.refine), ("mine.toml", false));
    let bad_jump = paper.replacen("depth_jump = { value = 15.0", "depth_jump = { value = -1.0", 1);
    std::fs::write(&file, bad_jump).unwrap();
    let line = bad(&path);
    assert!(line.contains("mine.toml: segmentation.depth_jump") && line.contains("[0.1, 1000]"), "{line}");
}
