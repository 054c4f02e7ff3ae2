//! Input of the detector: reads the files and checks that they are consistent.

use std::path::{Path, PathBuf};

use orchard_exchange::intrinsics::{Lens, OfImage};
use orchard_exchange::{colour_image, depth_image, depth_png, intrinsics};
use orchard_geometry::{DepthImage, Image, Intrinsics, Vec3};
use orchard_perception::{DetectorConfig, mask};
use orchard_quantity::{Span, Unit};

use orchard_scenario::OptionValue;
use orchard_spec::camera::CameraSpec;
use serde::Deserialize;

use crate::failure::Failure;

#[derive(clap::Args)]
pub struct InputArgs {
    /// Depth image: 16-bit grey PNG, TIFF, NumPy .npy or .npz
    #[arg(long, value_name = "IMAGE")]
    #[cfg_attr(feature = "recording", arg(required_unless_present = "mcap"))]
    #[cfg_attr(not(feature = "recording"), arg(required = true))]
    pub depth: Option<PathBuf>,
    /// Intrinsics of the camera: JSON or YAML of ROS, RealSense, Open3D, BOP, or our own
    #[arg(long, value_name = "FILE")]
    #[cfg_attr(feature = "recording", arg(required_unless_present = "mcap"))]
    #[cfg_attr(not(feature = "recording"), arg(required = true))]
    intrinsics: Option<PathBuf>,
    /// Depth of pixel value 1 [m]; by default that of the intrinsics file (BOP's depth_scale), else 0.001 for whole numbers and 1 for
    /// floating-point numbers
    #[arg(long, value_name = "METRES", allow_negative_numbers = true)]
    pub unit: Option<f64>,
    /// Colour image of the same view and size, PNG or JPEG, for --picture, --onnx or a detector that sees colour
    #[arg(long, value_name = "IMAGE", group = "colours")]
    pub colour: Option<PathBuf>,
    /// Working range in depth [m] instead of the detector's own
    #[arg(long, value_name = "A,B", value_parser = pair, allow_hyphen_values = true)]
    range: Option<(f64, f64)>,
    /// Radii of fruit [m] instead of the detector's own
    #[arg(long, value_name = "A,B", value_parser = pair, allow_hyphen_values = true)]
    radius: Option<(f64, f64)>,
    /// Mask of pixels to ignore, such as the robot's: 1-bit or 8-bit grey PNG; black pixels are kept
    #[arg(long, value_name = "MASK.png")]
    pub mask: Option<PathBuf>,
    /// Detector, or a file of changed figures or of a network of your own; `orchard detectors` lists the detectors [default: with a --camera
    /// learned, with --colour or --colour-topic learned-colour, with --boxes, --masks or --onnx that of the camera's name; paper without a camera]
    #[arg(long = "detector", alias = "config", value_name = "NAME|FILE.toml")]
    config: Option<String>,
    /// Camera that took the image, for its detector, or the figures of its noise for a detector with a network: d435i, d435i-aligned, zed-mini,
    /// azure-kinect, azure-kinect-native
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
    /// Height of the camera above level ground [m]; pixels of the ground are ignored
    #[arg(long, value_name = "METRES", allow_negative_numbers = true)]
    pub camera_height: Option<f64>,
    /// The vertical in the camera's axes (x right, y down, z forward)
    #[arg(long, value_name = "X,Y,Z", default_value = "0,-1,0", allow_hyphen_values = true,
          requires = "camera_height", value_parser = vertical)]
    pub up: Vec3,
}

/// The images that a detector searches; its default depends on them.
#[derive(Clone, Copy)]
pub enum Look {
    /// A depth image.
    Depth,
    /// A depth image and the colour image to it.
    Colour,
    /// Regions of a depth image in which another detector found fruit.
    Regions,
}

impl Look {
    /// With `regions` the colour image is for the detector that found them; the fit inside them takes depth alone.
    pub fn at(colour: bool, regions: bool) -> Self {
        match (regions, colour) {
            (true, _) => Self::Regions,
            (false, true) => Self::Colour,
            (false, false) => Self::Depth,
        }
    }
}

/// The parsed input files.
pub struct Input {
    /// As the pinhole sees it.
    pub depth: DepthImage,
    pub intrinsics: Intrinsics,
    /// Distortion that was undone.
    pub lens: Option<Lens>,
    /// As the pinhole sees it.
    pub colour: Option<Image<[u8; 3]>>,
    /// Depth of value 1 \[m\].
    pub unit: f64,
    pub mask: Option<Image<bool>>,
    pub config: DetectorConfig,
}

/// Allowed depth units \[m\]: a nanometre to a metre.
const UNITS: std::ops::RangeInclusive<f64> = 1e-9..=1.0;
/// Allowed heights of the camera \[m\].
const HEIGHTS: std::ops::RangeInclusive<f64> = -100.0..=100.0;

impl InputArgs {
    /// Name or file of the detector. Without `--detector` it follows from the camera and the images.
    pub fn detector_name(&self, look: Look) -> &str {
        let camera = self.camera.as_deref().unwrap_or_default();
        let of_camera = || match look {
            Look::Depth => orchard_scenario::detector_for(camera, false),
            Look::Colour => orchard_scenario::detector_for(camera, true),
            Look::Regions => orchard_scenario::geometric_detector_for(camera),
        };
        self.config.as_deref().unwrap_or_else(of_camera)
    }

    /// The detector of `--camera` or `--detector`.
    pub fn detector(&self, look: Look) -> Result<DetectorConfig, Failure> {
        if let Some(camera) = &self.camera {
            CameraSpec::named(camera).map_err(|e| Failure::BadInput(format!("--camera {camera}: {e}")))?;
        }
        let given = OptionValue::new(self.detector_name(look), "--detector");
        let camera = self.camera.as_deref().unwrap_or_default();
        let mut config =
            orchard_scenario::detector(&given, camera).map_err(|e| Failure::BadInput(e.to_string()))?;
        if let (Some(camera), Some(name), true) = (&self.camera, &self.config, config.network.is_none()) {
            let problem = "give one of the two; only detectors with a network, such as learned, have figures of a camera";
            return Err(Failure::BadInput(format!("--camera {camera} and --detector {name}: {problem}")));
        }
        let told = |option: &str, (a, b): (f64, f64), e: String| {
            Failure::BadInput(format!("{option} {a},{b} [m]: {e}"))
        };
        if let Some(ends) = self.range {
            let range = &mut config.segmentation.range;
            *range = replaced(range, ends).map_err(|e| told("--range", ends, e))?;
        }
        if let Some(ends) = self.radius {
            let gate = &mut config.gates.radius;
            gate.on = true;
            gate.limit = replaced(&gate.limit, ends).map_err(|e| told("--radius", ends, e))?;
        }
        Ok(config)
    }

    /// Checks `--unit`.
    pub fn check_unit(&self) -> Result<(), Failure> {
        self.unit.map_or(Ok(()), |unit| within("--unit", unit, &UNITS))
    }

    /// Reads all files; an error names the option, file, field and range.
    pub fn read(&self, look: Look) -> Result<Input, Failure> {
        let (Some(depth_file), Some(intrinsics_file)) = (&self.depth, &self.intrinsics) else {
            return Err(Failure::BadInput("--depth and --intrinsics are needed".to_owned()));
        };
        self.check_unit()?;
        if let Some(height) = self.camera_height {
            within("--camera-height", height, &HEIGHTS)?;
        }
        let config = self.detector(look)?;
        let raw =
            depth_image::read(&bytes("--depth", depth_file)?).map_err(|e| bad("--depth", depth_file, e))?;
        let text = orchard_input::text(intrinsics_file, orchard_input::CONFIG)
            .map_err(|e| bad("--intrinsics", intrinsics_file, e))?;
        let number = depth_file.file_stem().and_then(|stem| stem.to_string_lossy().parse().ok());
        let camera = intrinsics::read_camera(&text, &OfImage { size: Some(raw.size()), number })
            .map_err(|e| bad("--intrinsics", intrinsics_file, e))?;
        let (intrinsics, lens) = (camera.intrinsics, camera.lens);
        self.same_size("--depth", depth_file, raw.size(), &intrinsics)?;
        let unit = self.unit.or(camera.unit).unwrap_or(raw.usual_unit());
        let mut depth = raw.depth(unit).map_err(|e| bad("--depth", depth_file, e))?;
        let mut colour = self.read_colour(&intrinsics)?;
        if config.sees_colour() && colour.is_none() {
            let name = self.detector_name(look);
            return Err(Failure::BadInput(format!(
                "--detector {name}: it looks at colour; --colour IMAGE is needed"
            )));
        }
        if let Some(lens) = &lens {
            depth = lens.undone(&depth, &intrinsics, 0.0);
            colour = colour.map(|colour| lens.undone(&colour, &intrinsics, [0; 3]));
        }
        let mask = self.read_mask(&depth, &intrinsics, lens.as_ref(), &config)?;
        Ok(Input { depth, intrinsics, lens, colour, unit, mask, config })
    }

    fn read_colour(&self, k: &Intrinsics) -> Result<Option<Image<[u8; 3]>>, Failure> {
        let Some(file) = &self.colour else { return Ok(None) };
        let colour = colour_image::read(&bytes("--colour", file)?).map_err(|e| bad("--colour", file, e))?;
        self.same_size("--colour", file, (colour.width(), colour.height()), k)?;
        Ok(Some(colour))
    }

    fn read_mask(
        &self,
        depth: &DepthImage,
        intrinsics: &Intrinsics,
        lens: Option<&Lens>,
        config: &DetectorConfig,
    ) -> Result<Option<Image<bool>>, Failure> {
        let mut all = None;
        if let Some(file) = &self.mask {
            let mask = depth_png::read_mask(&bytes("--mask", file)?).map_err(|e| bad("--mask", file, e))?;
            self.same_size("--mask", file, (mask.width(), mask.height()), intrinsics)?;
            all = Some(lens.map_or(mask.clone(), |lens| lens.undone(&mask, intrinsics, false)));
        }
        if let Some(height) = self.camera_height {
            let margin = config.mask.ground_margin.si();
            let ground = mask::ground_mask(depth, intrinsics, &self.up, height, margin);
            match &mut all {
                Some(all) => mask::add(all, &ground),
                None => all = Some(ground),
            }
        }
        Ok(all)
    }

    fn same_size(
        &self,
        option: &str,
        file: &Path,
        (width, height): (usize, usize),
        k: &Intrinsics,
    ) -> Result<(), Failure> {
        if (width, height) == (k.width, k.height) {
            return Ok(());
        }
        let problem = format!(
            "is {width} x {height}, but --intrinsics {} is for {} x {}",
            self.intrinsics.as_deref().unwrap_or(Path::new("-")).display(),
            k.width,
            k.height
        );
        Err(bad(option, file, problem))
    }
}

fn within(option: &str, value: f64, range: &std::ops::RangeInclusive<f64>) -> Result<(), Failure> {
    let (low, high) = (range.start(), range.end());
    let bad = || Failure::BadInput(format!("{option} {value}: the allowed range is [{low}, {high}] m"));
    range.contains(&value).then_some(()).ok_or_else(bad)
}

pub fn bytes(option: &str, file: &Path) -> Result<Vec<u8>, Failure> {
    orchard_input::bytes(file, orchard_input::IMAGE).map_err(|e| bad(option, file, e))
}

pub fn bad(option: &str, file: &Path, problem: impl std::fmt::Display) -> Failure {
    Failure::BadInput(format!("{option} {}: {problem}", file.display()))
}

/// The span with other ends \[m\], in its own unit.
fn replaced(span: &Span, (low, high): (f64, f64)) -> Result<Span, String> {
    let written = serde_json::to_value(span).map_err(|e| e.to_string())?;
    let unit = Unit::deserialize(&written["unit"]).map_err(|e| e.to_string())?.to_si();
    span.with_ends(low / unit, high / unit)
}

/// Parses two numbers, the lower one first.
fn pair(text: &str) -> Result<(f64, f64), String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|x| x.trim().parse()).collect();
    match numbers.as_deref() {
        Ok(&[low, high]) if low < high && low.is_finite() && high.is_finite() => Ok((low, high)),
        _ => Err("must be two numbers [m], the lower one first, such as 0.3,2.5".into()),
    }
}

/// Parses a direction of any length but zero and returns the unit vector.
fn vertical(text: &str) -> Result<Vec3, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|x| x.trim().parse()).collect();
    let Ok(&[x, y, z]) = numbers.as_deref() else {
        return Err("must be three numbers, such as 0,-1,0".into());
    };
    let up = Vec3::new(x, y, z);
    let length = up.norm();
    if !(length.is_finite() && length > 0.0) {
        return Err("must be finite and not the zero vector".into());
    }
    Ok(up / length)
}
