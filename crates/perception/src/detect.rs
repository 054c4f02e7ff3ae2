//! Detection of fruit in a depth image.

use crate::gates::Gate;
use crate::geometric::{Candidate, Detection, search};
use crate::learned;
use crate::{DetectorConfig, PerceptionError, sizes};
use orchard_geometry::{DepthImage, Image, Intrinsics};

/// Finds fruit in a depth image \[m\]. `mask` is true where a pixel must be ignored (robot, ground) and has the image's size.
///
/// A pixel that is not a positive finite number, or lies outside the working range, counts as no measurement.
///
/// # Errors
/// The image is empty, sizes disagree, the intrinsics are not those of a pinhole camera, or the detector has a network that looks at colour.
pub fn detect(
    depth: &DepthImage,
    intrinsics: &Intrinsics,
    mask: Option<&Image<bool>>,
    config: &DetectorConfig,
) -> Result<Vec<Detection>, PerceptionError> {
    let found = find((depth, None), intrinsics, mask, config, |refused_by| refused_by.is_none())?;
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
    find((depth, None), intrinsics, mask, config, |_| true)
}

/// Returns the same as [`candidates`] for an image that may have colour (sRGB), registered to depth and of its size. Only a network that sees colour looks at it.
///
/// # Errors
/// Those of [`detect`]; the network looks at colour, and there is none.
pub fn candidates_in(
    depth: &DepthImage,
    colour: Option<&Image<[u8; 3]>>,
    intrinsics: &Intrinsics,
    mask: Option<&Image<bool>>,
    config: &DetectorConfig,
) -> Result<Vec<Candidate>, PerceptionError> {
    find((depth, colour), intrinsics, mask, config, |_| true)
}

/// Returns the spheres that `wanted` takes by the gate that refused them: of places that a network finds, or of a search.
fn find(
    (depth, colour): (&DepthImage, Option<&Image<[u8; 3]>>),
    intrinsics: &Intrinsics,
    mask: Option<&Image<bool>>,
    config: &DetectorConfig,
    wanted: impl Fn(Option<Gate>) -> bool,
) -> Result<Vec<Candidate>, PerceptionError> {
    let mut found = match &config.network {
        Some(figures) => learned::find((depth, colour), intrinsics, mask, config, figures)?,
        None => search(depth, intrinsics, mask, config, wanted)?,
    };
    // The radius by a disc is not that of the fit, whose deviation is known.
    let by_disc = config.network.as_ref().is_some_and(|figures| figures.disc.is_some());
    if config.fit.use_prior && !by_disc {
        let mut accepted: Vec<&mut Candidate> = found.iter_mut().filter(|c| c.refused_by.is_none()).collect();
        sizes::join(&mut accepted, intrinsics, config);
    }
    Ok(found)
}
