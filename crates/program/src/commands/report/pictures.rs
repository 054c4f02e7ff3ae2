//! Pictures of a run: some trees, and one attempt that placed its fruit.

use std::path::Path;

use anyhow::Context;
use orchard_bench::CODE_VERSION;
use orchard_bench::store::Store;
use orchard_geometry::Image;
use orchard_report::{Moment, Pick, Picture, Pictures, Results, main_condition};
use orchard_scenario::Scenario;
use orchard_tasks::harvest::Harvest;
use orchard_tasks::harvest::episode::{AttemptOutcome, AttemptRecord};
use orchard_tasks::harvest::summary::ConditionSummary;
use orchard_tasks::plan_file::PlanFile;
use orchard_world::Planting;

use crate::args::ScenarioArgs;
use crate::commands::explain::input::{self, Input};
use crate::commands::explain::{replay, strip};
use crate::commands::gallery::portraits;
use crate::failure::Failure;
use crate::picture_file::png;
use crate::program::Program;

/// Number of trees that are shown.
const TREES: usize = 3;
/// Width and height of a tree's picture \[px\].
const TREE: [usize; 2] = [360, 450];
/// Width and height of a view of a moment \[px\]: smaller than in `orchard explain`, to keep the page small.
const VIEW: [usize; 2] = [300, 225];

/// Draws the pictures; none if another code version made the results.
pub fn draw(dir: &Path, results: &Results, program: &Program) -> Result<Pictures, Failure> {
    let left_out = |reason: &str| Pictures { left_out: Some(reason.to_owned()), ..Pictures::default() };
    let Some(harvest) = &results.harvest else {
        return Ok(left_out("Pictures need a harvest, and this folder has none."));
    };
    if harvest.code_version != CODE_VERSION {
        return Ok(left_out(&format!(
            "Pictures were left out: the run was made by code version {}, but this is {CODE_VERSION}, whose results may differ.",
            harvest.code_version
        )));
    }
    let Some((name, main)) = main_condition(harvest) else {
        return Ok(left_out("Pictures need episode records, and this folder has none."));
    };
    let stored = Store::open(dir)
        .map_err(|e| e.to_string())
        .and_then(|store| PlanFile::scenario_of(&store, "harvest").map_err(|e| e.to_string()));
    let scenario = stored.and_then(|stored| {
        Scenario::from_stored(&stored, program.controllers(), PlanFile::FILE).map_err(|e| e.to_string())
    });
    let scenario = match scenario {
        Ok(scenario) => scenario,
        Err(reason) => return Ok(left_out(&format!("Pictures were left out: {reason}."))),
    };
    let trees = trees(main, &Harvest::new(scenario)?.scenario_of(name)?)?;
    let (pick, left_out) = match placed(dir, main, program) {
        Ok(Some((input, attempt))) => (Some(pick(&input, &attempt)?), None),
        Ok(None) => (None, Some("No attempt of this run placed its fruit, so none is shown.".to_owned())),
        Err(reason) => (None, Some(format!("The pictures of an attempt were left out: {reason}."))),
    };
    Ok(Pictures { trees, pick, left_out })
}

/// The first trees of the run, as the gallery draws them.
fn trees(main: &ConditionSummary, scenario: &Scenario) -> Result<Vec<Picture>, Failure> {
    let mut worlds: Vec<(u64, u32)> = main.episodes.iter().map(|e| (e.seed, e.world)).collect();
    worlds.dedup();
    worlds.truncate(TREES);
    let plant = |(seed, world): &(u64, u32)| scenario.planting(*seed, *world);
    let plantings: Result<Vec<Planting>, _> = worlds.iter().map(plant).collect();
    let images = portraits(&plantings.context("cannot grow the trees")?, TREE, || ());
    let picture = |(image, (seed, world)): (&Image<[u8; 3]>, &(u64, u32))| {
        let alt = format!("Apple tree {world} of seed {seed} with its leaves and fruit at the start");
        picture(image, alt, format!("Seed {seed}, tree {world}"))
    };
    images.iter().zip(&worlds).map(picture).collect()
}

/// The first attempt that placed its fruit, with the record of its episode.
fn placed(
    dir: &Path,
    main: &ConditionSummary,
    program: &Program,
) -> Result<Option<(Input, AttemptRecord)>, String> {
    for line in main.episodes.iter().filter(|line| line.deposited > 0) {
        let input = input::read(&dir.join(&line.file), &ScenarioArgs::default(), program)
            .map_err(|e| e.to_string())?;
        let is_placed = |attempt: &&AttemptRecord| attempt.outcome == AttemptOutcome::Placed;
        let Some(attempt) = input.record.attempts.iter().find(is_placed).cloned() else { continue };
        return Ok(Some((input, attempt)));
    }
    Ok(None)
}

/// The attempt, moment by moment, from a second run of its episode.
fn pick(input: &Input, attempt: &AttemptRecord) -> Result<Pick, Failure> {
    let record = &input.record;
    let moments = strip::moments(record, attempt);
    let mut frames: Vec<u32> = moments.iter().map(|moment| moment.frame).collect();
    frames.dedup();
    let replay = replay::replay(input, &frames)?;
    let panels = strip::panels(record, attempt, &moments, &replay.shots, VIEW);
    let moment = |panel: &strip::Panel| {
        let alt = |view: &str| format!("{}, {view}", panel.caption);
        Ok(Moment {
            caption: panel.caption.clone(),
            detail: panel.distances.clone(),
            outside: picture(&panel.outside, alt("seen from outside"), String::new())?,
            wrist: picture(&panel.wrist, alt("seen by the wrist camera"), String::new())?,
        })
    };
    let moments: Result<Vec<Moment>, Failure> = panels.iter().map(moment).collect();
    Ok(Pick { title: format!("One attempt: {}", strip::title(record, attempt)), moments: moments? })
}

fn picture(image: &Image<[u8; 3]>, alt: String, caption: String) -> Result<Picture, Failure> {
    let png = png(image).context("cannot encode a picture")?;
    Ok(Picture { png, size: [image.width() as u32, image.height() as u32], alt, caption })
}
