//! Registration: moves every depth of an imager to where another camera sees it.

use orchard_geometry::{DepthImage, Image, Intrinsics, Vec3};

/// Returns the depth image of a camera whose axes are parallel to an imager's and whose lens lies `right` \[m\] of the imager's, from the
/// imager's depths \[m\], 0 without a measurement. Of two depths in a pixel the nearer counts.
///
/// Depth is interpolated within each square of four neighbouring pixels that are valid and differ by at most `bridge` \[m\]. With
/// `bridge` zero nothing is interpolated, and each pixel covers its own rectangle.
pub(super) fn register(
    depth: &DepthImage,
    imager: &Intrinsics,
    camera: &Intrinsics,
    right: f64,
    bridge: f64,
) -> DepthImage {
    let mut out = Image::filled(camera.width, camera.height, 0.0_f32);
    let (width, height) = (depth.width(), depth.height());
    let seen = |u: f64, v: f64, z: f64| seen_at(imager, camera, right, (u, v, z));
    if bridge == 0.0 {
        for v in 0..height {
            for u in 0..width {
                let z = f64::from(depth[(u, v)]);
                if z > 0.0 {
                    let (u, v) = (u as f64, v as f64);
                    fill(&mut out, seen(u - HALF, v - HALF, z), seen(u + HALF, v + HALF, z));
                }
            }
        }
        return out;
    }
    for v in 1..height {
        for u in 1..width {
            let corners = [(u - 1, v - 1), (u, v - 1), (u - 1, v), (u, v)];
            let z = corners.map(|at| f64::from(depth[at]));
            let (nearest, farthest) =
                z.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), &z| (a.min(z), b.max(z)));
            if nearest > 0.0 && farthest - nearest <= bridge {
                let [a, b, c, d] = [0, 1, 2, 3].map(|k| seen(corners[k].0 as f64, corners[k].1 as f64, z[k]));
                triangle(&mut out, [a, b, c]);
                triangle(&mut out, [d, c, b]);
            }
        }
    }
    out
}

/// The pixels of a camera that those of an imager beside it cover, for kernels that register images elsewhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoveredPixels {
    /// Intrinsics of the imager.
    pub imager: Intrinsics,
    /// Intrinsics of the camera; the axes of both are parallel.
    pub camera: Intrinsics,
    /// Position of the camera to the right of the imager \[m\].
    pub right: f64,
    /// Largest difference of depth between neighbouring pixels across which depth is interpolated \[m\]; 0: none is, and each pixel covers its own rectangle.
    pub bridge: f64,
}

impl CoveredPixels {
    /// Columns and rows of the camera.
    pub fn size(&self) -> (usize, usize) {
        (self.camera.width, self.camera.height)
    }

    /// First column of the camera that each column of the imager covers at a depth \[m\], and the end of the last, then the same of rows. A pixel covers the columns up to the first
    /// of the next.
    pub fn firsts(&self, depth: f32) -> impl Iterator<Item = u32> {
        let Self { imager, camera, right, .. } = *self;
        let z = f64::from(depth);
        let columns = (0..=imager.width).map(move |u| {
            let at = seen_at(&imager, &camera, right, (u as f64 - HALF, 0.0, z)).0;
            first(at, camera.width)
        });
        let rows = (0..=imager.height).map(move |v| {
            let at = seen_at(&imager, &camera, right, (0.0, v as f64 - HALF, z)).1;
            first(at, camera.height)
        });
        columns.chain(rows)
    }
}

/// From the middle of a pixel to its edge.
const HALF: f64 = 0.5;

/// First whole number from a position on, within the image or its end.
fn first(at: f64, size: usize) -> u32 {
    (at.ceil().max(0.0) as usize).min(size) as u32
}

/// Column and row at which a camera, `right` \[m\] of an imager, sees a point that the imager sees.
fn seen_at(imager: &Intrinsics, camera: &Intrinsics, right: f64, (u, v, z): Point) -> Point {
    let p = imager.back_project(u, v, z) - Vec3::new(right, 0.0, 0.0);
    (camera.fx * p.x / z + camera.cx, camera.fy * p.y / z + camera.cy, z)
}

/// Pixel position and depth.
type Point = (f64, f64, f64);

/// First and last whole number within [low, high] and the image.
fn span(low: f64, high: f64, size: usize) -> std::ops::Range<usize> {
    // A float-to-integer cast saturates.
    let end = ((high.floor() + 1.0).max(0.0) as usize).min(size);
    (low.ceil().max(0.0) as usize).min(end)..end
}

fn nearer(pixel: &mut f32, z: f64) {
    if *pixel == 0.0 || z < f64::from(*pixel) {
        *pixel = z as f32;
    }
}

/// Sets the pixels of a rectangle whose ends are excluded on the right and below.
fn fill(out: &mut DepthImage, (u0, v0, z): Point, (u1, v1, _): Point) {
    let (columns, rows) = (span(u0, u1, out.width()), span(v0, v1, out.height()));
    for v in rows {
        for u in columns.clone() {
            if (u as f64) < u1 && (v as f64) < v1 {
                nearer(&mut out[(u, v)], z);
            }
        }
    }
}

/// Sets the pixels of a triangle, its edges included, to depths that are linear in the image. A triangle that the camera sees from behind is
/// hidden by what it is behind, and left out.
fn triangle(out: &mut DepthImage, [a, b, c]: [Point; 3]) {
    let area = (b.0 - a.0) * (c.1 - a.1) - (c.0 - a.0) * (b.1 - a.1);
    if area <= 0.0 {
        return;
    }
    let least = |k: fn(&Point) -> f64| k(&a).min(k(&b)).min(k(&c));
    let most = |k: fn(&Point) -> f64| k(&a).max(k(&b)).max(k(&c));
    for v in span(least(|p| p.1), most(|p| p.1), out.height()) {
        for u in span(least(|p| p.0), most(|p| p.0), out.width()) {
            let (x, y) = (u as f64 - a.0, v as f64 - a.1);
            let to_b = (x * (c.1 - a.1) - y * (c.0 - a.0)) / area;
            let to_c = (y * (b.0 - a.0) - x * (b.1 - a.1)) / area;
            if to_b >= 0.0 && to_c >= 0.0 && to_b + to_c <= 1.0 {
                nearer(&mut out[(u, v)], a.2 + to_b * (b.2 - a.2) + to_c * (c.2 - a.2));
            }
        }
    }
}
