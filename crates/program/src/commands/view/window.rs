//! The window of `orchard view`, and pictures of it.

use std::path::Path;

use orchard_bench::store::Store;
use orchard_view::window::{self, Offscreen, ViewError, Viewer};
use orchard_view::{Overlays, Setup, Stage};

use super::Args;
use crate::failure::Failure;
use crate::picture_file;
use crate::program::Program;

/// Frames of the world for each picture of a video.
const EVERY: u32 = 2;

/// Opens the window, or writes the pictures.
pub fn run(args: &Args, program: &Program) -> Result<(), Failure> {
    if let Some(file) = &args.screenshot {
        picture_file::check("--screenshot", file)?;
    }
    let overlays = args.overlays.as_deref().map(Overlays::parse).transpose();
    let overlays = overlays.map_err(|e| Failure::BadInput(format!("--overlays: {e}")))?.unwrap_or_default();
    let mut stage = match &args.recording {
        Some(file) => recorded(file, args, program)?,
        None => live(args, program)?,
    };
    // The folder stays locked while the window is open.
    let _lock = shelved(args, &mut stage)?;
    live_channels(args, &mut stage)?;
    if args.headless {
        return headless(&mut stage);
    }
    match (&args.screenshot, &args.video) {
        (Some(file), _) => screenshot(args, stage, overlays, file),
        (None, Some(folder)) => video(args, stage, overlays, folder),
        (None, None) if args.measure => pictures(args, stage, overlays, |_, _| Ok(())),
        (None, None) => window::open(stage, overlays, args.size, args.trees).map_err(refused),
    }
}

/// A live world of the given scenario.
fn live(args: &Args, program: &Program) -> Result<Stage, Failure> {
    let (index, scenario) = args.index.of(&args.scenario);
    // Tells what is to be known of robot, tree and controller, as all commands do.
    scenario.resolve(program)?;
    let options = scenario.options()?;
    let controllers = program.controllers().to_vec();
    let setup = Setup { options: Some(options), controllers, seed: args.seed, index };
    Stage::new(setup).map_err(Failure::BadInput)
}

/// The world of a recording, driven by the recorded commands.
#[cfg(feature = "recording")]
fn recorded(file: &Path, args: &Args, program: &Program) -> Result<Stage, Failure> {
    let recording = orchard_recording::Recording::open(file);
    let recording = recording.map_err(|e| Failure::BadInput(e.advised()))?;
    let config = orchard_recording::RecordingConfig::paper();
    let harvest = crate::commands::replay::harvest(&recording, &config, &args.scenario, program)?;
    let (options, controllers) = (args.scenario.options()?, program.controllers());
    orchard_view::recorded(&recording, &harvest, options, controllers).map_err(Failure::BadInput)
}

/// Lets a stage keep demonstrations, if a folder is given, which is locked until the guard is dropped.
#[cfg(feature = "demos")]
fn shelved(args: &Args, stage: &mut Stage) -> Result<Option<impl Sized + use<>>, Failure> {
    use crate::commands::demos::TaskName;
    use orchard_view::Shelf as _;
    let given = &args.demos;
    let Some(folder) = &given.demos else { return Ok(None) };
    let obs = given.obs.clone().unwrap_or_else(|| vec!["state".to_owned(), "depth".to_owned()]);
    let (size, hz) = (given.pixels_size.unwrap_or(128), given.control_hz.unwrap_or(10));
    let control = given.control.as_deref().unwrap_or("joint_delta");
    let name = given.task.as_deref().unwrap_or("harvest");
    let task = <TaskName as clap::ValueEnum>::from_str(name, false);
    let task =
        task.map_err(|_| Failure::BadInput(format!("--task {name}: the tasks are harvest, reach, gentle")))?;
    let settings = orchard_env::Settings::of(task.into());
    let settings = crate::commands::demos::observing(settings, &obs, size, hz, control, hz)?;
    let (store, lock) = crate::out_folder::open_folder("--demos", folder)?;
    let shelf = orchard_view::DemoFolder::new(store, settings);
    let seed = stage.dials().seed;
    let at = |e: String| Failure::BadInput(format!("--demos {}: {e}", folder.display()));
    // A folder of other demonstrations, or a seed that it cannot take, is told before anybody drives.
    shelf.start(stage.scenario(), seed).map_err(at)?;
    stage.keep_on(Box::new(shelf));
    Ok(Some(lock))
}

/// Serves the channels, if an address is given.
#[cfg(feature = "live")]
fn live_channels(args: &Args, stage: &mut Stage) -> Result<(), Failure> {
    let Some(super::Address { host, port }) = &args.live else { return Ok(()) };
    let server = orchard_recording::live::Live::open(host, *port);
    let server = server.map_err(|e| Failure::BadInput(format!("--live {e}")))?;
    say!("live: ws://{host}:{}", server.port());
    stage.show_to(Box::new(orchard_view::live::LiveAudience::new(server)));
    Ok(())
}

/// Runs without a window until Ctrl-C.
#[cfg(feature = "live")]
fn headless(stage: &mut Stage) -> Result<(), Failure> {
    orchard_view::live::run(stage, None, crate::interrupt::listen()?);
    Ok(())
}

/// Reports the missing build feature.
#[cfg(not(feature = "live"))]
fn live_channels(args: &Args, _: &mut Stage) -> Result<(), Failure> {
    let line = "--live: this program was built without the feature `live`; build it with `cargo install --path crates/orchard --features view,live`";
    args.live.as_ref().map_or(Ok(()), |address| {
        Err(Failure::BadInput(format!("{line} (for {}:{})", address.host, address.port)))
    })
}

/// Nothing is served without a window either.
#[cfg(not(feature = "live"))]
fn headless(_: &mut Stage) -> Result<(), Failure> {
    Ok(())
}

/// Reports the missing build feature.
#[cfg(not(feature = "demos"))]
fn shelved(args: &Args, _: &mut Stage) -> Result<Option<()>, Failure> {
    match &args.demos.demos {
        None => Ok(None),
        Some(_) => {
            let line = "--demos: this program was built without the feature `demos`; build it with the default features";
            Err(Failure::BadInput(line.to_owned()))
        }
    }
}

/// Reports the missing build feature.
#[cfg(not(feature = "recording"))]
fn recorded(_: &Path, _: &Args, _: &Program) -> Result<Stage, Failure> {
    let line = "--recording: this program was built without the feature `recording`; build it with the default features";
    Err(Failure::BadInput(line.to_owned()))
}

fn screenshot(args: &Args, stage: Stage, overlays: Overlays, file: &Path) -> Result<(), Failure> {
    let mut screen = Offscreen::new(args.size).map_err(refused)?;
    let mut viewer = viewer(args, stage, overlays, &screen)?;
    viewer.smooth(screen.state());
    let every = args.frames.max(1);
    window::video(&mut screen, &mut viewer, args.frames, every, |_, screen| {
        window::write_png(file, &screen.picture()?)
    })
    .map(drop)
    .map_err(refused)
}

fn video(args: &Args, stage: Stage, overlays: Overlays, folder: &Path) -> Result<(), Failure> {
    let folder = Store::open(folder).map_err(|e| Failure::of_file(&e))?;
    pictures(args, stage, overlays, |number, screen| {
        let file = folder.path().join(format!("frame-{number:06}.png"));
        window::write_png_fast(&file, &screen.picture()?)
    })
}

fn viewer(args: &Args, stage: Stage, overlays: Overlays, screen: &Offscreen) -> Result<Viewer, Failure> {
    let mut viewer = Viewer::new(stage, overlays, screen.state());
    viewer.show_trees(args.trees).map_err(|e| Failure::BadInput(format!("--trees {}: {e}", args.trees)))?;
    Ok(viewer)
}

/// Draws pictures, 30 a second of the world's time, gives each to `take`, and tells their costs.
fn pictures(
    args: &Args,
    stage: Stage,
    overlays: Overlays,
    take: impl FnMut(u32, &Offscreen) -> Result<(), ViewError>,
) -> Result<(), Failure> {
    let mut screen = Offscreen::new(args.size).map_err(refused)?;
    say!("device: {}", screen.device());
    let mut viewer = viewer(args, stage, overlays, &screen)?;
    let tally = window::video(&mut screen, &mut viewer, args.frames, EVERY, take);
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
