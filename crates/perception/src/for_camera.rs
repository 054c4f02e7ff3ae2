//! Detectors for a camera: the one of a name, and the default (`docs/decisions/0037-default-detectors.md`).

use crate::DetectorConfig;
use crate::config::LEARNED;

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

impl DetectorConfig {
    /// Returns the detector of a name for the camera of a name, which sees from `range.0` to `range.1` \[m\]. One with a network fits spheres with the figures of the camera's geometric detector; if
    /// its spheres are those of discs, it finds fruit in the whole range of the camera, if that ends: a disc is seen where noise hides the roundness.
    ///
    /// # Errors
    /// There is no detector of that name, or the range of the camera is out of that of detectors.
    pub fn for_camera(name: &str, camera: &str, range: Option<(f64, f64)>) -> Result<Self, String> {
        if !LEARNED.contains(&name) {
            return Self::named(name);
        }
        let mut config = Self::named(geometric_detector_for(camera))?.with_network(name)?;
        let by_disc = config.network.as_ref().is_some_and(|network| network.disc.is_some());
        if let (true, Some((near, far))) = (by_disc, range)
            && far.is_finite()
        {
            let range = &mut config.segmentation.range;
            *range = range.with_ends(near, far)?;
        }
        Ok(config)
    }
}
