//! `orchard detect`: the detector on a depth image in a file.

mod input;
mod overlay;

use std::path::PathBuf;

use anyhow::Context;
use orchard_bench::store::write_bytes;
use orchard_perception::{Candidate, Detection, candidates};
use serde::Serialize;

use crate::failure::Failure;
use crate::picture_file;

/// Finds fruit in a depth image of any camera, simulated or real.
#[derive(clap::Args)]
#[command(
    after_help = "The image is a 16-bit grey PNG: value x --unit = metres along the optical axis, 0 = no measurement, as RealSense\n\
                  and ROS tools write it. Intrinsics are JSON: width, height, fx, fy, cx, cy [px] (also ppx and ppy, or a ROS\n\
                  camera_info with K). Pixel coordinates (0, 0) are the centre of the first pixel.\n\n\
                  The result is JSON in metres and pixels; p_camera is the centre of a fruit with x right, y down and z\n\
                  forward. With --camera-height, pixels of level ground are left out; --up is the vertical in the camera's\n\
                  axes, 0,-1,0 for a level camera. Detections are sorted by score, the probability that a sphere is a fruit.\n\
                  docs/computation/perception.md defines score and gates. --camera NAME takes the detector made for a real camera.\n\n\
                  Examples:\n  orchard detect --depth depth.png --intrinsics camera.json\n  \
                  orchard detect --depth depth.png --intrinsics camera.json --camera azure-kinect --picture seen.png --all\n  \
                  orchard detect --depth depth.png --intrinsics camera.json --camera-height 1.1 --up 0,-0.94,-0.34"
)]
pub struct Args {
    #[command(flatten)]
    input: input::InputArgs,
    /// Also list the rejected spheres, each with the first gate that rejected it
    #[arg(long)]
    all: bool,
    /// PNG to write: depth in false colour (bright is near) with circles around the fruit
    #[arg(long, value_name = "FILE.png")]
    picture: Option<PathBuf>,
    /// JSON file to write; - prints to the terminal
    #[arg(long, value_name = "FILE.json", default_value = "-")]
    out: PathBuf,
}

/// Output of the command.
#[derive(Debug, Serialize)]
struct Report {
    format: &'static str,
    schema_version: u32,
    /// The detector's config.
    config: String,
    detections: Vec<Sphere>,
    #[serde(skip_serializing_if = "Option::is_none")]
    refused: Option<Vec<Refused>>,
}

/// A sphere in metres and pixels.
#[derive(Debug, Serialize)]
struct Sphere {
    p_camera: [f64; 3],
    radius: f64,
    /// Probability that it is a fruit.
    score: f64,
    /// Standard deviations of centre and radius; null where too few pixels determine them.
    center_deviation: Option<f64>,
    radius_deviation: Option<f64>,
    /// Share of the disc that is seen.
    visible: f64,
    rms: f64,
    pixels: u32,
    center_px: [f64; 2],
}

#[derive(Debug, Serialize)]
struct Refused {
    #[serde(flatten)]
    sphere: Sphere,
    gate: &'static str,
}

const FORMAT: &str = "orchard-detections";
const SCHEMA_VERSION: u32 = 2;

/// Reads the input, detects the fruit and writes the result.
pub fn run(args: &Args) -> Result<(), Failure> {
    let to_terminal = args.out.as_os_str() == "-";
    if !to_terminal {
        picture_file::check_folder_of("--out", &args.out)?;
    }
    if let Some(picture) = &args.picture {
        picture_file::check("--picture", picture)?;
    }
    let input = args.input.read()?;
    let found = candidates(&input.depth, &input.intrinsics, input.mask.as_ref(), &input.config)
        .map_err(|e| Failure::BadInput(e.to_string()))?;
    if let Some(file) = &args.picture {
        let spheres: Vec<&Detection> =
            found.iter().filter(|c| c.refused_by.is_none()).map(|c| &c.detection).collect();
        picture_file::write(file, &overlay::picture(&input.depth, &input.intrinsics, &spheres))?;
    }
    let report = report(&found, args.input.detector_name().to_owned(), args.all);
    let text = serde_json::to_string_pretty(&report).context("cannot write the detections as JSON")? + "\n";
    if to_terminal {
        say!("{}", text.trim_end());
        return Ok(());
    }
    write_bytes(&args.out, text.as_bytes()).map_err(|e| Failure::of_file(&e))
}

fn report(found: &[Candidate], config: String, all: bool) -> Report {
    let mut accepted: Vec<&Detection> =
        found.iter().filter(|c| c.refused_by.is_none()).map(|c| &c.detection).collect();
    // The sort is stable: equal scores stay in the detector's order.
    accepted.sort_by(|a, b| b.score.total_cmp(&a.score));
    let refused = found
        .iter()
        .filter_map(|c| Some(Refused { sphere: sphere(&c.detection), gate: c.refused_by?.name() }));
    Report {
        format: FORMAT,
        schema_version: SCHEMA_VERSION,
        config,
        detections: accepted.into_iter().map(sphere).collect(),
        refused: all.then(|| refused.collect()),
    }
}

fn finite(x: f64) -> Option<f64> {
    x.is_finite().then_some(x)
}

fn sphere(d: &Detection) -> Sphere {
    Sphere {
        p_camera: d.p_camera.into(),
        radius: d.radius,
        score: d.score,
        center_deviation: finite(d.center_deviation),
        radius_deviation: finite(d.radius_deviation),
        visible: d.visible,
        rms: d.rms,
        pixels: d.pixels,
        center_px: d.center_px.into(),
    }
}

#[cfg(test)]
mod tests;
