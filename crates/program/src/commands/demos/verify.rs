//! `orchard demos verify`: demonstrations read back and simulated again.

use std::path::PathBuf;

use indicatif::{ProgressBar, ProgressStyle};
use orchard_demos::{Meta, VerifyError};
use orchard_tasks::plan_file::Backend;

use crate::commands::bench_v1::default_threads;
use crate::failure::Failure;
use crate::interrupt;
use crate::program::Program;

/// Reads demonstrations back and simulates every episode again: all bytes must agree.
#[derive(clap::Args)]
#[command(
    after_help = "Every episode is simulated under its stored commands, or by its stored actions where these moved the robot (--policy-actions).\n\
Observations, images, rewards, ends and the last state must come out with the same bytes. Episodes of --backend gpu are only read back,\n\
whole files against their hashes: no processor has the bits of a device. Only the code version that wrote them can do this.\n\
Exit code 1: something differs; exit code 2: not a folder of demonstrations, or one of another code version."
)]
pub struct Args {
    /// Folder that `orchard demos` wrote
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Threads [default: as many as the machine has]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    threads: Option<u32>,
}

pub fn run(args: &Args, program: &Program) -> Result<(), Failure> {
    let bad = |e: &dyn std::fmt::Display| Failure::BadInput(e.to_string());
    let Meta { episodes, backend, .. } = Meta::read(&args.folder).map_err(|e| bad(&e))?;
    let stop = interrupt::listen()?;
    let threads = args.threads.map_or_else(default_threads, |threads| threads as usize);
    let bar = ProgressBar::new(u64::from(episodes)).with_style(
        ProgressStyle::with_template("{bar:30} {pos}/{len} episodes  {elapsed} (about {eta} left)")
            .unwrap_or_else(|_| ProgressStyle::default_bar()),
    );
    let verdict = orchard_demos::verify(&args.folder, program.controllers(), threads, stop, &|| bar.inc(1));
    bar.finish_and_clear();
    let verdict = verdict.map_err(|e| match e {
        VerifyError::Meta(_) => bad(&e),
        VerifyError::Interrupted => Failure::Interrupted(e.to_string()),
        VerifyError::Store(_) | VerifyError::Threads(_) => Failure::Failed(e.to_string()),
    })?;
    for problem in &verdict.problems {
        note!("{problem}");
    }
    match verdict.problems.len() {
        0 if backend != Backend::Cpu => {
            say!(
                "{} episodes read back; they moved on a graphics device, whose bits no processor has, so they were not simulated again",
                verdict.episodes
            );
            Ok(())
        }
        0 => {
            say!("{} episodes read back and simulated again: the same bytes", verdict.episodes);
            Ok(())
        }
        n => Err(Failure::Failed(format!("{n} of {} episodes differ", verdict.episodes))),
    }
}
