//! Detection of fruit in a depth image.

use crate::gates::Gate;
use crate::geometric::{Candidate, Detection, search};
use crate::learned;
use crate::{DetectorConfig, PerceptionError};
use orchard_geometry::{DepthImage, Image, Intrinsics};

/// Finds fruit in a depth image \[m\]. `mask` is true where a pixel must be ignored (robot, ground) and has the image's size.
///
/// A pixel that is not a positive finite number, or lies outside the working range, counts as no measurement.
///
/// # Errors
/// The image is empty, sizes disagree, or the intrinsics are not those of a pinhole camera.
pub fn detect(
    depth: &DepthImage,
    intrinsics: &Intrinsics,
    mask: Option<&Image<bool>>,
    config: &DetectorConfig,
) -> Result<Vec<Detection>, PerceptionError> {
    let found = find(depth, intrinsics, mask, config, |refused_by| refused_by.is_none())?;
    Ok(found.into_iter().filter(|c| c.refused_by.is_none()).map(|c| c.detection).collect())
}

/// Returns every sphere that [`detect`] considers, with the gate that refused it, for ablations and tests.
///
/// # Errors
/// Those of [`detect`].
pub fn candidates(
    depth: &DepthImage,
    intrinsics: &Intrinsics,
    mask: Option<&Image<bool>>,
    config: &DetectorConfig,
) -> Result<Vec<Candidate>, PerceptionError> {
    find(depth, intrinsics, mask, config, |_| true)
}

/// Returns the spheres that `wanted` takes by the gate that refused them: of places that a network finds, or of a search.
fn find(
    depth: &DepthImage,
    intrinsics: &Intrinsics,
    mask: Option<&Image<bool>>,
    config: &DetectorConfig,
    wanted: impl Fn(Option<Gate>) -> bool,
) -> Result<Vec<Candidate>, PerceptionError> {
    match &config.network {
        Some(figures) => learned::find(depth, intrinsics, mask, config, figures),
        None => search(depth, intrinsics, mask, config, wanted),
    }
}
