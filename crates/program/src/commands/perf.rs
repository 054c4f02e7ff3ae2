//! `orchard perf`: speed on this machine, as a file of rows.

pub mod env;
#[cfg(feature = "gpu")]
mod env_gpu;
#[cfg(feature = "gpu")]
mod images;
#[cfg(feature = "gpu")]
mod pictures;

use std::path::PathBuf;

use crate::failure::Failure;
use crate::rows::{Effort, Suite, run_suite};

/// Measures the speed of the learning environments on this machine and writes the rows to a file.
#[derive(clap::Args)]
#[command(
    after_help = "Suites:\n  env      control steps of Harvest-v1 per second of one core, and memory of a world\n  \
                  env-gpu  control steps of Reach-v1 per second with worlds on a graphics device\n  \
                  images   depth images and colour pictures of many trees per second on a graphics device\n\n\
                  Rows of env (actions of 0.1 s drawn from their whole range; medians of rounds of processor time):\n  \
                  env.state          from state, camera off\n  \
                  env.depth          with a depth image in every step (camera paper at 10 Hz)\n  \
                  env.pixels         with the pictures of wrist and base camera, 128 x 128, in every step\n  \
                  env.memory         memory of one of many environments\n  \
                  env.binding        what Python takes on top of a native step, as a share of it; null without the package\n\n\
                  Rows of env-gpu, for 512 and 4,096 environments (N), each beside one of its resets:\n  \
                  env.gpu_N          from state, worlds on the device\n  \
                  env.gpu_pool_N     the same, in worlds that are kept for resets\n  \
                  env.gpu_depth_N    with a depth image of 128 x 128, drawn there, in every step, likewise\n  \
                  env.gpu_depth_stays_N  the same, with observations that stay on the device\n  \
                  env.gpu_pixels_stays_N  the same with two colour pictures of 64 x 64\n  \
                  env.cpu_depth_N, env.cpu_pixels_N  the same on the processor alone\n  \
                  .resetting         the same while one of 100 environments gets another tree in each step, and its share of the rate\n  \
                  env.gpu_N.step     parts of the mean step of all environments: .host.PART on the processor (wait: for the\n  \
                  device), .device.KERNEL on the device by its own clock, .rounds of submitted frames\n\n\
                  Rows of images, each on the device alone (.device) and with sending and reading:\n  \
                  images.depth_128 (.stays: sending alone, to images that stay there), images.labels_128, images.d435i_exact;\n  \
                  images.d435i with the camera's noise,\n  \
                  images.d435i_processor with the noise added on the processor; images.CAMERA.device: other cameras;\n  \
                  images.pixels_64: colour pictures as policies see them; images.colour_d435i: as detectors of colour do;\n  \
                  their _processor: drawn by all its cores\n\n\
                  A missed target gives exit code 1. Suites of other parts, for developers: cargo xtask perf.\n\n\
                  Example:\n  orchard perf env --json env.json"
)]
pub struct Args {
    /// Suite to measure: env, env-gpu or images
    suite: String,
    /// JSON file for the rows
    #[arg(long, value_name = "FILE")]
    json: PathBuf,
    /// Few and short rounds, only to check that everything works
    #[arg(long)]
    quick: bool,
}

/// The learning environments.
pub const ENV: Suite = Suite {
    name: "env",
    about: "control steps of the learning environments per second of one core",
    measure: env::measure,
};

/// Suites of the command.
const SUITES: &[Suite] = &[
    ENV,
    #[cfg(feature = "gpu")]
    Suite {
        name: "env-gpu",
        about: "control steps of the learning environments per second with worlds on a graphics device",
        measure: env_gpu::measure,
    },
    #[cfg(feature = "gpu")]
    Suite {
        name: "images",
        about: "depth images and colour pictures of many trees per second on a graphics device",
        measure: images::measure,
    },
];

pub fn run(args: &Args) -> Result<(), Failure> {
    let effort = if args.quick { Effort::Quick } else { Effort::Full };
    run_suite("perf", SUITES, &args.suite, &args.json, effort)
}
