//! Input of the detector: reads the files and checks that they are consistent.

use std::path::{Path, PathBuf};

use orchard_exchange::{depth_png, intrinsics};
use orchard_geometry::{DepthImage, Image, Intrinsics, Vec3};
use orchard_perception::{DetectorConfig, mask};

use crate::failure::Failure;
use orchard_scenario::OptionValue;
use orchard_spec::camera::CameraSpec;

#[derive(clap::Args)]
pub struct InputArgs {
    /// Depth image: 16-bit grey PNG
    #[arg(long, value_name = "IMAGE.png")]
    pub depth: PathBuf,
    /// Pinhole intrinsics of the camera (JSON)
    #[arg(long, value_name = "FILE.json")]
    pub intrinsics: PathBuf,
    /// Depth of pixel value 1 [m]
    #[arg(long, value_name = "METRES", default_value_t = depth_png::MILLIMETRE, allow_negative_numbers = true)]
    pub unit: f64,
    /// Mask of pixels to ignore, such as the robot's: 1-bit or 8-bit grey PNG; black pixels are kept
    #[arg(long, value_name = "MASK.png")]
    pub mask: Option<PathBuf>,
    /// Detector, or a file of changed figures; `orchard detectors` lists the detectors
    #[arg(long = "detector", alias = "config", value_name = "NAME|FILE.toml", default_value = "paper")]
    config: String,
    /// Camera that took the image, for its detector: d435i, d435i-aligned, zed-mini, azure-kinect, azure-kinect-native
    #[arg(long, value_name = "NAME", conflicts_with = "config")]
    camera: Option<String>,
    /// Height of the camera above level ground [m]; pixels of the ground are ignored
    #[arg(long, value_name = "METRES", allow_negative_numbers = true)]
    pub camera_height: Option<f64>,
    /// The vertical in the camera's axes (x right, y down, z forward)
    #[arg(long, value_name = "X,Y,Z", default_value = "0,-1,0", allow_hyphen_values = true,
          requires = "camera_height", value_parser = vertical)]
    pub up: Vec3,
}

/// The parsed input files.
pub struct Input {
    pub depth: DepthImage,
    pub intrinsics: Intrinsics,
    pub mask: Option<Image<bool>>,
    pub config: DetectorConfig,
}

/// Allowed depth units \[m\]: a nanometre to a metre.
const UNITS: std::ops::RangeInclusive<f64> = 1e-9..=1.0;
/// Allowed heights of the camera \[m\].
const HEIGHTS: std::ops::RangeInclusive<f64> = -100.0..=100.0;

impl InputArgs {
    /// Name or file of the detector.
    pub fn detector_name(&self) -> &str {
        match self.camera.as_deref() {
            Some(camera) => orchard_scenario::detector_for(camera),
            None => &self.config,
        }
    }

    /// The detector of `--camera` or `--detector`.
    fn detector(&self) -> Result<DetectorConfig, Failure> {
        if let Some(camera) = &self.camera {
            CameraSpec::named(camera).map_err(|e| Failure::BadInput(format!("--camera {camera}: {e}")))?;
        }
        orchard_scenario::detector(&OptionValue::new(self.detector_name(), "--detector"))
            .map_err(|e| Failure::BadInput(e.to_string()))
    }

    /// Reads all files; an error names the option, file, field and range.
    pub fn read(&self) -> Result<Input, Failure> {
        let within = |option, value: f64, range: &std::ops::RangeInclusive<f64>| {
            let (low, high) = (range.start(), range.end());
            let bad =
                || Failure::BadInput(format!("{option} {value}: the allowed range is [{low}, {high}] m"));
            range.contains(&value).then_some(()).ok_or_else(bad)
        };
        within("--unit", self.unit, &UNITS)?;
        if let Some(height) = self.camera_height {
            within("--camera-height", height, &HEIGHTS)?;
        }
        let config = self.detector()?;
        let text = orchard_input::text(&self.intrinsics, orchard_input::CONFIG)
            .map_err(|e| bad("--intrinsics", &self.intrinsics, e))?;
        let intrinsics = intrinsics::read(&text).map_err(|e| bad("--intrinsics", &self.intrinsics, e))?;
        let depth = depth_png::read(&bytes("--depth", &self.depth)?, self.unit)
            .map_err(|e| bad("--depth", &self.depth, e))?;
        self.same_size("--depth", &self.depth, (depth.width(), depth.height()), &intrinsics)?;
        let mask = self.read_mask(&depth, &intrinsics, &config)?;
        Ok(Input { depth, intrinsics, mask, config })
    }

    fn read_mask(
        &self,
        depth: &DepthImage,
        intrinsics: &Intrinsics,
        config: &DetectorConfig,
    ) -> Result<Option<Image<bool>>, Failure> {
        let mut all = None;
        if let Some(file) = &self.mask {
            let mask = depth_png::read_mask(&bytes("--mask", file)?).map_err(|e| bad("--mask", file, e))?;
            self.same_size("--mask", file, (mask.width(), mask.height()), intrinsics)?;
            all = Some(mask);
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
            self.intrinsics.display(),
            k.width,
            k.height
        );
        Err(bad(option, file, problem))
    }
}

fn bytes(option: &str, file: &Path) -> Result<Vec<u8>, Failure> {
    orchard_input::bytes(file, orchard_input::IMAGE).map_err(|e| bad(option, file, e))
}

fn bad(option: &str, file: &Path, problem: impl std::fmt::Display) -> Failure {
    Failure::BadInput(format!("{option} {}: {problem}", file.display()))
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
