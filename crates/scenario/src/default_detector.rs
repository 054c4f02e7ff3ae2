//! The detector of a camera where nobody names one (`docs/decisions/0037-default-detectors.md`).

use orchard_perception::DetectorConfig;
use orchard_perception::config::LEARNED;

/// Names of the detectors.
pub fn detectors() -> Vec<&'static str> {
    DetectorConfig::FILES.iter().map(|(name, _)| *name).collect()
}

/// Returns the name of the geometric detector of a camera: the one of the camera's name, or `paper` if there is none.
pub fn geometric_detector_for(camera: &str) -> &'static str {
    detectors().into_iter().find(|name| *name == camera).unwrap_or("paper")
}

/// Returns the name of the default detector of a camera, with or without `colour` beside the depth: the network that sees them, for a camera whose own detector tells a score; else
/// [`geometric_detector_for`].
pub fn detector_for(camera: &str, colour: bool) -> &'static str {
    let own = geometric_detector_for(camera);
    let has_score = DetectorConfig::named(own).is_ok_and(|own| own.score.on);
    let [depth_alone, sees_colour] = LEARNED;
    match (has_score, colour) {
        (false, _) => own,
        (true, false) => depth_alone,
        (true, true) => sees_colour,
    }
}
