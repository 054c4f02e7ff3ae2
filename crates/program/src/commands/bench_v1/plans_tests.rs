use super::*;
use crate::commands::bench_v1::BENCHMARK;
use crate::program::Program;
use orchard_perception::DetectorConfig;
use orchard_robot::RobotModel;

#[derive(clap::Parser)]
struct Line {
    #[command(flatten)]
    args: Args,
}

fn args(line: &[&str]) -> Args {
    let line = [&["bench-v1"], line].concat();
    <Line as clap::Parser>::try_parse_from(line).unwrap_or_else(|e| panic!("{e}")).args
}

fn plans_of(line: &[&str]) -> Result<Vec<TaskPlan>, String> {
    let bad = |e| match e {
        Failure::BadInput(e) => e,
        other => panic!("{other}"),
    };
    let args = args(line);
    let scenario = args.run.scenario.resolve(&Program::new()).map_err(bad)?;
    plans(&args, &scenario).map_err(bad)
}

fn extent_of(line: &[&str]) -> Extent {
    match plans_of(line).unwrap().remove(0) {
        TaskPlan::Harvest { extent, .. } => extent,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_run_is_all_tasks_unless_told_otherwise() {
    let tasks =
        |line: &[&str]| -> Vec<&'static str> { plans_of(line).unwrap().iter().map(TaskPlan::task).collect() };
    assert_eq!(tasks(&[]), ["harvest", "detect", "reach-and-grasp", "gentle", "scaling"]);
    assert_eq!(tasks(&["--shard", "1/2"]), ["harvest", "detect", "reach-and-grasp", "gentle"]);
    let e = plans_of(&["--shard", "1/2", "--tasks", "scaling"]).unwrap_err();
    assert_eq!(e, "--shard: the task scaling cannot be split into parts; run it without --shard");
    assert_eq!(tasks(&["--tasks", "gentle,harvest"]), ["harvest", "gentle"]);
    assert_eq!(tasks(&["--conditions", "nominal"]), ["harvest"]);
    assert_eq!(tasks(&["--camera", "ideal", "--preset", "v-trellis"]).len(), 5);
    assert_eq!(tasks(&["--camera", "ideal", "--horizon", "3"]), ["harvest"]);
}

#[test]
fn a_seed_set_brings_its_trees_and_repeats() {
    let protocol = Protocol::paper();
    let of = |line: &[&str]| {
        let extent = extent_of(line);
        (extent.seeds, extent.trees, extent.repeats)
    };
    assert_eq!(of(&[]), (vec![20250704], 6, 1));
    assert_eq!(of(&["--seeds", "v1"]), (protocol.official_seeds(), 6, 3));
    assert_eq!(of(&["--seeds", "tuning", "--repeats", "2"]), (protocol.tuning_seeds.clone(), 6, 2));
    assert_eq!(of(&["--seeds", "v1", "--trees", "1", "--repeats", "1"]), (protocol.official_seeds(), 1, 1));
    for (line, option) in [(["--repeats", "0"], "--repeats: "), (["--trees", "0"], "--trees: ")] {
        let problem = plans_of(&line).unwrap_err();
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
    let refused = |line: &[&str]| plans_of(line).unwrap_err();
    let e = refused(&["--conditions", "windy"]);
    assert!(
        e.starts_with(
            "--conditions: windy is neither a condition nor a group or sweep of them; the names are foliage,"
        ),
        "{e}"
    );
    assert!(
        refused(&["--conditions", "fruit-20", "--repeats", "2"])
            .starts_with("--repeats: applies to the condition nominal")
    );
    assert!(
        refused(&["--conditions", "exhaustion", "--horizon", "2"])
            .starts_with("--horizon: does not apply to exhaustion")
    );
    assert_eq!(
        refused(&["--conditions", "exhaustions"]).split(';').next(),
        Some("--conditions: exhaustions is neither a condition nor a group or sweep of them"),
        "v1 has none"
    );
    assert!(refused(&["--horizon", "-1"]).starts_with("--horizon: "));
}

#[test]
fn options_of_tasks_that_are_not_run() {
    let refused = |line: &[&str]| plans_of(line).unwrap_err();
    assert!(
        refused(&["--tasks", "detect", "--conditions", "nominal"]).starts_with("--conditions applies to")
    );
    assert!(refused(&["--tasks", "detect", "--controller", "expert"]).starts_with("--controller applies to"));
    assert_eq!(
        refused(&["--controller", "nobody"]),
        "--controller: no controller 'nobody'; the controllers are: baseline, paper, expert"
    );
}

#[test]
fn the_backend_is_of_all_tasks_that_move_worlds() {
    let backend = |line: &[&str]| match plans_of(line).unwrap().pop() {
        Some(TaskPlan::Scaling { backend, .. }) => backend.name(),
        other => panic!("{other:?}"),
    };
    assert_eq!(backend(&["--tasks", "scaling"]), "cpu");
    assert_eq!(backend(&["--tasks", "scaling", "--backend", "gpu"]), "gpu");
    assert_eq!(backend(&["--backend", "gpu"]), "gpu");
    let plans = plans_of(&["--backend", "gpu"]).unwrap();
    assert_eq!(
        plans.iter().map(TaskPlan::task).collect::<Vec<_>>(),
        ["harvest", "reach-and-grasp", "gentle", "scaling"]
    );
    let TaskPlan::Harvest { extent, backend: Backend::Gpu } = &plans[0] else { panic!("{:?}", plans[0]) };
    assert!(extent.conditions.iter().any(|name| name.starts_with("terrain")), "{extent:?}");
    assert_eq!(
        plans_of(&["--tasks", "detect", "--backend", "gpu"]).unwrap_err(),
        "--backend applies to the tasks harvest, reach-and-grasp, gentle and scaling, which --tasks does not include"
    );
    assert_eq!(plans_of(&["--lanes", "4"]).unwrap_err(), "--lanes applies to --backend gpu alone");
    let line = ["bench-v1", "--backend", "tpu"];
    let e = <Line as clap::Parser>::try_parse_from(line).err().unwrap().to_string();
    assert!(
        e.contains("'tpu'") && e.contains("--backend") && e.contains("must be one of cpu and gpu"),
        "{e}"
    );
}

#[test]
fn plans_in_common_use_have_folders_of_their_own() {
    let out = |line: &[&str]| default_out(&args(line), BENCHMARK).display().to_string();
    assert_eq!(out(&[]), "results/bench-v1-quick");
    assert_eq!(out(&["--controller", "baseline"]), "results/bench-v1-quick");
    assert_eq!(
        out(&["--profile", "full", "--controller", "expert", "--seeds", "v1", "--conditions", "exhaustion"]),
        "results/bench-v1-full-expert-v1-exhaustion"
    );
    assert_eq!(out(&["--shard", "2/8"]), "results/bench-v1-quick-2of8");
    assert_eq!(
        out(&["--preset", "tall-spindle", "--camera", "my/eye.toml", "--controller", "expert"]),
        "results/bench-v1-quick-tall-spindle-eye-expert"
    );
}

#[test]
fn a_task_that_a_scenario_does_not_fit_says_why() {
    let still = orchard_picker::custom("still", "1", |_: &RobotModel, _: &DetectorConfig| Still);
    let scenario = Scenario::of(&[]).unwrap().with_controller(still);
    let names: Vec<_> = plans(&args(&[]), &scenario).unwrap().iter().map(TaskPlan::task).collect();
    assert_eq!(names, ["harvest", "detect", "scaling"]);
    let e = plans(&args(&["--tasks", "gentle"]), &scenario).unwrap_err().to_string();
    assert_eq!(e, "--tasks gentle: controller still cannot be given a goal, which this task needs");
}

/// A controller that is never called.
struct Still;

impl orchard_picker::Controller for Still {
    fn act(&mut self, _: &orchard_robot::Observation) -> orchard_robot::Command {
        unreachable!("plans are made and not run")
    }
    fn record(&self) -> &orchard_picker::Record {
        unreachable!("plans are made and not run")
    }
}
