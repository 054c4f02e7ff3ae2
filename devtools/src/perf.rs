//! `cargo xtask perf`: speed of the parts, as a file of rows.

mod episode;
mod gpu;
mod perception;
mod physics;
mod scaling;
mod timing;
mod trees;

use std::path::PathBuf;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use orchard_tasks::plan_file::Backend;

use orchard_program::Failure;
use orchard_program::rows::{Effort, Suite, run_suite};

/// Measures speed on this machine and writes the rows to a file.
#[derive(clap::Args)]
#[command(
    after_help = "Suites:\n  env      the learning environments; `orchard perf env` is the same\n  trees    trees grown per second on one core; 512 randomised worlds built\n  physics  substeps of trees per second, beside MuJoCo's\n  \
                        episode  nominal episodes of every controller with picker and camera, one core\n  \
                        gpu      substeps of batches of trees, of robots, and of worlds with both, on the graphics device\n  \
                        worlds   those of worlds with both alone\n  \
                        perception  depth images of the wrist camera and the detector on them, one core\n  \
                        scaling  batches of trees by worlds, mode and solver, on the processor or (--backend gpu) the graphics device\n\n\
                  Rows of physics (151 links, 30 fruit, 390 degrees of freedom; medians of processor time, in turns with MuJoCo):\n  \
                  physics.one_tree              one tree, one core, f64\n  \
                  physics.batch_512             512 trees of one topology, dimensions of their own, 2 threads\n  \
                  physics.batch_512_topologies  512 trees, each of its own topology, 2 threads; .share over the row before\n  \
                  physics.contact_8             one tree with a capsule that is pushed through its canopy, f64\n  \
                  physics.segments.*            one substep of trees of 50 to 2,000 segments, f64 and one tree per lane\n  \
                  physics.fruit.*               the same of one tree with 20 to 80 fruit\n  \
                  *.memory                      bytes per world\n\
                  Rows of episode (one tree per tuning seed, 75 s; medians of processor time):\n  \
                  episode.nominal_75s.*         seconds of a whole episode, by controller\n  \
                  episode.rate.*                the same as world-seconds per second\n\
                  Rows of gpu (151 links, 30 fruit; medians of the time elapsed; targets are those of one H200):\n  \
                  gpu.dimensions_N              N trees of one topology, dimensions of their own; .memory, .build\n  \
                  gpu.dimensions_N.dram, ..     shares from hardware counters: .dram bandwidth; time of .fp32 and .integer units and of .multiprocessors; slots of .warps\n  \
                  gpu.drawn_4096.build          seconds to draw and settle them on the device, from one tree\n  \
                  gpu.same_N, gpu.topologies_N  N equal trees; N trees of 512 topologies; .share over the row before\n  \
                  gpu.robot_N                   N of the paper's robots alone, without contact; .memory\n  \
                  gpu.world_N                   N trees of 512 topologies, each pushed by a robot; .contacts and .loaded, means of a world; .overfull, share of worlds that left out contacts; .memory\n  \
                  gpu.world_press_N             the same with a press that holds eight levers against the trunk (suite worlds alone); .loaded_least, fewest contacts under load of a world\n  \
                  gpu.mujoco_warp_N.*           MuJoCo-Warp on the first of these, by solver and integrator; the best is the peer of dimensions_N\n\
                  Rows of perception (views of nominal episodes of the tuning seeds; mean over the views, median of rounds of processor time):\n  \
                  perception.camera.192x144, .640x480     scene from the world, depth and labels\n  \
                  perception.camera.scene                 the scene alone\n  \
                  perception.camera.fruit_views.*         what the image shows of each fruit\n  \
                  perception.mask.192x144                 pixels of robot and ground\n  \
                  perception.detector.192x144             the detector, masks given\n\
                  Rows of scaling (trees of the scaling task; medians of the time elapsed; `cargo xtask report` draws the file as\n                  \
                  DIR/scaling.json or DIR/scaling-gpu.json):\n  \
                  scaling.MODE_N.SOLVER                   frames of one world per second in a batch of N; null if skipped, with the reason\n  \
                  scaling.MODE_N.SOLVER.build             64 and 512 worlds: seconds to grow, settle and pack them\n  \
                  scaling.axis.KIND.SOLVER                rate of 8 settled worlds that differ in one kind, over that of 8 identical ones\n\
                  MuJoCo needs python3 with venv and, the first time, the network or the wheels in tests/judge/wheels; without them the peer's columns are null.\n\
                  docs/performance.md describes the measurements. A missed target gives exit code 1.\n\n\
                  Examples:\n  cargo xtask perf physics --json physics.json\n  cargo xtask perf trees --json trees.json\n  \
                  cargo xtask perf scaling --backend gpu --json scaling-gpu.json"
)]
pub struct Args {
    /// Suite to measure
    suite: String,
    /// JSON file for the rows
    #[arg(long, value_name = "FILE")]
    json: PathBuf,
    /// Few and short rounds, only to check that everything works (suites physics, perception, gpu and scaling)
    #[arg(long)]
    quick: bool,
    /// Processor for the batches of the suite scaling [default: cpu]
    #[arg(long, value_name = "cpu|gpu")]
    backend: Option<Backend>,
}

/// The suite with the option `--backend`.
const SCALING: &str = "scaling";

/// The suites; one of them runs on a backend.
fn suites(backend: Backend) -> [Suite; 8] {
    [
        orchard_program::commands::perf::ENV,
        Suite {
            name: "trees",
            about: "trees grown per second on one core; 512 randomised worlds built",
            measure: trees::measure,
        },
        Suite {
            name: "physics",
            about: "substeps of trees per second, beside MuJoCo's",
            measure: physics::measure,
        },
        Suite {
            name: "episode",
            about: "nominal episodes of every controller with picker and camera, one core",
            measure: episode::measure,
        },
        Suite {
            name: "gpu",
            about: "substeps of batches of trees, of robots, and of worlds with both, on the graphics device",
            measure: gpu::measure,
        },
        Suite { name: "worlds", about: "those of worlds with both alone", measure: gpu::worlds::measure },
        Suite {
            name: "perception",
            about: "depth images of the wrist camera and the detector on them, one core",
            measure: perception::measure,
        },
        Suite {
            name: SCALING,
            about: "batches of trees by worlds, mode and solver",
            measure: match backend {
                Backend::Cpu => scaling::on_cpu,
                Backend::Gpu => scaling::on_gpu,
            },
        },
    ]
}

pub fn run(args: &Args) -> Result<(), Failure> {
    let effort = if args.quick { Effort::Quick } else { Effort::Full };
    let suites = suites(args.backend.unwrap_or_default());
    let is_known = suites.iter().any(|suite| suite.name == args.suite);
    if args.backend.is_some() && is_known && args.suite != SCALING {
        let suite = &args.suite;
        return Err(Failure::BadInput(format!("--backend applies to the suite {SCALING}, not to {suite}")));
    }
    run_suite("perf", &suites, &args.suite, &args.json, effort)
}

/// Spinner with the current activity and the elapsed time.
fn spinner() -> ProgressBar {
    let bar = ProgressBar::new_spinner();
    if let Ok(style) = ProgressStyle::with_template("{spinner} {elapsed}  {msg}") {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}

/// Prints the current activity: beside the spinner, or in a line where there is no terminal.
fn say(bar: &ProgressBar, what: &str) {
    if bar.is_hidden() {
        eprintln!("{what}");
    } else {
        bar.set_message(what.to_owned());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use orchard_scaling::AxisKind;

    fn scaling_run(backend: &str) -> Result<serde_json::Value, Failure> {
        let folder = tempfile::tempdir().unwrap();
        let json = folder.path().join("scaling.json");
        let backend = Some(backend.parse().unwrap());
        run(&Args { suite: SCALING.to_owned(), json: json.clone(), quick: true, backend })?;
        // `orchard report` reads the file unchanged.
        let written =
            orchard_program::commands::report::write(folder.path(), true, &orchard_program::Program::new())?;
        assert_eq!(written.figures, 3);
        Ok(serde_json::from_str(&std::fs::read_to_string(json).unwrap()).unwrap())
    }

    /// Every cell has its row, and so has every kind of randomisation; the file holds the scaling run itself.
    fn is_whole(file: &serde_json::Value, backend: &str) {
        let rows = file["rows"].as_array().unwrap();
        let scaling: orchard_scaling::Scaling = serde_json::from_value(file["scaling"].clone()).unwrap();
        assert_eq!((scaling.backend.name(), file["context"]["backend"].as_str()), (backend, Some(backend)));
        assert!(!scaling.rows.is_empty() && scaling.omitted.is_empty());
        let solvers = scaling.rows.iter().filter(|row| row.worlds == 1).count() / 4;
        let axes = solvers * AxisKind::ALL.len();
        assert_eq!((rows.len(), scaling.axes.len()), (scaling.rows.len() + axes, axes));
        for row in &scaling.rows {
            assert_eq!(row.substeps_per_s, 3.0 * row.env_steps_per_s);
            assert!(row.build_s() > 0.0 && row.unfinite == 0, "{row:?}");
        }
        assert!(scaling.axes.iter().all(|axis| axis.relative > 0.0), "{:?}", scaling.axes);
    }

    #[test]
    fn a_small_scaling_run_is_whole() {
        is_whole(&scaling_run("cpu").unwrap(), "cpu");
    }

    /// With a device the run is complete, and every row names a software adapter; without one the CPU is named.
    #[test]
    fn a_small_scaling_run_on_a_device() {
        match scaling_run("gpu") {
            Ok(file) => {
                is_whole(&file, "gpu");
                let adapter = &file["scaling"]["adapter"];
                let is_told = |row: &serde_json::Value| {
                    row["note"].as_str().is_some_and(|note| note.contains("a software adapter"))
                };
                let is_software = adapter["is_software"].as_bool().unwrap();
                assert!(file["rows"].as_array().unwrap().iter().all(|row| is_told(row) == is_software));
            }
            Err(failure) => {
                let line = failure.to_string();
                assert!(line.contains("no graphics adapter was found"), "{line}");
                assert!(line.contains("--backend cpu"), "{line}");
                println!("SKIPPED: {line}");
            }
        }
    }

    #[test]
    fn backends_are_of_one_suite() {
        let json = PathBuf::from("never-written.json");
        let args = |suite: &str| Args {
            suite: suite.to_owned(),
            json: json.clone(),
            quick: true,
            backend: Some(Backend::Cpu),
        };
        let refused = |suite: &str| match run(&args(suite)) {
            Err(Failure::BadInput(line)) => line,
            other => panic!("{other:?}"),
        };
        assert_eq!(refused("gpu"), "--backend applies to the suite scaling, not to gpu");
        assert!(refused("speed").starts_with("no perf suite 'speed'"));
        assert_eq!("tpu".parse::<Backend>(), Err("must be one of cpu and gpu".to_owned()));
    }
}
