//! Specs of depth cameras.

mod stereo;
mod time_of_flight;

pub use stereo::StereoSpec;
pub use time_of_flight::TimeOfFlightSpec;

use orchard_quantity::{ConfigError, Count, Quantity, Span, from_table, overlay, parse};
use serde::{Deserialize, Serialize};

/// Config of the camera `paper` as TOML text.
pub const PAPER_TOML: &str = include_str!("../configs/camera/paper.toml");

/// The depth cameras that a config can choose: `[camera.NAME]` holds the differences from that camera's own file,
/// `configs/camera/NAME.toml`. The mount pose belongs to the robot's config.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CameraSpec {
    /// Exact depth of every surface at any range.
    Ideal(IdealSpec),
    /// The paper's camera: exact depth within its range.
    Paper(PaperSpec),
    /// A stereo camera with the errors of an Intel RealSense D435i outdoors.
    D435i(Box<StereoSpec>),
    /// The stereo camera of a D435i, its depth registered to the colour camera.
    D435iAligned(Box<StereoSpec>),
    /// A stereo camera with the errors of a Stereolabs ZED Mini.
    ZedMini(Box<StereoSpec>),
    /// A time-of-flight camera with the errors of a Microsoft Azure Kinect, registered to its colour camera.
    AzureKinect(Box<TimeOfFlightSpec>),
    /// A time-of-flight camera with the errors of an Azure Kinect, in the view of its depth imager.
    AzureKinectNative(Box<TimeOfFlightSpec>),
}

/// Principle by which a camera measures depth, with its figures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Measurement<'a> {
    /// Without errors.
    Exact,
    /// By disparity.
    Stereo(&'a StereoSpec),
    /// By the time of flight of light.
    TimeOfFlight(&'a TimeOfFlightSpec),
}

/// A depth imager whose images are registered to the view of another camera: every depth is moved to where that camera sees it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NativeSpec {
    /// Columns.
    #[serde(deserialize_with = "pixels")]
    pub width: Count,
    /// Rows.
    #[serde(deserialize_with = "pixels")]
    pub height: Count,
    /// Horizontal field of view.
    #[serde(deserialize_with = "field_of_view")]
    pub horizontal_fov: Quantity,
    /// Vertical field of view.
    #[serde(deserialize_with = "field_of_view")]
    pub vertical_fov: Quantity,
    /// Position of the other camera to the right of the imager; their axes are parallel.
    pub right: Quantity,
    /// Largest difference of depth between neighbouring pixels across which depth is interpolated. 0: none is, and each pixel covers its
    /// own rectangle.
    pub bridge: Quantity,
}

/// Size, field of view and rate of a pinhole camera with its axis in the middle of the image.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ViewSpec {
    /// Columns.
    #[serde(deserialize_with = "pixels")]
    pub width: Count,
    /// Rows.
    #[serde(deserialize_with = "pixels")]
    pub height: Count,
    /// Horizontal field of view; without it pixels are square.
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "some_field_of_view")]
    pub horizontal_fov: Option<Quantity>,
    /// Vertical field of view.
    #[serde(deserialize_with = "field_of_view")]
    pub vertical_fov: Quantity,
    /// Image rate.
    pub rate: Quantity,
}

/// A camera without errors or limits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct IdealSpec {
    /// Size, field of view and rate.
    pub view: ViewSpec,
}

/// A camera without errors within its range.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PaperSpec {
    /// Size, field of view and rate.
    pub view: ViewSpec,
    /// Valid depths; a nearer surface occludes but reads as invalid.
    pub range: Span,
}

/// Checks the number of pixels against the code's own limit, which holds for any range in the file.
fn pixels<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Count, D::Error> {
    const LARGEST: u32 = 8192;
    let count = Count::deserialize(deserializer)?;
    if (1..=LARGEST).contains(&count.get()) {
        return Ok(count);
    }
    let problem = format!("{} is outside the range [1, {LARGEST}] px of an image", count.get());
    Err(serde::de::Error::custom(problem))
}

/// Checks that a pinhole can have the field of view, whatever range the file states.
fn field_of_view<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Quantity, D::Error> {
    let angle = Quantity::deserialize(deserializer)?;
    if angle.si() > 0.0 && angle.si() < std::f64::consts::PI {
        return Ok(angle);
    }
    let problem = format!("{} is outside the range (0, 180) deg of a pinhole camera", angle.value());
    Err(serde::de::Error::custom(problem))
}

fn some_field_of_view<'de, D: serde::Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<Quantity>, D::Error> {
    field_of_view(deserializer).map(Some)
}

/// Checks that a divisor of the model is positive, whatever range the file states.
fn positive<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Quantity, D::Error> {
    let quantity = Quantity::deserialize(deserializer)?;
    if quantity.si() > 0.0 {
        return Ok(quantity);
    }
    Err(serde::de::Error::custom(format!("{} is not greater than 0", quantity.value())))
}

/// Checks that sums of noise over the window fit in 32 bits.
fn window_radius<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Count, D::Error> {
    const LARGEST: u32 = 15;
    let radius = Count::deserialize(deserializer)?;
    if radius.get() > LARGEST {
        let problem =
            format!("{} is outside the range [0, {LARGEST}] px that the model holds for", radius.get());
        return Err(serde::de::Error::custom(problem));
    }
    Ok(radius)
}

/// Value of a span at a dial from 0 (low end) to 1 (high end).
fn at(span: &Span, dial: &Quantity) -> f64 {
    let (low, high) = span.si();
    low + dial.si() * (high - low)
}

impl CameraSpec {
    /// Names and files of the cameras that come with the crate.
    pub const FILES: &[(&str, &str)] = &[
        ("ideal", include_str!("../configs/camera/ideal.toml")),
        ("paper", PAPER_TOML),
        ("d435i", include_str!("../configs/camera/d435i.toml")),
        ("d435i-aligned", include_str!("../configs/camera/d435i-aligned.toml")),
        ("zed-mini", include_str!("../configs/camera/zed-mini.toml")),
        ("azure-kinect", include_str!("../configs/camera/azure-kinect.toml")),
        ("azure-kinect-native", include_str!("../configs/camera/azure-kinect-native.toml")),
    ];

    /// Returns a camera that comes with the crate.
    ///
    /// # Errors
    /// No camera has that name.
    pub fn named(name: &str) -> Result<Self, String> {
        if Self::FILES.iter().all(|(known, _)| *known != name) {
            let names: Vec<&str> = Self::FILES.iter().map(|(known, _)| *known).collect();
            return Err(format!("no camera '{name}'; the cameras are: {}", names.join(", ")));
        }
        Self::from_toml(name, &format!("[{name}]")).map_err(|e| e.to_string())
    }

    /// Reads a camera from TOML text with one table, named after the camera; `file` names the text in errors. Omitted fields
    /// have the values of that camera's own file.
    ///
    /// # Errors
    /// Not TOML, no camera or more than one, a field unknown, a value outside its range.
    pub fn from_toml(file: &str, text: &str) -> Result<Self, ConfigError> {
        let mut table = parse(file, text)?;
        complete(&mut table)?;
        from_table(file, table)
    }

    /// Name of the model in configs and on command lines.
    pub fn name(&self) -> &'static str {
        match self {
            CameraSpec::Ideal(_) => "ideal",
            CameraSpec::Paper(_) => "paper",
            CameraSpec::D435i(_) => "d435i",
            CameraSpec::D435iAligned(_) => "d435i-aligned",
            CameraSpec::ZedMini(_) => "zed-mini",
            CameraSpec::AzureKinect(_) => "azure-kinect",
            CameraSpec::AzureKinectNative(_) => "azure-kinect-native",
        }
    }

    /// Returns the principle by which the camera measures.
    pub fn measurement(&self) -> Measurement<'_> {
        match self {
            CameraSpec::Ideal(_) | CameraSpec::Paper(_) => Measurement::Exact,
            CameraSpec::D435i(spec) | CameraSpec::D435iAligned(spec) | CameraSpec::ZedMini(spec) => {
                Measurement::Stereo(spec)
            }
            CameraSpec::AzureKinect(spec) | CameraSpec::AzureKinectNative(spec) => {
                Measurement::TimeOfFlight(spec)
            }
        }
    }

    /// Size, field of view and rate.
    pub fn view(&self) -> &ViewSpec {
        match self {
            CameraSpec::Ideal(camera) => &camera.view,
            CameraSpec::Paper(camera) => &camera.view,
            CameraSpec::D435i(camera) | CameraSpec::D435iAligned(camera) | CameraSpec::ZedMini(camera) => {
                &camera.view
            }
            CameraSpec::AzureKinect(camera) | CameraSpec::AzureKinectNative(camera) => &camera.view,
        }
    }

    /// The depth imager, if its images are registered to another view.
    pub fn native(&self) -> Option<&NativeSpec> {
        match self.measurement() {
            Measurement::Exact => None,
            Measurement::Stereo(spec) => spec.native.as_ref(),
            Measurement::TimeOfFlight(spec) => spec.native.as_ref(),
        }
    }

    /// Nearest and farthest valid depth \[m\].
    pub fn range(&self) -> (f64, f64) {
        match self.measurement() {
            Measurement::Stereo(spec) => spec.range.si(),
            Measurement::TimeOfFlight(spec) => spec.range.si(),
            Measurement::Exact => match self {
                CameraSpec::Paper(camera) => camera.range.si(),
                _ => (0.0, f64::INFINITY),
            },
        }
    }

    /// Time from exposure to delivery of an image \[s\].
    pub fn latency(&self) -> f64 {
        match self.measurement() {
            Measurement::Exact => 0.0,
            Measurement::Stereo(spec) => spec.latency.si(),
            Measurement::TimeOfFlight(spec) => spec.latency.si(),
        }
    }
}

/// Lays each camera of a config's table over that camera's own file. Unknown names stay, and the reader refuses them.
pub(crate) fn complete(cameras: &mut toml::Table) -> Result<(), ConfigError> {
    for (name, changes) in cameras.iter_mut() {
        let own = CameraSpec::FILES.iter().find(|(known, _)| known == name);
        if let (Some((_, text)), toml::Value::Table(changes)) = (own, changes) {
            let mut whole = parse(&format!("camera/{name}.toml"), text)?;
            // No table within a camera is a choice of one entry.
            overlay(&mut whole, std::mem::take(changes), &[]);
            *changes = whole;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_of_a_camera_are_checked_against_their_range() {
        let error = |text: &str| CameraSpec::from_toml("c.toml", text).unwrap_err().to_string();
        let e = error("[d435i]\nsunlight = { value = 1.5, range = [0, 1], unit = '1', source = 'x' }");
        assert_eq!(e, "c.toml: d435i.sunlight: 1.5 is outside the allowed range [0, 1] 1");
        let e = error("[d435i]\nlatency = { value = -1, range = [0, 500], unit = 'ms', source = 'x' }");
        assert_eq!(e, "c.toml: d435i.latency: -1 is outside the allowed range [0, 500] ms");
        let e = error(
            "[d435i]\ndisparity_noise = { low = 0.2, high = 0.1, range = [0, 5], unit = 'px', source = 'x' }",
        );
        assert_eq!(e, "c.toml: d435i.disparity_noise: low 0.2 is above high 0.1");
        // Limit of the code itself, independent of the file's range.
        let e = error("[d435i]\nwindow_radius = { value = 16, range = [0, 99], unit = 'px', source = 'x' }");
        assert_eq!(
            e,
            "c.toml: d435i.window_radius: 16 is outside the range [0, 15] px that the model holds for"
        );
        let e = error("[d435i]\nwindow = 3");
        assert!(e.starts_with("c.toml: d435i.window: unknown field"), "{e}");
    }
}
