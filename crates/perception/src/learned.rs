//! Fruit by a network: it says where in the image a fruit is, and the fit says how far and how large.

use crate::config::Network as Figures;
use crate::disc::{self, Disc};
use crate::geometric::{Candidate, without_duplicates};
use crate::image::RgbdImage;
use crate::onnx::{self, CELL, FIELDS, FIELDS_WITH_SHARE, MULTIPLE};
use crate::region::{Region, fit_each};
use crate::sphere::Sphere;
use crate::{DetectorConfig, Gate, PerceptionError};
use orchard_geometry::{Image, Intrinsics};
use orchard_network::Network;

/// A place of the image where the network sees a fruit.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Peak {
    /// Probability that it is one.
    score: f64,
    /// Column and row of its centre \[px\].
    center: (f64, f64),
    /// Radius \[px\].
    radius: f64,
}

/// Finds fruit in an image of depth, and of colour if the network sees it; the fit and its gates are those of a region that another detector has found ([`crate::fit_regions`]).
pub(crate) fn find(
    image: RgbdImage<'_>,
    intrinsics: &Intrinsics,
    mask: Option<&Image<bool>>,
    config: &DetectorConfig,
    figures: &Figures,
) -> Result<Vec<Candidate>, PerceptionError> {
    let RgbdImage { depth, colour } = image;
    crate::cloud::check(depth, intrinsics, mask)?;
    let unread =
        || PerceptionError::Network(format!("is not read: {}", figures.onnx.file().unwrap_or_default()));
    let network = figures.onnx.network().ok_or_else(unread)?;
    if let Some(colour) = colour.filter(|c| (c.width(), c.height()) != (depth.width(), depth.height())) {
        return Err(PerceptionError::SizeMismatch {
            what: "the colour image",
            width: colour.width(),
            height: colour.height(),
            depth_width: depth.width(),
            depth_height: depth.height(),
        });
    }
    if figures.onnx.sees_colour() && colour.is_none() {
        return Err(PerceptionError::NoColour);
    }
    let (peaks, shares) = places(network, image, intrinsics, mask, figures)?;
    let size = (depth.width(), depth.height());
    let region = |peak: Peak| Some((peak, peak.region(size, shares.as_ref())?));
    let (seen, regions): (Vec<Peak>, Vec<Region>) = peaks.into_iter().filter_map(region).unzip();
    let fitted = fit_each(depth, intrinsics, mask, &regions, config)?;
    let fitted = match &figures.disc {
        None => fitted,
        Some(deviation) => {
            let by_disc = |((peak, region), fit): ((&Peak, &Region), Option<Candidate>)| {
                let disc = Disc { center: peak.center, radius: peak.radius };
                let depths = (fit.as_ref(), deviation.si());
                let sphere = disc::sphere(depth, intrinsics, mask, (&disc, region), depths, config)?;
                Ok(sphere.or(fit))
            };
            seen.iter().zip(&regions).zip(fitted).map(by_disc).collect::<Result<_, _>>()?
        }
    };
    let mut found: Vec<Candidate> = seen
        .iter()
        .zip(fitted)
        .filter_map(|(peak, fit)| {
            let mut candidate = fit?;
            let score = figures.score(peak.score, candidate.detection.score);
            candidate.detection.score = score;
            candidate.refused_by = (score < config.score.least.si()).then_some(Gate::Score);
            Some(candidate)
        })
        .collect();
    // The sort is stable: equal scores stay in image order.
    found.sort_by(|a, b| b.detection.score.total_cmp(&a.detection.score));
    Ok(without_duplicates(found, |c| {
        let sphere = Sphere { center: c.detection.p_camera, radius: c.detection.radius };
        c.refused_by.is_none().then_some(sphere)
    }))
}

impl Peak {
    /// The square around its disc, in an image of a size, of which the pixels that show fruit count; `None` if it lies outside.
    fn region(&self, (width, height): (usize, usize), shares: Option<&Shares>) -> Option<Region> {
        let span = |center: f64, size: usize| {
            let first = (center - self.radius).round().max(0.0);
            // A float-to-integer cast saturates, and makes 0 of NaN.
            let end = ((center + self.radius).round() + 1.0).clamp(0.0, size as f64);
            (first as usize, end as usize)
        };
        let (columns, rows) = (span(self.center.0, width), span(self.center.1, height));
        let inside = (columns.1.checked_sub(columns.0)?, rows.1.checked_sub(rows.0)?);
        (inside.0 > 0 && inside.1 > 0).then(|| {
            let mut region =
                Region { left: columns.0, top: rows.0, inside: Image::filled(inside.0, inside.1, true) };
            if let Some(shares) = shares {
                let mut seen = Image::filled(inside.0, inside.1, 0.0);
                for v in 0..inside.1 {
                    for u in 0..inside.0 {
                        seen[(u, v)] = shares.at(columns.0 + u, rows.0 + v);
                    }
                }
                let least = HALF * seen.pixels().iter().copied().fold(0.0, f32::max);
                for (inside, share) in region.inside.pixels_mut().iter_mut().zip(seen.pixels()) {
                    *inside = *share >= least;
                }
            }
            region
        })
    }
}

/// A pixel counts as fruit if the share around it is at least this part of the largest in its region. A network that is not sure of a fruit is not sure of its pixels either.
const HALF: f32 = 0.5;

/// Share of the pixels around a place that show fruit, as the network sees it.
struct Shares {
    /// Cells, row by row.
    cells: Vec<f32>,
    columns: usize,
    rows: usize,
    /// Pixels of the image from cell to cell.
    spacing: f32,
}

impl Shares {
    /// The share at a pixel, linear between the centres of cells.
    fn at(&self, u: usize, v: usize) -> f32 {
        let place = |pixel: usize, count: usize| {
            let at = ((pixel as f32 + 0.5) / self.spacing - 0.5).clamp(0.0, (count - 1) as f32);
            let low = at as usize;
            (low, (low + 1).min(count - 1), at - low as f32)
        };
        let ((left, right, across), (top, bottom, down)) = (place(u, self.columns), place(v, self.rows));
        let row = |row: usize| {
            let cells = &self.cells[row * self.columns..];
            cells[left] + across * (cells[right] - cells[left])
        };
        row(top) + down * (row(bottom) - row(top))
    }
}

/// Places where the network sees a fruit, in the order of the image's rows: cells with a larger probability than their neighbours. And where pixels show fruit, if the network tells.
fn places(
    network: &Network,
    RgbdImage { depth, colour }: RgbdImage<'_>,
    intrinsics: &Intrinsics,
    mask: Option<&Image<bool>>,
    figures: &Figures,
) -> Result<(Vec<Peak>, Option<Shares>), PerceptionError> {
    let focal = (intrinsics.fx * intrinsics.fy).sqrt();
    // Every so many columns and rows are looked at.
    let step = ((focal / figures.focal.si()) as usize).clamp(1, depth.width().max(depth.height()));
    let taken = (depth.width().div_ceil(step), depth.height().div_ceil(step));
    let (width, height) = (taken.0.next_multiple_of(MULTIPLE), taken.1.next_multiple_of(MULTIPLE));
    let image = |channels| match colour.filter(|_| channels > 1) {
        Some(colour) => means(colour, step, (width, height)),
        None => {
            let mut input = vec![0.0; width * height];
            for (row, line) in input.chunks_mut(width).take(taken.1).enumerate() {
                for (column, z) in line.iter_mut().take(taken.0).enumerate() {
                    let at = (step * column, step * row);
                    if depth[at].is_finite() && !mask.is_some_and(|mask| mask[at]) {
                        *z = depth[at].max(0.0);
                    }
                }
            }
            input
        }
    };
    let map = onnx::run(network, (height, width), image, (focal / step as f64) as f32);
    let map = map.map_err(|_| PerceptionError::TooLarge { width, height })?;
    let map = map.as_f32().unwrap_or_default();
    let (columns, rows) = (width / CELL, height / CELL);
    let (cells, least) = (columns * rows, figures.least.si());
    if map.len() != FIELDS * cells && map.len() != FIELDS_WITH_SHARE * cells {
        let problem = format!("gives {} numbers for {cells} cells of {FIELDS}", map.len());
        return Err(PerceptionError::Network(problem));
    }
    let spacing = (step * CELL) as f32;
    let shares = map.get(FIELDS * cells..FIELDS_WITH_SHARE * cells);
    let shares = shares.map(|cells| Shares { cells: cells.to_vec(), columns, rows, spacing });
    let mut peaks = Vec::new();
    for row in 0..rows {
        for column in 0..columns {
            let at = row * columns + column;
            let score = map[at];
            if f64::from(score) < least {
                continue;
            }
            let around = (row.saturating_sub(1)..(row + 2).min(rows)).flat_map(|v| {
                (column.saturating_sub(1)..(column + 2).min(columns)).map(move |u| v * columns + u)
            });
            // Of equal neighbours the first is the peak.
            if around.into_iter().any(|other| map[other] > score || (map[other] == score && other < at)) {
                continue;
            }
            let field = |k: usize| f64::from(map[k * cells + at]);
            let pixel =
                |cell: usize, offset: f64| step as f64 * ((cell as f64 + 0.5 + offset) * CELL as f64 - 0.5);
            peaks.push(Peak {
                score: f64::from(score),
                center: (pixel(column, field(1)), pixel(row, field(2))),
                radius: step as f64 * field(3),
            });
        }
    }
    Ok((peaks, shares))
}

/// Mean colour of each block of `step` x `step` pixels, from 0 to 1: red, then green, then blue, each row by row, with 0 beyond the image.
fn means(colour: &Image<[u8; 3]>, step: usize, (width, height): (usize, usize)) -> Vec<f32> {
    let mut out = vec![0.0; 3 * width * height];
    let span = |block: usize, size: usize| (block * step).min(size)..((block + 1) * step).min(size);
    for row in 0..height {
        for column in 0..width {
            let (mut sums, mut count) = ([0_u32; 3], 0_u32);
            for v in span(row, colour.height()) {
                for u in span(column, colour.width()) {
                    let pixel = colour[(u, v)];
                    (0..3).for_each(|k| sums[k] += u32::from(pixel[k]));
                    count += 1;
                }
            }
            for (k, sum) in sums.into_iter().enumerate().filter(|_| count > 0) {
                out[(k * height + row) * width + column] = sum as f32 / (255 * count) as f32;
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Detection, detect};
    use orchard_geometry::{DepthImage, Vec3};

    const K: Intrinsics = Intrinsics { width: 160, height: 120, fx: 150.0, fy: 150.0, cx: 79.5, cy: 59.5 };

    /// Balls of 40 mm before nothing.
    fn scene(balls: &[Vec3]) -> DepthImage {
        let mut depth = DepthImage::filled(K.width, K.height, 0.0);
        for v in 0..K.height {
            for u in 0..K.width {
                let ray = K.ray(u as f64, v as f64);
                let hits = balls.iter().filter_map(|ball| {
                    let (a, b) = (ray.dot(&ray), ray.dot(ball));
                    let inner = b * b - a * (ball.dot(ball) - 0.04 * 0.04);
                    (inner > 0.0).then(|| (b - inner.sqrt()) / a)
                });
                depth[(u, v)] = hits.fold(f64::INFINITY, f64::min) as f32;
            }
        }
        depth
    }

    fn learned() -> DetectorConfig {
        DetectorConfig::named("learned").unwrap()
    }

    /// Balls are found to a pixel, which is 5 mm and 6 mm wide at their distances, and their radii to a tenth: they are those of discs.
    #[test]
    fn balls_are_found_where_they_are() {
        let balls = [Vec3::new(-0.15, 0.05, 0.7), Vec3::new(0.2, -0.1, 0.9)];
        let mut found = detect(&scene(&balls), &K, None, &learned()).unwrap();
        found.sort_by(|a, b| a.p_camera.x.total_cmp(&b.p_camera.x));
        assert_eq!(found.len(), 2, "{found:?}");
        for (Detection { p_camera, radius, score, .. }, ball) in found.iter().zip(&balls) {
            assert!((p_camera - ball).norm() < ball.z / K.fx, "{p_camera}");
            assert!((radius - 0.04).abs() < 4e-3 && *score > 0.4, "{radius} {score}");
        }
    }

    /// The network thins out a finer image, so a ball of twice the size in pixels is found at the same place.
    #[test]
    fn finer_images_are_thinned_out() {
        let ball = Vec3::new(0.1, 0.0, 0.8);
        let depth = scene(&[ball]);
        let step = 6;
        let (width, height) = (step * K.width, step * K.height);
        let mut fine = DepthImage::filled(width, height, 0.0);
        for v in 0..height {
            for u in 0..width {
                fine[(u, v)] = depth[(u / step, v / step)];
            }
        }
        let by = step as f64;
        let middle = 0.5 * (by - 1.0);
        let k = Intrinsics {
            width,
            height,
            fx: by * K.fx,
            fy: by * K.fy,
            cx: by * K.cx + middle,
            cy: by * K.cy + middle,
        };
        let found = detect(&fine, &k, None, &learned()).unwrap();
        assert_eq!(found.len(), 1, "{found:?}");
        assert!((found[0].p_camera - ball).norm() < 5e-3, "{:?}", found[0]);
    }

    /// With colour a red ball is found, to its ray exactly and to a few millimetres in depth; without it, or with colour of another size, the detector says so.
    #[test]
    fn a_network_that_sees_colour_needs_it() {
        let config = DetectorConfig::named("learned-colour").unwrap();
        assert!(config.sees_colour() && !learned().sees_colour());
        let ball = Vec3::new(0.1, -0.05, 0.8);
        let depth = scene(&[ball]);
        let mut colour = Image::filled(K.width, K.height, [120, 160, 210]);
        for (shown, z) in colour.pixels_mut().iter_mut().zip(depth.pixels()) {
            if z.is_finite() {
                *shown = [150, 30, 35];
            }
        }
        let found = |colour| crate::candidates(RgbdImage { depth: &depth, colour }, &K, None, &config);
        let candidates = found(Some(&colour)).unwrap();
        let accepted: Vec<_> = candidates.iter().filter(|c| c.refused_by.is_none()).collect();
        assert_eq!(accepted.len(), 1, "{candidates:?}");
        let p = accepted[0].detection.p_camera;
        assert!((p - ball).norm() < 6e-3, "{p}");
        assert_eq!(found(None).unwrap_err(), PerceptionError::NoColour);
        assert_eq!(detect(&depth, &K, None, &config).unwrap_err(), PerceptionError::NoColour);
        let small = Image::filled(8, 6, [0; 3]);
        let refused = found(Some(&small)).unwrap_err().to_string();
        assert_eq!(refused, "the colour image is 8 x 6, the depth image 160 x 120");
        let mut unread = learned();
        let named = crate::Onnx::try_from("mine.onnx".to_owned()).unwrap();
        unread.network.as_mut().unwrap().onnx = named;
        let refused = detect(&depth, &K, None, &unread).unwrap_err().to_string();
        assert_eq!(refused, "the network of the detector is not read: mine.onnx");
    }

    /// Colour is thinned out by means over blocks, which are smaller at the edge.
    #[test]
    fn colour_is_thinned_out_by_means() {
        let mut colour = Image::filled(3, 2, [0; 3]);
        colour[(0, 0)] = [255, 0, 51];
        colour[(2, 1)] = [0, 255, 0];
        assert_eq!(means(&colour, 2, (2, 2)), [0.25, 0.0, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.05, 0.0, 0.0, 0.0]);
    }

    /// Shares are those of the cells at their centres, linear between them, and constant beyond the outermost.
    #[test]
    fn shares_are_linear_between_cells() {
        let shares = Shares { cells: vec![0.0, 1.0, 0.5, 0.5], columns: 2, rows: 2, spacing: 3.0 };
        let at = [(1, 1), (4, 1), (2, 1), (1, 4), (0, 0), (5, 0), (1, 2)].map(|(u, v)| shares.at(u, v));
        let expected = [0.0, 1.0, 1.0 / 3.0, 0.5, 0.0, 1.0, 0.5 / 3.0];
        assert!(at.iter().zip(expected).all(|(at, expected)| (at - expected).abs() < 1e-6), "{at:?}");
        let peak = Peak { score: 1.0, center: (2.5, 1.0), radius: 2.0 };
        let region = peak.region((6, 6), Some(&shares)).unwrap();
        assert_eq!((region.left, region.top, region.inside.width()), (1, 0, 5));
        assert_eq!(
            (0..5).map(|u| region.inside[(u, 1)]).collect::<Vec<_>>(),
            [false, false, true, true, true]
        );
        // Half as sure of all pixels, it takes the same ones.
        let faint = Shares { cells: shares.cells.iter().map(|share| 0.5 * share).collect(), ..shares };
        assert_eq!(peak.region((6, 6), Some(&faint)), peak.region((6, 6), Some(&shares)));
        assert!(peak.region((6, 6), None).unwrap().inside.pixels().iter().all(|inside| *inside));
    }

    #[test]
    fn masked_fruit_and_images_without_any_are_empty() {
        let depth = scene(&[Vec3::new(0.0, 0.0, 0.7)]);
        let all = Image::filled(K.width, K.height, true);
        assert_eq!(detect(&depth, &K, Some(&all), &learned()).unwrap(), []);
        for z in [0.0, -1.0, f32::NAN, f32::INFINITY, 0.8] {
            for (width, height) in [(1, 1), (1, 40), (33, 17)] {
                let k = Intrinsics { width, height, ..K };
                assert_eq!(detect(&DepthImage::filled(width, height, z), &k, None, &learned()).unwrap(), []);
            }
        }
    }

    #[test]
    fn a_camera_of_extreme_focal_length_is_no_panic() {
        let depth = scene(&[Vec3::new(0.0, 0.0, 0.7)]);
        for f in [1e-3, 1e12] {
            let k = Intrinsics { fx: f, fy: f, ..K };
            assert!(detect(&depth, &k, None, &learned()).is_ok());
        }
        let too_large = DepthImage::filled(5000, 5000, 0.0);
        let k = Intrinsics { width: 5000, height: 5000, ..K };
        let refused = detect(&too_large, &k, None, &learned()).unwrap_err();
        assert!(matches!(refused, PerceptionError::TooLarge { .. }), "{refused}");
    }
}
