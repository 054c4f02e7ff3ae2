//! Spheres in regions where another detector, such as a learned one, found a fruit: it says where, this crate says how large and how far.

use crate::gates::Gate;
use crate::geometric::{Candidate, search};
use crate::{DetectorConfig, PerceptionError, sizes};
use orchard_geometry::{DepthImage, Image, Intrinsics};

/// Part of an image.
#[derive(Debug, Clone, PartialEq)]
pub struct Region {
    /// First column \[px\].
    pub left: usize,
    /// First row \[px\].
    pub top: usize,
    /// Pixels that belong to it; its size is that of the region.
    pub inside: Image<bool>,
}

/// Pixels around a region that are looked at, as a share of its width and height: the surroundings are evidence.
const MARGIN: f64 = 0.5;
/// Least overlap (intersection over union) of a region's box with the square around a sphere's disc.
const LEAST_OVERLAP: f64 = 0.2;

/// Returns the sphere of each region, or `None` where none fits. Pixels of the box around a region that do not belong to it are masked.
///
/// Of the spheres whose square overlaps the region's box by a fifth it is the one with the largest product of score and overlap. Since
/// the region says that a fruit is there, a sphere counts as well if its surroundings speak against it; a candidate's `refused_by` tells which gate
/// would have refused it. Not so where size or shape are not those of a fruit: gates of pixels, radius and convexity.
///
/// # Errors
/// Those of [`crate::detect`].
pub fn fit_regions(
    depth: &DepthImage,
    intrinsics: &Intrinsics,
    mask: Option<&Image<bool>>,
    regions: &[Region],
    config: &DetectorConfig,
) -> Result<Vec<Option<Candidate>>, PerceptionError> {
    let mut fitted = fit_each(depth, intrinsics, mask, regions, config)?;
    if config.fit.use_prior {
        let mut found: Vec<&mut Candidate> = fitted.iter_mut().flatten().collect();
        sizes::join(&mut found, intrinsics, config);
    }
    Ok(fitted)
}

/// Finds fruit, each with the size that its own pixels and the prior give.
pub(crate) fn fit_each(
    depth: &DepthImage,
    intrinsics: &Intrinsics,
    mask: Option<&Image<bool>>,
    regions: &[Region],
    config: &DetectorConfig,
) -> Result<Vec<Option<Candidate>>, PerceptionError> {
    regions.iter().map(|region| fit(depth, intrinsics, mask, region, config)).collect()
}

fn fit(
    depth: &DepthImage,
    k: &Intrinsics,
    mask: Option<&Image<bool>>,
    region: &Region,
    config: &DetectorConfig,
) -> Result<Option<Candidate>, PerceptionError> {
    let Some(part) = Part::of(depth, k, mask, region) else { return Ok(None) };
    let size = (region.inside.width(), region.inside.height());
    let mut best: Option<(f64, Candidate)> = None;
    for candidate in search(&part.depth, &part.intrinsics, Some(&part.left_out), config, |_| true)? {
        if matches!(candidate.refused_by, Some(Gate::MinPixels | Gate::Radius | Gate::Convexity)) {
            continue;
        }
        let candidate = part.in_image(candidate);
        let d = &candidate.detection;
        let reach = (d.radius / d.p_camera.z * k.fx, d.radius / d.p_camera.z * k.fy);
        let overlap = box_overlap(
            [d.center_px.0 - reach.0, d.center_px.1 - reach.1, 2.0 * reach.0, 2.0 * reach.1],
            [region.left as f64 - 0.5, region.top as f64 - 0.5, size.0 as f64, size.1 as f64],
        );
        let merit = overlap * d.score;
        if overlap >= LEAST_OVERLAP && best.as_ref().is_none_or(|(most, _)| merit > *most) {
            best = Some((merit, candidate));
        }
    }
    Ok(best.map(|(_, candidate)| candidate))
}

/// A region with its margin, as an image of its own.
pub(crate) struct Part {
    pub(crate) depth: DepthImage,
    pub(crate) intrinsics: Intrinsics,
    /// Pixels that are masked, or in the region's box but not in the region.
    pub(crate) left_out: Image<bool>,
    /// First column and row.
    corner: (usize, usize),
}

impl Part {
    /// Cuts a region out of an image; `None` if nothing is left.
    pub(crate) fn of(
        depth: &DepthImage,
        k: &Intrinsics,
        mask: Option<&Image<bool>>,
        region: &Region,
    ) -> Option<Self> {
        let size = (region.inside.width(), region.inside.height());
        let columns = widened(region.left, size.0, depth.width());
        let rows = widened(region.top, size.1, depth.height());
        let (width, height) = (columns.1.saturating_sub(columns.0), rows.1.saturating_sub(rows.0));
        if width == 0 || height == 0 {
            return None;
        }
        let mut part = DepthImage::filled(width, height, 0.0);
        let mut left_out = Image::filled(width, height, false);
        for v in 0..height {
            for u in 0..width {
                let at = (columns.0 + u, rows.0 + v);
                part[(u, v)] = depth[at];
                let in_box = at.0.checked_sub(region.left).zip(at.1.checked_sub(region.top));
                let other = in_box.is_some_and(|(u, v)| u < size.0 && v < size.1 && !region.inside[(u, v)]);
                left_out[(u, v)] = other || mask.is_some_and(|mask| mask[at]);
            }
        }
        let corner = (columns.0, rows.0);
        let intrinsics =
            Intrinsics { width, height, cx: k.cx - corner.0 as f64, cy: k.cy - corner.1 as f64, ..*k };
        Some(Self { depth: part, intrinsics, left_out, corner })
    }

    /// A candidate of the part with its place in the image.
    pub(crate) fn in_image(&self, mut candidate: Candidate) -> Candidate {
        let (u, v) = candidate.detection.center_px;
        candidate.detection.center_px = (u + self.corner.0 as f64, v + self.corner.1 as f64);
        candidate
    }
}

/// First column and the one behind the last of a region with its margin.
fn widened(first: usize, length: usize, size: usize) -> (usize, usize) {
    let margin = (MARGIN * length as f64).ceil() as usize;
    (first.saturating_sub(margin), first.saturating_add(length).saturating_add(margin).min(size))
}

/// Intersection over union of two boxes (left, top, width, height); 0 without an area.
pub fn box_overlap(a: [f64; 4], b: [f64; 4]) -> f64 {
    let common = |k: usize| ((a[k] + a[k + 2]).min(b[k] + b[k + 2]) - a[k].max(b[k])).max(0.0);
    let both = common(0) * common(1);
    let union = a[2] * a[3] + b[2] * b[3] - both;
    if union > 0.0 { both / union } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use orchard_geometry::Vec3;

    /// Two balls before a wall.
    fn scene() -> (DepthImage, Intrinsics, [Vec3; 2]) {
        let k = Intrinsics::from_vertical_fov(160, 120, 0.9);
        let balls = [Vec3::new(-0.08, 0.0, 0.6), Vec3::new(0.08, 0.02, 0.7)];
        let mut depth = DepthImage::filled(160, 120, 1.2);
        for v in 0..120 {
            for u in 0..160 {
                let ray = k.ray(u as f64, v as f64);
                for c in &balls {
                    let along = ray.dot(c) / ray.norm_squared();
                    let off = (c - ray * along).norm_squared();
                    if off < 0.035 * 0.035 {
                        depth[(u, v)] = (along - (0.035 * 0.035 - off).sqrt() / ray.norm()) as f32;
                    }
                }
            }
        }
        (depth, k, balls)
    }

    fn about(k: &Intrinsics, c: &Vec3, half: usize) -> Region {
        let (u, v) = k.project(c).unwrap();
        let (left, top) = (u.round() as usize - half, v.round() as usize - half);
        Region { left, top, inside: Image::filled(2 * half + 1, 2 * half + 1, true) }
    }

    #[test]
    fn each_region_has_its_sphere() {
        let (depth, k, balls) = scene();
        let regions =
            [about(&k, &balls[1], 7), about(&k, &Vec3::new(0.0, 0.2, 1.2), 7), about(&k, &balls[0], 8)];
        let found = fit_regions(&depth, &k, None, &regions, &DetectorConfig::paper()).unwrap();
        assert!(found[1].is_none(), "the wall has no sphere");
        for (found, ball) in [(&found[0], balls[1]), (&found[2], balls[0])] {
            let Candidate { detection, refused_by, .. } = found.as_ref().unwrap();
            assert!((detection.p_camera - ball).norm() < 1e-4 && refused_by.is_none(), "{detection:?}");
            assert!((detection.radius - 0.035).abs() < 1e-4);
            let (u, v) = k.project(&ball).unwrap();
            assert!((detection.center_px.0 - u).abs() < 0.1 && (detection.center_px.1 - v).abs() < 0.1);
        }
    }

    #[test]
    fn what_the_detector_refuses_by_its_surroundings_counts_in_a_region() {
        let (mut depth, k, balls) = scene();
        // A wall that touches the ball's rim: the surface does not end there.
        let rim = balls[0].z as f32;
        depth.pixels_mut().iter_mut().filter(|z| **z > 1.0).for_each(|z| *z = rim);
        let config = DetectorConfig::paper();
        assert!(crate::detect(&depth, &k, None, &config).unwrap().iter().all(|d| d.p_camera.x > 0.0));
        let found = fit_regions(&depth, &k, None, &[about(&k, &balls[0], 8)], &config).unwrap();
        let candidate = found[0].as_ref().unwrap();
        assert_eq!(candidate.refused_by, Some(Gate::Isolation));
        assert!((candidate.detection.p_camera - balls[0]).norm() < 2e-3);
    }

    #[test]
    fn pixels_outside_the_region_or_masked_count_for_nothing() {
        let (depth, k, balls) = scene();
        let config = DetectorConfig::paper();
        let mut region = about(&k, &balls[0], 8);
        region.inside.pixels_mut().fill(false);
        let fit = |region: &Region, mask: Option<&Image<bool>>| {
            fit_regions(&depth, &k, mask, std::slice::from_ref(region), &config).unwrap().remove(0)
        };
        assert!(fit(&region, None).is_none());
        let all = Image::filled(160, 120, true);
        assert!(fit(&about(&k, &balls[0], 8), Some(&all)).is_none());
        // Regions at the image's edge and beyond it.
        for (left, top) in [(150, 110), (1000, 1000), (usize::MAX, usize::MAX)] {
            let beyond = Region { left, top, inside: Image::filled(30, 30, true) };
            assert!(fit(&beyond, None).is_none());
        }
        let nothing = Region { left: 3, top: 3, inside: Image::filled(0, 0, true) };
        assert!(fit(&nothing, None).is_none());
    }

    #[test]
    fn overlap_by_hand() {
        assert_eq!(box_overlap([0.0, 0.0, 2.0, 2.0], [1.0, 1.0, 2.0, 2.0]), 1.0 / 7.0);
        assert_eq!(box_overlap([0.0, 0.0, 2.0, 2.0], [5.0, 1.0, 2.0, 2.0]), 0.0);
        assert_eq!(box_overlap([0.0; 4], [0.0; 4]), 0.0);
    }
}
