//! `orchard replay`: simulates a recorded episode again and compares it with its recording.

use std::path::{Path, PathBuf};

use indicatif::{ProgressBar, ProgressStyle};
use orchard_bench::{CODE_VERSION, SCHEMA_VERSION};
use orchard_recording::channel::Origin;
use orchard_recording::file::Header;
use orchard_recording::replay::{ReplayError, Replayed, replay};
use orchard_recording::{Channel, Recording, RecordingConfig};
use orchard_tasks::harvest::Harvest;

use crate::args::ScenarioArgs;
use crate::failure::Failure;
use crate::interrupt;
use crate::program::Program;

/// Simulates a recorded episode again and checks that all bytes agree.
#[derive(clap::Args)]
#[command(
    after_help = "The world is built from the recording's seed and driven by the recorded commands. Its poses, images, joints, events and\n\
                  state hashes are written again and compared byte by byte. The controller runs beside it on the observations of this\n\
                  world; its commands and its log are compared too, but its commands are not executed.\n\n\
                  Recordings are made by bench-v1 --record. They can only be replayed by the code version and configs that wrote them.\n\
                  Exit code 1: something differs; the first difference is printed. Exit code 2: not a recording, a damaged one, or one\n\
                  of another code version.\n\n\
                  Example:\n  orchard bench-v1 --conditions nominal --trees 1 --record\n  \
                  orchard replay results/bench-v1-quick-nominal/recordings/baseline-nominal-20250704-000.mcap"
)]
pub struct Args {
    /// Recording (.mcap), from the folder `recordings` of a result
    #[arg(value_name = "FILE.mcap")]
    file: PathBuf,
    #[command(flatten)]
    scenario: ScenarioArgs,
}

pub fn run(args: &Args, program: &Program) -> Result<(), Failure> {
    let bad = |e: &dyn std::fmt::Display| Failure::BadInput(e.to_string());
    let recording = Recording::open(&args.file).map_err(|e| Failure::BadInput(e.advised()))?;
    let config = RecordingConfig::paper();
    let harvest = harvest(&recording, &config, &args.scenario, program)?;
    let stop = interrupt::listen()?;
    let record_frames = recording.counts().get(&Channel::Command).copied().unwrap_or(0);
    let bar = ProgressBar::new(record_frames).with_style(
        ProgressStyle::with_template("{bar:30} {percent:>3} %  second run (about {eta} left)")
            .unwrap_or_else(|_| ProgressStyle::default_bar()),
    );
    let (protocol, frame) = (harvest.protocol(), harvest.frame());
    let replayed = replay(&recording, &harvest, protocol, frame, &config, stop, &mut || bar.inc(1));
    bar.finish_and_clear();
    let replayed = replayed.map_err(|e| match e {
        ReplayError::Recording(e) => bad(&e),
        ReplayError::Interrupted => Failure::Interrupted(e.to_string()),
        ReplayError::NoWorld(_) => Failure::Failed(e.to_string()),
    })?;
    report(&args.file, &replayed)
}

/// The worlds and the controller of a recording of this code version. The recording holds its scenario; given options must resolve to
/// the same one.
pub fn harvest(
    recording: &Recording,
    config: &RecordingConfig,
    scenario: &ScenarioArgs,
    program: &Program,
) -> Result<Harvest, Failure> {
    let there = recording.header();
    let mut here = Header::new(&there.key, config.hash(), there.scenario.clone());
    here.key.code_version = CODE_VERSION.to_owned();
    here.key.schema_version = SCHEMA_VERSION;
    // The code version is checked first: another version may have other controllers.
    let check = |here: &Header| recording.check(here).map_err(|e| Failure::BadInput(e.advised()));
    check(&here)?;
    let by = recording.path().display().to_string();
    let harvest = Harvest::new(scenario.resolve_stored(program, || Ok(there.scenario.clone()), &by)?)?;
    here.key.config_hash = harvest.config_hash();
    check(&here)?;
    Ok(harvest)
}

fn report(file: &Path, replayed: &Replayed) -> Result<(), Failure> {
    say!("{}: {} frames simulated again", file.display(), replayed.frames);
    say!("{:<22} {:>8} {:>8} {:>8} {:>8}", "channel", "agreed", "differ", "missing", "surplus");
    for (channel, tally) in &replayed.tallies {
        let topic = channel.topic();
        say!(
            "{topic:<22} {:>8} {:>8} {:>8} {:>8}",
            tally.agreed,
            tally.differing,
            tally.missing,
            tally.surplus
        );
    }
    let mut problems = Vec::new();
    for (origin, name) in [(Origin::World, "world"), (Origin::Controller, "controller")] {
        match replayed.differences.get(&origin) {
            None => say!("{name}: agrees in every byte"),
            Some(first) => {
                say!("{name}: DIFFERS, first in {first}");
                problems.push(format!("the {name}'s first difference: {first}"));
            }
        }
    }
    if !replayed.record_agrees {
        say!("record: DIFFERS from the attached record");
        problems.push("the episode's record differs from the attached record".to_owned());
    }
    match replayed.file_agrees {
        true => say!("file: the replay has the same bytes"),
        false if problems.is_empty() => {
            problems.push("all messages agree, but other bytes of the file differ".to_owned());
        }
        false => {}
    }
    if problems.is_empty() {
        return Ok(());
    }
    Err(Failure::Failed(format!("{}: {}", file.display(), problems.join("; "))))
}
