//! `orchard bench-field`: the benchmark in the field.

use super::bench_v1::{Benchmark, RunArgs, run_benchmark};
use crate::failure::Failure;
use crate::program::Program;

/// Name of the protocol.
pub const PROTOCOL: &str = "field";

const BENCHMARK: Benchmark = Benchmark { command: "bench-field", protocol: Some(PROTOCOL) };

/// Runs the harvest in the field: kinds of trees, cameras, robots, wind, slope, slippery fruit, wheels that slip, noise, delays.
#[derive(clap::Args)]
#[command(
    after_help = "The harvest of bench-v1 under the conditions of configs/bench/field.toml, with the same files, options and statistics\n\
(docs/benchmark-field.md). Groups and sweeps for --conditions:\n  \
populations  randomised, calibrated, calibrated-mature, tall-spindle, v-trellis, vertical-ufo\n  \
cameras      d435i, azure-kinect; sunlight: 0, 0.3, d435i (0.6), 1\n  \
robots       fr3-fixed, husky-ur5e-2f85, rail-xarm6-suction\n  \
crop         clusters; friction of the fruit: 0.3, 0.5, nominal (1)\n  \
light        clear-day, overcast-day, low-sun in colour; only by name\n  \
wind         3, 6, 9 m/s\n  \
slope        5, 10 deg; terrain, foliage and fruit as in bench-v1\n  \
odometry     slip of 0.01, 0.05, 0.1, with drift; joint-noise: 0.1, 0.5 deg\n  \
camera-delay 0.1, 0.3 s; command-delay: 0.05, 0.1 s\n  \
exhaustion   until nothing reachable is left, 1800 s at most; exhaustions: the same of each population; only by name\n\n\
--backend gpu moves the worlds on a graphics device, in f32; worlds that it cannot step are\n\
computed in f64, and a line tells why.\n\n\
Examples:\n  orchard bench-field --controller expert\n  \
orchard bench-field --profile full --controller expert --seeds field-v1      an official score\n  \
orchard bench-field --conditions wind,calibrated --seeds 1,2 --trees 4 --out results/mine\n  \
orchard bench-field --conditions populations,wind --seeds 5 --trees 20 --backend gpu\n  \
orchard bench-field --profile full --shard 3/8 --out parts/3                 one part of eight, then orchard merge"
)]
pub struct Args {
    #[command(flatten)]
    run: RunArgs,
}

pub fn run(args: &Args, program: &Program) -> Result<(), Failure> {
    run_benchmark(&args.run.clone().of_harvest(), BENCHMARK, program)
}
