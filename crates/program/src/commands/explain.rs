//! `orchard explain`: a description of an episode of the benchmark, and a strip of pictures for each attempt.

pub mod input;
mod marks;
pub mod replay;
mod story;
pub mod strip;
mod touch;

use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};

use indicatif::{ProgressBar, ProgressStyle};
use orchard_bench::store::Store;
use orchard_tasks::harvest::episode::{AttemptOutcome, AttemptRecord, EpisodeRecord};
use rayon::prelude::*;

use crate::args::ScenarioArgs;
use crate::failure::Failure;
use crate::out_folder::open_folder;
use crate::picture_file;
use crate::program::Program;

/// Describes an episode of the benchmark in words and draws every attempt.
#[derive(clap::Args)]
#[command(
    after_help = "The episode is simulated again with the seed, tree and controller of its record. The description is made from the record;\n\
                  the causes of snapped branches and fallen fruit come from the contacts of the second run, which must agree with\n\
                  the record.\n\n\
                  A strip shows the moments of an attempt from left to right: state changes, and events of fruit and wood. Above: the\n\
                  view from outside, without leaves in the foreground; below: the view of the wrist camera. Green circle: the true\n\
                  fruit. Orange circles: fruit knocked off and branches snapped. Cross: the target as the controller believes it.\n\
                  Dots: the detections of the last image.\n\n\
                  The scenario is read from the plan.json of the result folder; without one, give the scenario's options.\n\
                  A record can only be explained by the code version that wrote it: after a change of the code run bench-v1 again.\n\
                  Exit code 1: the second run differs from the record. Exit code 2: not a record of an episode, a record of\n\
                  another code version, one that does not match its checksum, or one whose command log was edited.\n\n\
                  Examples:\n  orchard explain results/bench-v1-quick/episodes/baseline-nominal-20250704-000.json\n  \
                  orchard explain EPISODE.json --failed --out strips\n  orchard explain EPISODE.json --attempt 3"
)]
pub struct Args {
    /// Record of the episode, from the folder `episodes` of a result
    #[arg(value_name = "EPISODE.json")]
    episode: PathBuf,
    /// Only this attempt
    #[arg(long, value_name = "N", conflicts_with = "failed")]
    attempt: Option<u32>,
    /// Only failed attempts
    #[arg(long)]
    failed: bool,
    /// Folder for the strips [default: that of the record, under the record's name]
    #[arg(long, value_name = "DIR", conflicts_with = "text")]
    out: Option<PathBuf>,
    /// Text only, no strips
    #[arg(long)]
    text: bool,
    #[command(flatten)]
    scenario: ScenarioArgs,
}

pub fn run(args: &Args, program: &Program) -> Result<(), Failure> {
    let input = input::read(&args.episode, &args.scenario, program)?;
    let record = &input.record;
    let chosen = chosen(args, record).map_err(Failure::BadInput)?;
    let out = args.out.clone().unwrap_or_else(|| args.episode.with_extension(""));
    let folder = if args.text { None } else { Some(open_folder("--out", &out)?) };
    let moments: Vec<Vec<strip::Moment>> =
        if args.text { Vec::new() } else { chosen.iter().map(|a| strip::moments(record, a)).collect() };
    let mut frames: Vec<u32> = moments.iter().flatten().map(|moment| moment.frame).collect();
    frames.sort_unstable();
    frames.dedup();

    let replay = replay::replay(&input, &frames)?;
    say!("{}", story::head(record));
    for attempt in &chosen {
        say!("\n{}", story::attempt(record, attempt, &replay.causes).trim_end());
    }
    say!("\n{}", story::contact_attempts(record).trim_end());
    say!("\n{}", story::tail(record, &replay.causes).trim_end());
    let difference = replay::difference(record, &replay.record);
    match &difference {
        None => say!("the second run agrees with the record in every event and figure"),
        Some(difference) => say!("THE SECOND RUN DIFFERS FROM THE RECORD: {difference}"),
    }
    if let Some((folder, _lock)) = &folder {
        draw(record, &chosen, &moments, &replay, folder)?;
        say!("strips: {}", out.display());
    }
    difference.map_or(Ok(()), |difference| {
        Err(Failure::Failed(format!("the second run differs from the record: {difference}")))
    })
}

/// Attempts selected on the command line.
fn chosen<'a>(args: &Args, record: &'a EpisodeRecord) -> Result<Vec<&'a AttemptRecord>, String> {
    let attempts = &record.attempts;
    let Some(id) = args.attempt else {
        let wanted = |a: &&AttemptRecord| !args.failed || a.outcome == AttemptOutcome::Failed;
        return Ok(attempts.iter().filter(wanted).collect());
    };
    match attempts.get(id as usize) {
        Some(attempt) => Ok(vec![attempt]),
        None if attempts.is_empty() => Err(format!("--attempt {id}: the episode has no attempts")),
        None => Err(format!("--attempt {id}: the allowed range is [0, {}]", attempts.len() - 1)),
    }
}

/// Draws the strips in parallel.
fn draw(
    record: &EpisodeRecord,
    chosen: &[&AttemptRecord],
    moments: &[Vec<strip::Moment>],
    replay: &replay::Replay,
    folder: &Store,
) -> Result<(), Failure> {
    let bar = ProgressBar::new(chosen.len() as u64).with_style(
        ProgressStyle::with_template("{bar:30} {pos}/{len} strips")
            .unwrap_or_else(|_| ProgressStyle::default_bar()),
    );
    let drawn = AtomicU64::new(0);
    let strips: Vec<(&AttemptRecord, &Vec<strip::Moment>)> = chosen.iter().copied().zip(moments).collect();
    strips.par_iter().try_for_each(|(attempt, moments)| {
        let sheet = strip::draw(record, attempt, moments, &replay.shots);
        let end = attempt.failure_reason.as_deref().unwrap_or("placed");
        let written = picture_file::write_in(folder, &format!("attempt-{:03}-{end}.png", attempt.id), &sheet);
        bar.set_position(drawn.fetch_add(1, Ordering::Relaxed) + 1);
        written
    })?;
    bar.finish_and_clear();
    Ok(())
}

#[cfg(test)]
#[path = "explain/tests.rs"]
mod tests;
