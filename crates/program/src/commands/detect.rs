//! `orchard detect`: the detector on a depth image in a file.

#[cfg(feature = "recording")]
mod bag;
mod census;
mod input;
mod onnx;
mod overlay;
mod regions;

use std::path::{Path, PathBuf};

use anyhow::Context;
use orchard_bench::store::write_bytes;
use orchard_perception::{
    Candidate, Detection, Gate, PerceptionError, Region, RgbdImage, candidates, fit_regions,
};
use serde::Serialize;

use self::census::Census;
use self::input::{Input, Look};
use self::regions::Found;
use crate::failure::Failure;
use crate::picture_file;

/// Finds fruit in a depth image of any camera, simulated or real.
#[derive(clap::Args)]
#[command(
    after_help = "The depth image is PNG (16-bit grey), TIFF, or a NumPy array (.npy, or .npz with one array or one named depth); value x --unit =\n\
                  metres along the optical axis. What is not positive and finite is no measurement. Intrinsics are JSON: width, height,\n\
                  fx, fy, cx, cy [px]; RealSense's with ppx, ppy, coeffs; a ROS camera_info as JSON or YAML; Open3D's intrinsic_matrix;\n\
                  BOP's camera.json or scene_camera.json. Distortion by plumb_bob or rational_polynomial is undone first.\n\
                  Pixel coordinates (0, 0) are the centre of the first pixel. Formats are told apart by their content.\n\n\
                  The result is JSON in metres and pixels; p_camera is the centre of a fruit with x right, y down and z\n\
                  forward. With --camera-height, pixels of level ground are left out; --up is the vertical in the camera's\n\
                  axes, 0,-1,0 for a level camera. Detections are sorted by score, the probability that a sphere is a fruit; with\n\
                  --boxes, --masks or --onnx it is that detector's score if there is one. --camera NAME takes the network learned, with the\n\
                  figures of a real camera; with --colour learned-colour, a network that looks at colour as well.\n\
                  Measured shares, refusals by gate and warnings go to the error output and into the result (image).\n\
                  docs/perception.md is for users of real images, docs/computation/perception.md defines score and gates.\n\n\
                  Examples:\n  orchard detect --depth depth.png --intrinsics camera.json\n  \
                  orchard detect --depth depth.png --intrinsics camera.json --camera azure-kinect --picture seen.png --all\n  \
                  orchard detect --depth depth.png --intrinsics camera.json --detector d435i\n  \
                  orchard detect --depth d.png --intrinsics k.json --camera azure-kinect --colour c.jpg --picture seen.png\n  \
                  orchard detect --depth d.tiff --intrinsics info.yaml --camera d435i --boxes yolo.json --colour c.jpg --picture seen.png\n  \
                  orchard detect --depth depth.png --intrinsics camera.json --range 0.4,2.5 --radius 0.02,0.045\n  \
                  orchard detect --depth d.png --intrinsics k.json --camera azure-kinect --colour c.jpg --onnx apples.onnx\n  \
                  orchard detect --mcap bag.mcap --topic /camera/depth/image_rect_raw --camera d435i --out found.mcap\n  \
                  orchard detect --mcap bag.mcap --topic /depth/image --colour-topic /color/image --camera d435i-aligned --out found.mcap\n  \
                  orchard detect --depth depth.png --intrinsics camera.json --camera-height 1.1 --up 0,-0.94,-0.34"
)]
pub struct Args {
    #[command(flatten)]
    input: input::InputArgs,
    #[command(flatten)]
    regions: regions::RegionArgs,
    #[cfg(feature = "recording")]
    #[command(flatten)]
    bag: bag::BagArgs,
    /// Also list the rejected spheres, each with the first gate that rejected it
    #[arg(long)]
    all: bool,
    /// PNG to write: circles around the fruit, on depth in false colour (bright is near), or on the image of --colour; the range in use
    /// has all colours
    #[arg(long, value_name = "FILE.png")]
    picture: Option<PathBuf>,
    /// JSON file to write, or with --mcap an MCAP file; - prints to the terminal
    #[arg(long, value_name = "FILE", default_value = "-")]
    out: PathBuf,
}

/// Output of the command.
#[derive(Debug, Serialize)]
struct Report {
    format: &'static str,
    schema_version: u32,
    /// The detector's config.
    config: String,
    image: Census,
    /// Regions given by --boxes, --masks or --onnx, and of these those with a sphere.
    #[serde(skip_serializing_if = "Option::is_none")]
    regions: Option<Fitted>,
    detections: Vec<Sphere>,
    #[serde(skip_serializing_if = "Option::is_none")]
    refused: Option<Vec<Refused>>,
}

#[derive(Debug, Serialize)]
struct Fitted {
    given: usize,
    with_sphere: usize,
}

/// Sphere of a region: its number among those of the image, score by the fit, and the gate that would have refused it elsewhere.
#[derive(Debug, Serialize)]
struct InRegion {
    region: usize,
    fit_score: f64,
    gate: Option<&'static str>,
}

/// A sphere in metres and pixels.
#[derive(Debug, Serialize)]
struct Sphere {
    p_camera: [f64; 3],
    radius: f64,
    /// Probability that it is a fruit, or the score of its region.
    score: f64,
    /// Standard deviations of centre and radius; null where too few pixels determine them.
    center_deviation: Option<f64>,
    radius_deviation: Option<f64>,
    /// Share of the disc that is seen.
    visible: f64,
    rms: f64,
    pixels: u32,
    center_px: [f64; 2],
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    in_region: Option<InRegion>,
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
    #[cfg(feature = "recording")]
    args.bag.check()?;
    args.regions.check()?;
    #[cfg(feature = "recording")]
    if let Some(file) = &args.bag.mcap {
        return bag::run(&args.bag, file, &args.input, &args.regions, &args.out);
    }
    let look = Look::at(args.input.colour.is_some(), args.regions.given());
    let input = args.input.read(look)?;
    let unused = args.picture.is_none() && !args.regions.use_colour() && !input.config.sees_colour();
    if let Some(file) = args.input.colour.as_ref().filter(|_| unused) {
        let problem = "needs --picture, --onnx or a detector that sees colour";
        return Err(Failure::BadInput(format!("--colour {}: {problem}", file.display())));
    }
    let images = [args.input.depth.as_ref(), args.input.colour.as_ref()];
    let images: Vec<&Path> = images.into_iter().flatten().map(PathBuf::as_path).collect();
    let regions = args.regions.read(&input, &images)?;
    let found = find(&input, regions.as_deref())?;
    let accepted: Vec<&Detection> = found.accepted.iter().map(|(d, _)| d).collect();
    let range = input.config.segmentation.range.si();
    if let Some(file) = &args.picture {
        let picture =
            overlay::picture(&input.depth, input.colour.as_ref(), &input.intrinsics, range, &accepted);
        picture_file::write(file, &picture)?;
    }
    let census = Census::of(&input.depth, input.unit, range, &found.refused);
    census.tell(accepted.len());
    // Positions are in the image as the camera took it.
    let seen = |d: &Detection| match &input.lens {
        Some(lens) => Detection { center_px: lens.in_image(&input.intrinsics, d.center_px), ..d.clone() },
        None => d.clone(),
    };
    let refused = found.refused.iter().filter_map(|c| {
        Some(Refused { sphere: sphere(&seen(&c.detection), None), gate: c.refused_by?.name() })
    });
    let report = Report {
        format: FORMAT,
        schema_version: SCHEMA_VERSION,
        config: args.input.detector_name(look).to_owned(),
        image: census,
        regions: regions
            .as_ref()
            .map(|given| Fitted { given: given.len(), with_sphere: found.accepted.len() }),
        refused: args.all.then(|| refused.collect()),
        detections: found.accepted.into_iter().map(|(d, region)| sphere(&seen(&d), region)).collect(),
    };
    let text = serde_json::to_string_pretty(&report).context("cannot write the detections as JSON")? + "\n";
    if to_terminal {
        say!("{}", text.trim_end());
        return Ok(());
    }
    write_bytes(&args.out, text.as_bytes()).map_err(|e| Failure::of_file(&e))
}

/// Spheres, the detections sorted by score.
struct Spheres {
    accepted: Vec<(Detection, Option<InRegion>)>,
    refused: Vec<Candidate>,
}

/// Finds spheres in the image, or in its regions.
fn find(input: &Input, regions: Option<&[Found]>) -> Result<Spheres, Failure> {
    let Input { depth, intrinsics, mask, config, colour, .. } = input;
    let told = |e: PerceptionError| Failure::BadInput(e.to_string());
    let mut found = match regions {
        None => {
            let all =
                candidates(RgbdImage { depth, colour: colour.as_ref() }, intrinsics, mask.as_ref(), config)
                    .map_err(told)?;
            let (accepted, refused) = all.into_iter().partition(|c| c.refused_by.is_none());
            let accepted: Vec<Candidate> = accepted;
            Spheres { accepted: accepted.into_iter().map(|c| (c.detection, None)).collect(), refused }
        }
        Some(regions) => {
            let areas: Vec<Region> = regions.iter().map(|found| found.region.clone()).collect();
            let fitted = fit_regions(depth, intrinsics, mask.as_ref(), &areas, config).map_err(told)?;
            let of_region = |(region, (candidate, given)): (usize, (Option<Candidate>, &Found))| {
                let Candidate { detection, refused_by, .. } = candidate?;
                let (fit_score, gate) = (detection.score, refused_by.map(Gate::name));
                let score = given.score.unwrap_or(fit_score);
                Some((Detection { score, ..detection }, Some(InRegion { region, fit_score, gate })))
            };
            let accepted = fitted.into_iter().zip(regions).enumerate().filter_map(of_region).collect();
            Spheres { accepted, refused: Vec::new() }
        }
    };
    // The sort is stable: equal scores stay in the detector's order.
    found.accepted.sort_by(|(a, _), (b, _)| b.score.total_cmp(&a.score));
    Ok(found)
}

fn finite(x: f64) -> Option<f64> {
    x.is_finite().then_some(x)
}

fn sphere(d: &Detection, in_region: Option<InRegion>) -> Sphere {
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
        in_region,
    }
}

#[cfg(test)]
mod tests;
