//! What sees and what finds: cameras and detectors by name or from a file.

use orchard_perception::DetectorConfig;
use orchard_spec::camera::CameraSpec;

use crate::failure::Failure;

/// A camera by its name or from its file.
pub fn read_camera(camera: &str) -> Result<CameraSpec, Failure> {
    read("--camera", camera, CameraSpec::named, |file, text| {
        CameraSpec::from_toml(file, text).map_err(|e| e.to_string())
    })
}

/// A detector by its name or from its file; `option` names it in errors.
pub fn read_detector(option: &str, detector: &str) -> Result<DetectorConfig, Failure> {
    read(option, detector, DetectorConfig::named, |file, text| {
        DetectorConfig::from_toml(file, text).map_err(|e| e.to_string())
    })
}

/// Name of the detector that is made for a camera.
pub fn detector_for(camera: &CameraSpec) -> &'static str {
    let made_for = DetectorConfig::FILES.iter().find(|(name, _)| *name == camera.name());
    made_for.map_or("paper", |(name, _)| name)
}

fn read<T>(
    option: &str,
    value: &str,
    named: impl FnOnce(&str) -> Result<T, String>,
    from_toml: impl FnOnce(&str, &str) -> Result<T, String>,
) -> Result<T, Failure> {
    if !value.ends_with(".toml") {
        return named(value).map_err(|e| Failure::BadInput(format!("{option}: {e}")));
    }
    let text =
        std::fs::read_to_string(value).map_err(|e| Failure::BadInput(format!("{option} {value}: {e}")))?;
    from_toml(value, &text).map_err(Failure::BadInput)
}
