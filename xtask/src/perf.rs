//! `cargo xtask perf`: how fast the parts are, as a file of rows.

mod episode;
mod gpu;
mod perception;
mod physics;
mod timing;
mod trees;

use std::path::PathBuf;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

use crate::failure::Failure;
use crate::rows::{Effort, Suite, run_suite};

/// Measures speed on this machine and writes the rows to a file.
#[derive(clap::Args)]
#[command(
    after_help = "Suites:\n  trees    trees grown a second of one core, and 512 randomised worlds built\n  physics  substeps of trees a second, beside MuJoCo's\n  \
                        episode  nominal episodes of every controller with picker and camera, one core\n  \
                        gpu      substeps of batches of trees on the graphics device\n  \
                        perception  depth images of the wrist camera and the detector on them, one core\n\n\
                  Rows of physics (151 links, 30 fruit, 390 degrees of freedom; medians of processor time, in turns with MuJoCo):\n  \
                  physics.one_tree              one tree, one core, f64\n  \
                  physics.batch_512             512 trees of one topology, dimensions of their own, 2 threads\n  \
                  physics.batch_512_topologies  512 trees, each of its own topology, 2 threads; .share over the row before\n  \
                  physics.contact_8             one tree with a capsule that is pushed through its canopy, f64\n  \
                  physics.segments.*            one substep of trees of 50 to 2,000 segments, f64 and a tree of a lane\n  \
                  physics.fruit.*               the same of one tree with 20 to 80 fruit\n  \
                  *.memory                      bytes a world\n\
                  Rows of episode (one tree a tuning seed, 75 s; medians of processor time):\n  \
                  episode.nominal_75s.*         seconds of a whole episode, by controller\n  \
                  episode.rate.*                the same as world-seconds a second\n\
                  Rows of gpu (151 links, 30 fruit; medians of the time elapsed; targets are those of one H200):\n  \
                  gpu.dimensions_N              N trees of one topology, dimensions of their own; .memory, .build\n  \
                  gpu.same_N, gpu.topologies_N  N equal trees; N trees of 512 topologies; .share over the row before\n  \
                  gpu.mujoco_warp_N.*           MuJoCo-Warp on the first of these, by solver and integrator; the best is the peer of dimensions_N\n\
                  Rows of perception (views of nominal episodes of the tuning seeds; mean over the views, median of rounds of processor time):\n  \
                  perception.camera.192x144, .640x480     scene from the world, depth and labels\n  \
                  perception.camera.scene                 the scene alone\n  \
                  perception.camera.fruit_views.*         what the image shows of each fruit\n  \
                  perception.mask.192x144                 pixels of robot and ground\n  \
                  perception.detector.192x144             the detector, masks given\n\
                  MuJoCo needs python3 with venv and, the first time, the network or the wheels in tests/judge/wheels; without them the peer's columns are null.\n\
                  docs/performance.md tells how everything is measured. A missed target ends with exit code 1.\n\n\
                  Examples:\n  cargo xtask perf physics --json physics.json\n  cargo xtask perf trees --json trees.json"
)]
pub struct Args {
    /// What to measure
    suite: String,
    /// Where to write the rows
    #[arg(long, value_name = "FILE")]
    json: PathBuf,
    /// Few and short rounds: to see that everything works, not for figures (suites physics and perception)
    #[arg(long)]
    quick: bool,
}

const SUITES: &[Suite] = &[
    Suite {
        name: "trees",
        about: "trees grown a second of one core, and 512 randomised worlds built",
        measure: trees::measure,
    },
    Suite {
        name: "physics",
        about: "substeps of trees a second, beside MuJoCo's",
        measure: physics::measure,
    },
    Suite {
        name: "episode",
        about: "nominal episodes of every controller with picker and camera, one core",
        measure: episode::measure,
    },
    Suite {
        name: "gpu",
        about: "substeps of batches of trees on the graphics device",
        measure: gpu::measure,
    },
    Suite {
        name: "perception",
        about: "depth images of the wrist camera and the detector on them, one core",
        measure: perception::measure,
    },
];

pub fn run(args: &Args) -> Result<(), Failure> {
    let effort = if args.quick { Effort::Quick } else { Effort::Full };
    run_suite("perf", SUITES, &args.suite, &args.json, effort)
}

/// What is being done, and for how long.
fn spinner() -> ProgressBar {
    let bar = ProgressBar::new_spinner();
    if let Ok(style) = ProgressStyle::with_template("{spinner} {elapsed}  {msg}") {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}

/// Tells what is being done: beside the spinner, or in a line where there is no terminal.
fn say(bar: &ProgressBar, what: &str) {
    if bar.is_hidden() {
        eprintln!("{what}");
    } else {
        bar.set_message(what.to_owned());
    }
}
