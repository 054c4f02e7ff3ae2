//! Detection of fruit in a depth image, with or without colour.

use crate::gates::Gate;
use crate::geometric::{Candidate, Detection, search};
use crate::image::RgbdImage;
use crate::learned;
use crate::{DetectorConfig, PerceptionError, sizes};
use orchard_geometry::{Image, Intrinsics};

/// Finds fruit in an image. `mask` is true where a pixel must be ignored (robot, ground) and has the image's size.
///
/// A depth that is not a positive finite number, or lies outside the working range, counts as no measurement.
///
/// # Errors
/// The image is empty, sizes disagree, the intrinsics are not those of a pinhole camera, or the detector has a network that looks at colour, and there is none.
pub fn detect<'a>(
    image: impl Into<RgbdImage<'a>>,
    intrinsics: &Intrinsics,
    mask: Option<&Image<bool>>,
    config: &DetectorConfig,
) -> Result<Vec<Detection>, PerceptionError> {
    let found = find(image.into(), intrinsics, mask, config, |refused_by| refused_by.is_none())?;
    Ok(found.into_iter().filter(|c| c.refused_by.is_none()).map(|c| c.detection).collect())
}

/// Returns every sphere that [`detect`] considers, with the gate that refused it, for ablations and tests.
///
/// # Errors
/// Those of [`detect`].
pub fn candidates<'a>(
    image: impl Into<RgbdImage<'a>>,
    intrinsics: &Intrinsics,
    mask: Option<&Image<bool>>,
    config: &DetectorConfig,
) -> Result<Vec<Candidate>, PerceptionError> {
    find(image.into(), intrinsics, mask, config, |_| true)
}

/// Returns the spheres that `wanted` takes by the gate that refused them: of places that a network finds, or of a search.
fn find(
    image: RgbdImage<'_>,
    intrinsics: &Intrinsics,
    mask: Option<&Image<bool>>,
    config: &DetectorConfig,
    wanted: impl Fn(Option<Gate>) -> bool,
) -> Result<Vec<Candidate>, PerceptionError> {
    let mut found = match &config.network {
        Some(figures) => learned::find(image, intrinsics, mask, config, figures)?,
        None => search(image.depth, intrinsics, mask, config, wanted)?,
    };
    // The radius by a disc is not that of the fit, whose deviation is known.
    let by_disc = config.network.as_ref().is_some_and(|figures| figures.disc.is_some());
    if config.fit.use_prior && !by_disc {
        let mut accepted: Vec<&mut Candidate> = found.iter_mut().filter(|c| c.refused_by.is_none()).collect();
        sizes::join(&mut accepted, intrinsics, config);
    }
    Ok(found)
}
