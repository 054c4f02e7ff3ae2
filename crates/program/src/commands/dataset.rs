//! `orchard dataset`: images of trees with ground truth.

mod sheet;

use std::path::{Path, PathBuf};

use indicatif::{ProgressBar, ProgressStyle};
use orchard_dataset::{DatasetConfig, DatasetError, Done, Folder, Plan, Seeds};
use orchard_exchange::intrinsics;
use orchard_geometry::Intrinsics;
use orchard_quantity::Quantity;
use orchard_spec::light::LightSpec;

use crate::args::{Part, ScenarioArgs};
use crate::failure::Failure;
use crate::interrupt;
use crate::program::Program;

/// Draws trees from all sides: colour, depth, labels, instances, fruit annotations and camera poses.
#[derive(clap::Args)]
#[command(
    after_help = "Files (all are listed in docs/dataset.md):\n  DIR/color, depth, label, instance   PNG images, one per view; depth in millimetres\n  \
DIR/annotations.json                fruit in COCO format, with visible fractions\n  \
DIR/cameras.json                    intrinsics, and the pose of each view\n  \
DIR/manifest.json                   all settings, classes, all files with SHA-256; written last\n  \
DIR/contact_sheet.png               overview of some views\n\
The same command gives the same bytes, for any number of threads.\n\
Ctrl-C and SIGTERM leave only complete files; the same command continues from there.\n\
The light changes only the colour images; it is not a photometric model.\n\n\
Examples:\n  orchard dataset --seeds 1..126 --views 8 --out data/apples\n  \
orchard dataset --seeds 1..11 --preset randomised --sun-elevation 15 --out data/evening\n  \
orchard dataset --seeds 1..11 --camera d435i --overcast 1 --out data/grey\n  \
orchard dataset --seeds 1..11 --intrinsics camera.json --out data/mine"
)]
pub struct Args {
    /// Seeds from A to B, B not included; one tree per seed unless --trees is given
    #[arg(long, value_name = "A..B", allow_negative_numbers = true, value_parser = seeds)]
    seeds: Seeds,
    /// Trees per seed
    #[arg(long, value_name = "N", default_value_t = 1, allow_negative_numbers = true, value_parser = count)]
    trees: u32,
    /// Views per tree, at even bearings around it
    #[arg(long, value_name = "N", default_value_t = 8, allow_negative_numbers = true, value_parser = count)]
    views: u32,
    /// Folder for the files: new, or left unfinished by the same command
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    scenario: ScenarioArgs,
    /// Intrinsics that replace the camera's: JSON with width, height, fx, fy, cx, cy, or as RealSense and ROS write them
    #[arg(long, value_name = "FILE.json")]
    intrinsics: Option<PathBuf>,
    /// Azimuth of the sun from the world's x axis, counter-clockwise seen from above, -360 to 360 degrees [default: 228]
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    sun_azimuth: Option<f64>,
    /// Elevation of the sun above the horizon, 0 to 90 degrees; a low sun is redder [default: 48]
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    sun_elevation: Option<f64>,
    /// Strength of the sun relative to the sky, 0 to 4 [default: 1]
    #[arg(long, value_name = "FACTOR", allow_negative_numbers = true)]
    sun_strength: Option<f64>,
    /// Cloud cover, 0 to 1; at 1 there are no cast shadows [default: 0]
    #[arg(long, value_name = "PART", allow_negative_numbers = true)]
    overcast: Option<f64>,
    /// Unit of the depth images in millimetres; depths above 65535 units are written as 0 [default: 1]
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    depth_unit: Option<f64>,
    /// Samples per pixel side of the colour images, 1 to 8 (N x N samples per pixel) [default: 2]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = count)]
    supersampling: Option<u32>,
    /// Threads [default: as many as the machine has]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    threads: Option<u32>,
}

fn seeds(text: &str) -> Result<Seeds, String> {
    let parsed = text.split_once("..").and_then(|(first, end)| {
        Some(Seeds { first: first.trim().parse().ok()?, end: end.trim().parse().ok()? })
    });
    parsed.ok_or_else(|| format!("must be two whole numbers in [0, {}], such as 1..126", u64::MAX))
}

fn count(text: &str) -> Result<u32, String> {
    text.parse().map_err(|_| format!("must be a whole number in [1, {}]", u32::MAX))
}

pub fn run(args: &Args, program: &Program) -> Result<(), Failure> {
    let plan = plan(args, program)?;
    let threads = args.threads.map_or_else(
        || std::thread::available_parallelism().map_or(1, std::num::NonZero::get),
        |threads| threads as usize,
    );
    let stop = interrupt::listen()?;
    let folder = Folder::open(&args.out, &plan).map_err(failure)?;
    let bar = Bar::new(plan.recipe());
    let result = orchard_dataset::run(&plan, &folder, threads, stop, &bar);
    bar.0.finish_and_clear();
    let done = result.map_err(failure)?;
    sheet::write(folder.store(), &plan)?;
    report(&done, &args.out, &plan);
    Ok(())
}

fn failure(e: DatasetError) -> Failure {
    match e {
        DatasetError::Interrupted { .. } => Failure::Interrupted(e.to_string()),
        e if e.is_bad_input() => Failure::BadInput(e.to_string()),
        e => Failure::Failed(e.to_string()),
    }
}

fn plan(args: &Args, program: &Program) -> Result<Plan, Failure> {
    let intrinsics = args.intrinsics.as_deref().map(read_intrinsics).transpose()?;
    let still = "data sets have no robot and no detections";
    args.scenario.refuse(&[Part::Detector, Part::Controller], still)?;
    let scenario = args.scenario.resolve(program)?;
    let config = config(args, scenario.spec().light.as_ref()).map_err(Failure::BadInput)?;
    Plan::new(&scenario, &config, intrinsics, args.seeds, args.trees, args.views).map_err(failure)
}

/// The config with the world's light, if it has one, and then the options applied.
fn config(args: &Args, light: Option<&LightSpec>) -> Result<DatasetConfig, String> {
    let mut config = DatasetConfig::paper();
    if let Some(light) = light {
        config.light = light.clone();
    }
    let set = |quantity: &mut Quantity, option: &str, value: Option<f64>| -> Result<(), String> {
        if let Some(value) = value {
            *quantity = quantity.with_value(value).map_err(|e| format!("--{option}: {e}"))?;
        }
        Ok(())
    };
    let light = &mut config.light;
    set(&mut light.sun_azimuth, "sun-azimuth", args.sun_azimuth)?;
    set(&mut light.sun_elevation, "sun-elevation", args.sun_elevation)?;
    set(&mut light.sun_strength, "sun-strength", args.sun_strength)?;
    set(&mut light.overcast, "overcast", args.overcast)?;
    set(&mut config.depth_unit, "depth-unit", args.depth_unit)?;
    if let Some(side) = args.supersampling {
        let samples = config.supersampling.with_value(side);
        config.supersampling = samples.map_err(|e| format!("--supersampling: {e}"))?;
    }
    Ok(config)
}

fn read_intrinsics(file: &Path) -> Result<Intrinsics, Failure> {
    let bad = |problem: String| Failure::BadInput(format!("--intrinsics {}: {problem}", file.display()));
    let text = orchard_input::text(file, orchard_input::CONFIG).map_err(|e| bad(e.to_string()))?;
    intrinsics::read(&text).map_err(|e| bad(e.to_string()))
}

fn report(done: &Done, out: &Path, plan: &Plan) {
    say!("{} trees, {} views, {} visible fruit", done.trees, done.images, done.annotations);
    if done.unfit_depth_px > 0 {
        let farthest = plan.recipe().depth_unit_m * f64::from(u16::MAX);
        note!(
            "note: {} pixels are farther than {farthest:.3} m or nearer than half a unit; the depth images have 0 there",
            done.unfit_depth_px
        );
    }
    say!("data set: {}", out.join("manifest.json").display());
}

/// A progress bar on a terminal.
struct Bar(ProgressBar);

impl Bar {
    fn new(recipe: &orchard_dataset::Recipe) -> Self {
        let orchard_dataset::Recipe { seeds, trees, views, .. } = recipe;
        let bar = ProgressBar::new((seeds.end - seeds.first) * u64::from(*trees) * u64::from(*views));
        if let Ok(style) =
            ProgressStyle::with_template("{bar:30} {pos}/{len} views  {elapsed} (about {eta} left)")
        {
            bar.set_style(style);
        }
        Self(bar)
    }
}

impl orchard_dataset::Progress for Bar {
    fn views(&self, count: u64, _kept: bool) {
        self.0.inc(count);
    }

    fn note(&self, line: &str) {
        if self.0.is_hidden() {
            eprintln!("note: {line}");
        } else {
            self.0.println(format!("note: {line}"));
        }
    }
}
