//! `orchard view`: a scenario live in a window, or pictures of it.

use std::path::{Path, PathBuf};

use orchard_bench::store::Store;
use orchard_view::window::{self, Offscreen, ViewError, Viewer};
use orchard_view::{Overlays, Setup, Stage};

use crate::args::{IndexArgs, ScenarioArgs};
use crate::failure::Failure;
use crate::picture_file;
use crate::program::Program;

/// Shows a scenario live in a window, or draws pictures of it.
#[derive(clap::Args)]
#[command(
    after_help = "In the window: drag a branch, a fruit or the robot to pull it; drag beside them to turn the view, with the right button or Shift to move\n\
                  it; the wheel zooms. Space pauses, `.` steps a frame, R starts again, N takes the next seed, T takes the robot over (W A S D Q E drive,\n\
                  I J K L U O move the hand, with Shift they turn it, C closes it), F follows, 1 to 9 and 0 switch overlays, P writes a picture. The button\n\
                  Keys lists all of them.\n\n\
                  --screenshot and --video need a graphics driver but no screen: Vulkan, Metal or DirectX 12; on Debian the package\n\
                  mesa-vulkan-drivers draws without a graphics card.\n\n\
                  Examples:\n  orchard view --controller expert\n  orchard view --preset v-trellis --camera d435i --overlays leaves,depth,detections\n  \
                  orchard view --controller expert --frames 600 --overlays all --screenshot view.png\n  \
                  orchard view --recording results/bench-v1-quick-nominal/recordings/baseline-nominal-20250704-000.mcap\n  orchard view --controller expert --frames 1800 --video frames   # then, for example: ffmpeg -r 30 -i frames/frame-%06d.png view.mp4"
)]
pub struct Args {
    /// Seed of the population
    #[arg(long, default_value_t = 20250704, value_name = "S")]
    seed: u64,
    #[command(flatten)]
    index: IndexArgs,
    #[command(flatten)]
    scenario: ScenarioArgs,
    /// Overlays that are on at first, with commas between: leaves, depth, colour, detections, plan, contacts, moments, reach, frames, plots; all; none
    /// [default: leaves,depth,plan,plots]
    #[arg(long, value_name = "NAMES", value_parser = Overlays::parse)]
    overlays: Option<Overlays>,
    /// Width and height of the window or the pictures [px]
    #[arg(long, default_value = "1280x720", value_name = "WxH", value_parser = size)]
    size: [u32; 2],
    /// Recording (.mcap) of an episode to show instead of a live world, from the folder `recordings` of a result
    #[arg(long, value_name = "FILE.mcap", conflicts_with_all = ["seed", "index"])]
    recording: Option<PathBuf>,
    /// Draw one picture after --frames frames into a PNG file instead of opening a window
    #[arg(long, value_name = "FILE.png", conflicts_with = "video")]
    screenshot: Option<PathBuf>,
    /// Draw a picture every second frame of the world, 30 a second, into a folder instead of opening a window
    #[arg(long, value_name = "DIR")]
    video: Option<PathBuf>,
    /// Frames of the world for --screenshot and --video, 60 a second
    #[arg(long, default_value_t = 60, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=36_000))]
    frames: u32,
}

/// Smallest and largest side of a window or a picture \[px\].
const SIDES: [u32; 2] = [200, 8192];

/// Frames of the world for each picture of a video.
const EVERY: u32 = 2;

fn size(text: &str) -> Result<[u32; 2], String> {
    let [least, most] = SIDES;
    let side = |part: &str| part.parse().ok().filter(|side| (least..=most).contains(side));
    let sides = text.split_once('x').and_then(|(width, height)| Some([side(width)?, side(height)?]));
    sides.ok_or_else(|| format!("must be WIDTHxHEIGHT, as in 1280x720, each side in [{least}, {most}]"))
}

/// Opens the window, or writes the pictures.
pub fn run(args: &Args, program: &Program) -> Result<(), Failure> {
    if let Some(file) = &args.screenshot {
        picture_file::check("--screenshot", file)?;
    }
    let stage = match &args.recording {
        Some(file) => recorded(file, args, program)?,
        None => live(args, program)?,
    };
    let overlays = args.overlays.clone().unwrap_or_default();
    match (&args.screenshot, &args.video) {
        (Some(file), _) => screenshot(args, stage, overlays, file),
        (None, Some(folder)) => video(args, stage, overlays, folder),
        (None, None) => window::open(stage, overlays, args.size).map_err(refused),
    }
}

/// A live world of the given scenario.
fn live(args: &Args, program: &Program) -> Result<Stage, Failure> {
    let (index, scenario) = args.index.of(&args.scenario);
    // Tells what is to be known of robot, tree and controller, as all commands do.
    scenario.resolve(program)?;
    let options = scenario.options()?;
    let controllers = program.controllers().to_vec();
    Stage::new(Setup { options, controllers, seed: args.seed, index }).map_err(Failure::BadInput)
}

/// The world of a recording, driven by the recorded commands.
#[cfg(feature = "recording")]
fn recorded(file: &Path, args: &Args, program: &Program) -> Result<Stage, Failure> {
    let bad = |e: &dyn std::fmt::Display| Failure::BadInput(e.to_string());
    let recording = orchard_recording::Recording::open(file).map_err(|e| bad(&e))?;
    let config = orchard_recording::RecordingConfig::paper();
    let harvest = super::replay::harvest(&recording, &config, &args.scenario, program)?;
    let commands = recording.commands().map_err(|e| bad(&e))?;
    let key = &recording.header().key;
    let at = |e: &dyn std::fmt::Display| Failure::BadInput(format!("{}: {e}", file.display()));
    let scenario = harvest.scenario_of(&key.condition).map_err(|e| at(&e))?;
    let world = scenario.world(key.seed, key.world, key.repeat).map_err(|e| at(&e))?;
    let options = orchard_scenario::Options::of_names(scenario.names()).map_err(|e| at(&e))?;
    let controllers = program.controllers().to_vec();
    let setup = Setup { options, controllers, seed: key.seed, index: key.world };
    Ok(Stage::of_recording(setup, scenario, world, commands))
}

/// Reports the missing build feature.
#[cfg(not(feature = "recording"))]
fn recorded(_: &Path, _: &Args, _: &Program) -> Result<Stage, Failure> {
    let line = "--recording: this program was built without the feature `recording`; build it with the default features";
    Err(Failure::BadInput(line.to_owned()))
}

fn screenshot(args: &Args, stage: Stage, overlays: Overlays, file: &Path) -> Result<(), Failure> {
    let mut screen = Offscreen::new(args.size).map_err(refused)?;
    let mut viewer = Viewer::new(stage, overlays, screen.state());
    let every = args.frames.max(1);
    window::video(&mut screen, &mut viewer, args.frames, every, |_, screen| {
        window::write_png(file, &screen.picture()?)
    })
    .map(drop)
    .map_err(refused)
}

fn video(args: &Args, stage: Stage, overlays: Overlays, folder: &Path) -> Result<(), Failure> {
    let mut screen = Offscreen::new(args.size).map_err(refused)?;
    let folder = Store::open(folder).map_err(|e| Failure::of_file(&e))?;
    let mut viewer = Viewer::new(stage, overlays, screen.state());
    let tally = window::video(&mut screen, &mut viewer, args.frames, EVERY, |number, screen| {
        let file = folder.path().join(format!("frame-{number:06}.png"));
        window::write_png(&file, &screen.picture()?)
    });
    say!("{}", tally.map_err(refused)?.line());
    Ok(())
}

fn refused(e: ViewError) -> Failure {
    match e {
        ViewError::File(e) => Failure::of_file(&e),
        ViewError::Device(_) => Failure::Failed(e.to_string()),
        ViewError::NoAdapter(_) | ViewError::NoScreen | ViewError::Refused(_) => {
            Failure::BadInput(format!("view: {e}"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_and_wrong_ones_told_the_range() {
        assert_eq!(size("1280x720"), Ok([1280, 720]));
        for bad in ["", "1280", "1280x", "x720", "1280X720", "10x720", "1280x99999", "1280x-720"] {
            assert!(size(bad).is_err_and(|line| line.contains("[200, 8192]")), "{bad}");
        }
    }
}
