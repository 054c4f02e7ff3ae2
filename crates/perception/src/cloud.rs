//! Point cloud: back-projection of a depth image to points in the camera frame.

use crate::PerceptionError;
use orchard_geometry::{DepthImage, Image, Intrinsics, Vec3};

/// Number of pixels that are summed up side by side.
pub(crate) const LANES: usize = 4;

/// State of a pixel for the detector.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Pixel {
    /// A point within the working range.
    Usable,
    /// A point outside the working range.
    OutOfRange,
    /// Robot or ground, to be ignored.
    Masked,
    /// No measurement.
    Empty,
}

/// A depth image with the points of its pixels.
#[derive(Debug, Clone)]
pub(crate) struct Cloud {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Measured depth, row by row \[m\]; zero without a measurement.
    z: Vec<f64>,
    /// Depth of usable pixels \[m\]; zero elsewhere.
    usable_z: Vec<f64>,
    /// Depths and slopes of the columns in f32, for sums of four pixels at once.
    short_z: Vec<f32>,
    short_x: Vec<f32>,
    pixels: Vec<Pixel>,
    /// Slopes x/z of the columns and y/z of the rows.
    slope_x: Vec<f64>,
    slope_y: Vec<f64>,
    /// Geometric mean of the focal lengths \[px\].
    pub(crate) focal: f64,
    /// Intrinsics of the pixels that the cloud has.
    pub(crate) intrinsics: Intrinsics,
    /// Columns and rows of the image for each of the cloud's.
    pub(crate) step: usize,
}

/// Pixels of a rectangle, the ends excluded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Rectangle {
    pub(crate) u: (usize, usize),
    pub(crate) v: (usize, usize),
}

/// Pixels side by side in a row.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Row<'a> {
    /// Column and row of the first pixel, and its index.
    pub(crate) u: usize,
    pub(crate) v: usize,
    pub(crate) first: usize,
    /// Slopes x/z of the pixels and y/z of the row.
    pub(crate) x: &'a [f64],
    pub(crate) y: f64,
    /// Measured depth \[m\]; zero without a measurement.
    pub(crate) z: &'a [f64],
    /// Depth of usable pixels \[m\]; zero elsewhere.
    pub(crate) usable_z: &'a [f64],
    pub(crate) pixels: &'a [Pixel],
}

impl Rectangle {
    pub(crate) fn count(&self) -> usize {
        (self.u.1 - self.u.0) * (self.v.1 - self.v.0)
    }
}

impl Cloud {
    pub(crate) fn new(
        depth: &DepthImage,
        intrinsics: &Intrinsics,
        mask: Option<&Image<bool>>,
        range: (f64, f64),
        step: usize,
    ) -> Result<Self, PerceptionError> {
        check(depth, intrinsics, mask)?;
        let step = step.max(1);
        let intrinsics = every(intrinsics, step);
        let Intrinsics { width, height, .. } = intrinsics;
        let measured = |z: f32| if z.is_finite() && z > 0.0 { f64::from(z) } else { 0.0 };
        let (mut z, mut pixels) = (vec![0.0; width * height], vec![Pixel::Empty; width * height]);
        for v in 0..height {
            let columns = (v * width..(v + 1) * width).zip((step * v * depth.width()..).step_by(step));
            for (at, taken) in columns {
                z[at] = measured(depth.pixels()[taken]);
                pixels[at] = match z[at] {
                    _ if mask.is_some_and(|mask| mask.pixels()[taken]) => Pixel::Masked,
                    z if z <= 0.0 => Pixel::Empty,
                    z if (range.0..=range.1).contains(&z) => Pixel::Usable,
                    _ => Pixel::OutOfRange,
                };
            }
        }
        let usable = |(&z, &pixel): (&f64, &Pixel)| if pixel == Pixel::Usable { z } else { 0.0 };
        let usable_z: Vec<f64> = z.iter().zip(&pixels).map(usable).collect();
        let slope_x: Vec<f64> = (0..width).map(|u| intrinsics.ray(u as f64, 0.0).x).collect();
        let short = |long: &[f64]| long.iter().map(|x| *x as f32).collect();
        let (short_z, short_x) = (short(&usable_z), short(&slope_x));
        let slope_y = (0..height).map(|v| intrinsics.ray(0.0, v as f64).y).collect();
        let focal = (intrinsics.fx * intrinsics.fy).sqrt();
        Ok(Self {
            width,
            height,
            z,
            usable_z,
            short_z,
            short_x,
            pixels,
            slope_x,
            slope_y,
            focal,
            intrinsics,
            step,
        })
    }

    /// Returns the number of pixels.
    pub(crate) fn len(&self) -> usize {
        self.pixels.len()
    }

    /// Returns column and row of a pixel.
    pub(crate) fn uv(&self, i: usize) -> (usize, usize) {
        (i % self.width, i / self.width)
    }

    /// Returns the measured depth of a pixel \[m\]; zero without a measurement.
    pub(crate) fn z(&self, i: usize) -> f64 {
        self.z[i]
    }

    /// Returns the depth of a usable pixel \[m\]; zero elsewhere.
    pub(crate) fn usable_z(&self, i: usize) -> f64 {
        self.usable_z[i]
    }

    /// Returns the same of several pixels side by side.
    pub(crate) fn usable_row(&self, pixels: std::ops::RangeInclusive<usize>) -> &[f64] {
        &self.usable_z[pixels]
    }

    /// Returns the state of a pixel.
    pub(crate) fn pixel(&self, i: usize) -> Pixel {
        self.pixels[i]
    }

    /// Returns the direction of a pixel's ray in the camera frame, scaled to z = 1.
    pub(crate) fn ray(&self, u: usize, v: usize) -> Vec3 {
        Vec3::new(self.slope_x[u], self.slope_y[v], 1.0)
    }

    /// Returns the point of a pixel in the camera frame \[m\]; zero without a measurement.
    pub(crate) fn point(&self, i: usize) -> Vec3 {
        let (u, v) = self.uv(i);
        self.ray(u, v) * self.z[i]
    }

    /// Returns the points of pixels in the camera frame \[m\].
    pub(crate) fn points(&self, pixels: &[usize]) -> Vec<Vec3> {
        let mut row = 0;
        let point = |&i: &usize| {
            // A division takes longer than the point; pixels come row by row.
            if !(row * self.width..(row + 1) * self.width).contains(&i) {
                row = i / self.width;
            }
            self.ray(i - row * self.width, row) * self.z[i]
        };
        pixels.iter().map(point).collect()
    }

    /// Returns the pixels right, left, below and above; `None` beyond the image's edge.
    pub(crate) fn neighbours(&self, i: usize) -> [Option<usize>; 4] {
        let (u, v) = self.uv(i);
        [
            (u + 1 < self.width).then(|| i + 1),
            (u > 0).then(|| i - 1),
            (v + 1 < self.height).then(|| i + self.width),
            (v > 0).then(|| i - self.width),
        ]
    }

    /// Returns the rectangle with a centre (u, v) and half-sizes \[px\], clipped to the image.
    pub(crate) fn rectangle(&self, center: (f64, f64), half: (f64, f64)) -> Rectangle {
        let span = |c: f64, h: f64, n: usize| span(c - h, c + h, n);
        Rectangle { u: span(center.0, half.0, self.width), v: span(center.1, half.1, self.height) }
    }

    /// Calls `f` with index and point of the usable pixels of every `step`-th column and row of a rectangle, row by row.
    pub(crate) fn usable_in(&self, r: Rectangle, step: usize, mut f: impl FnMut(usize, Vec3)) {
        for v in (r.v.0..r.v.1).step_by(step) {
            let (row, y) = (v * self.width, self.slope_y[v]);
            for u in (r.u.0..r.u.1).step_by(step) {
                let z = self.usable_z[row + u];
                if z > 0.0 {
                    f(row + u, Vec3::new(self.slope_x[u] * z, y * z, z));
                }
            }
        }
    }

    /// Calls `f` with index and point of the usable pixels whose rays meet a ball, row by row. Returns the number of all pixels whose
    /// rays meet the ball.
    pub(crate) fn usable_in_ball(&self, c: &Vec3, radius: f64, mut f: impl FnMut(usize, Vec3)) -> usize {
        let mut pixels = 0;
        self.rows_of_ball(c, radius, 1, |v, (u0, u1)| {
            let (row, y) = (v * self.width, self.slope_y[v]);
            pixels += u1 - u0;
            let zs = &self.usable_z[row + u0..row + u1];
            for (u, (&z, &x)) in (u0..u1).zip(zs.iter().zip(&self.slope_x[u0..u1])) {
                if z > 0.0 {
                    f(row + u, Vec3::new(x * z, y * z, z));
                }
            }
        });
        pixels
    }

    /// Calls `f` with depths \[m\] and slopes x/z, side by side, and the slope y/z of the pixels in every `step`-th column and row of those
    /// whose rays meet a ball, row by row. The depth is zero where none is usable and behind the last. Returns the number of pixels looked
    /// at.
    #[inline]
    pub(crate) fn sample_in_ball(
        &self,
        c: &Vec3,
        radius: f64,
        step: usize,
        mut f: impl FnMut(&[f32], &[f32], f32),
    ) -> usize {
        let mut pixels = 0;
        self.rows_of_ball(c, radius, step, |v, (u0, u1)| {
            let (row, y) = (v * self.width, self.slope_y[v] as f32);
            let (zs, xs) = (&self.short_z[row..row + u1], &self.short_x[..u1]);
            let mut u = u0.next_multiple_of(step);
            while u < u1 {
                let whole = (zs.get(u..u + LANES), xs.get(u..u + LANES));
                if let (1, (Some(z), Some(x))) = (step, whole) {
                    f(z, x, y);
                } else {
                    let (mut z, mut x) = ([0.0; LANES], [0.0; LANES]);
                    let taken = (u..u1).step_by(step);
                    for ((z, x), at) in z.iter_mut().zip(&mut x).zip(taken) {
                        (*z, *x) = (zs[at], xs[at]);
                    }
                    f(&z, &x, y);
                }
                u += LANES * step;
                pixels += LANES;
            }
        });
        pixels
    }

    /// Calls `f` with the pixels whose rays meet a ball, row by row, and the depth \[m\] of the first crossing.
    pub(crate) fn disc_of_ball(&self, c: &Vec3, radius: f64, mut f: impl FnMut(usize, f64)) {
        self.rows_of_ball(c, radius, 1, |v, (u0, u1)| {
            for i in v * self.width + u0..v * self.width + u1 {
                if let Some(z) = self.z_of_ball(i, c, radius) {
                    f(i, z);
                }
            }
        });
    }

    /// Calls `f` with the rows of pixels whose rays meet a ball.
    pub(crate) fn rows_in_ball(&self, c: &Vec3, radius: f64, mut f: impl FnMut(Row<'_>)) {
        self.rows_of_ball(c, radius, 1, |v, (u0, u1)| f(self.row(v, (u0, u1))));
    }

    /// Returns pixels of a row from one column to another, the end excluded.
    fn row(&self, v: usize, (u0, u1): (usize, usize)) -> Row<'_> {
        let columns = v * self.width + u0..v * self.width + u1;
        Row {
            u: u0,
            v,
            first: columns.start,
            x: &self.slope_x[u0..u1],
            y: self.slope_y[v],
            z: &self.z[columns.clone()],
            usable_z: &self.usable_z[columns.clone()],
            pixels: &self.pixels[columns],
        }
    }

    /// Calls `disc` with the rows of pixels whose rays meet a ball, and `ring` with those on both sides of a second ball about its centre and
    /// within a third. The radii \[m\] grow.
    pub(crate) fn disc_and_ring(
        &self,
        c: &Vec3,
        radii: [f64; 3],
        mut disc: impl FnMut(Row<'_>),
        mut ring: impl FnMut(Row<'_>),
    ) {
        let [Some(inner), Some(middle), Some(outer)] = radii.map(|radius| Silhouette::of(self, c, radius))
        else {
            return;
        };
        for v in outer.rows.0..outer.rows.1 {
            let (u0, u1) = outer.columns(v);
            let (within, without) = (inner.columns(v), middle.columns(v));
            disc(self.row(v, within));
            if without.0 < without.1 {
                ring(self.row(v, (u0, without.0.clamp(u0, u1))));
                ring(self.row(v, (without.1.clamp(u0, u1), u1)));
            } else {
                ring(self.row(v, (u0, u1)));
            }
        }
    }

    /// Returns the depth \[m\] at which a pixel's ray first meets a ball; `None` if it misses the ball.
    pub(crate) fn z_of_ball(&self, i: usize, c: &Vec3, radius: f64) -> Option<f64> {
        let (u, v) = self.uv(i);
        let ray = self.ray(u, v);
        let (along, square) = (ray.dot(c), ray.norm_squared());
        let discriminant = along * along - square * (c.norm_squared() - radius * radius);
        (discriminant >= 0.0).then(|| (along - discriminant.sqrt()) / square)
    }

    /// Calls `f` with every `step`-th row of those that a ball covers and the columns that it covers there, the end excluded.
    fn rows_of_ball(&self, c: &Vec3, radius: f64, step: usize, mut f: impl FnMut(usize, (usize, usize))) {
        if let Some(ball) = Silhouette::of(self, c, radius) {
            for v in (ball.rows.0.next_multiple_of(step)..ball.rows.1).step_by(step) {
                f(v, ball.columns(v));
            }
        }
    }
}

/// Pixels whose rays meet a ball.
///
/// The ray (x, y, 1) meets the ball of centre c and radius R where ((x, y, 1).c)^2 >= |(x, y, 1)|^2 (|c|^2 - R^2): between two x in
/// each row. The rows are those between two y: the same condition in the plane x = 0 for the ball's projection along x.
struct Silhouette<'a> {
    cloud: &'a Cloud,
    c: Vec3,
    /// |c|^2 - R^2, and the same less c_x^2.
    power: f64,
    a: f64,
    /// First row, and the one behind the last.
    rows: (usize, usize),
}

impl<'a> Silhouette<'a> {
    /// Returns the silhouette; `None` of a ball that reaches behind the camera.
    fn of(cloud: &'a Cloud, c: &Vec3, radius: f64) -> Option<Self> {
        let beyond = c.z * c.z - radius * radius;
        if c.z <= radius || beyond.is_nan() {
            return None;
        }
        let reach = radius * (c.y * c.y + beyond).sqrt();
        let (y0, y1) = ((c.y * c.z - reach) / beyond, (c.y * c.z + reach) / beyond);
        let k = &cloud.intrinsics;
        let rows = span(y0 * k.fy + k.cy, y1 * k.fy + k.cy, cloud.height);
        let power = c.norm_squared() - radius * radius;
        Some(Self { cloud, c: *c, power, a: power - c.x * c.x, rows })
    }

    /// Returns the first column of a row, and the one behind the last.
    fn columns(&self, v: usize) -> (usize, usize) {
        if !(self.rows.0..self.rows.1).contains(&v) {
            return (0, 0);
        }
        let (c, k, y) = (&self.c, &self.cloud.intrinsics, self.cloud.slope_y[v]);
        let along = y * c.y + c.z;
        let half = (self.power * (along * along - self.a * (y * y + 1.0)).max(0.0)).sqrt();
        let middle = along * c.x;
        let column = |x: f64| x / self.a * k.fx + k.cx;
        span(column(middle - half), column(middle + half), self.cloud.width)
    }
}

/// Returns the whole numbers from `least` to `most` that are below `n`, the end excluded; none if a limit is not a number.
fn span(least: f64, most: f64, n: usize) -> (usize, usize) {
    // A float-to-integer cast saturates. `floor` and `ceil` would be calls into a library.
    let end = if most >= 0.0 { (most as usize).saturating_add(1).min(n) } else { 0 };
    let below = least.max(0.0) as usize;
    let first = if below as f64 >= least { below } else { below.saturating_add(1) };
    (first.min(end), end)
}

/// Intrinsics of every `step`-th column and row of an image, from the first on.
fn every(k: &Intrinsics, step: usize) -> Intrinsics {
    let by = step as f64;
    Intrinsics {
        width: k.width.div_ceil(step),
        height: k.height.div_ceil(step),
        fx: k.fx / by,
        fy: k.fy / by,
        cx: k.cx / by,
        cy: k.cy / by,
    }
}

pub(crate) fn check(
    depth: &DepthImage,
    intrinsics: &Intrinsics,
    mask: Option<&Image<bool>>,
) -> Result<(), PerceptionError> {
    let (width, height) = (depth.width(), depth.height());
    if width == 0 || height == 0 {
        return Err(PerceptionError::Empty { width, height });
    }
    let mismatch = |what, (w, h): (usize, usize)| {
        let error = PerceptionError::SizeMismatch {
            what,
            width: w,
            height: h,
            depth_width: width,
            depth_height: height,
        };
        if (w, h) == (width, height) { Ok(()) } else { Err(error) }
    };
    mismatch("the intrinsics' image", (intrinsics.width, intrinsics.height))?;
    if let Some(mask) = mask {
        mismatch("the mask", (mask.width(), mask.height()))?;
    }
    let Intrinsics { fx, fy, cx, cy, .. } = *intrinsics;
    let finite = [fx, fy, cx, cy].iter().all(|x| x.is_finite());
    if finite && fx > 0.0 && fy > 0.0 { Ok(()) } else { Err(PerceptionError::Intrinsics { fx, fy, cx, cy }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pixels of disc and ring are those whose rays pass the centre at the asked distances.
    #[test]
    fn disc_and_ring_are_told_by_the_distance_of_rays() {
        let k = Intrinsics { width: 60, height: 40, fx: 55.0, fy: 50.0, cx: 28.3, cy: 21.9 };
        let depth = DepthImage::filled(60, 40, 1.0);
        let cloud = Cloud::new(&depth, &k, None, (0.1, 9.0), 1).unwrap();
        for c in [Vec3::new(0.1, -0.05, 0.9), Vec3::new(-0.5, 0.35, 1.1), Vec3::new(2.0, 0.0, 1.0)] {
            let radii = [0.08, 0.12, 0.2];
            let (mut disc, mut ring) = (Vec::new(), Vec::new());
            let pixels = |row: Row<'_>| row.first..row.first + row.z.len();
            cloud.disc_and_ring(&c, radii, |row| disc.extend(pixels(row)), |row| ring.extend(pixels(row)));
            let within = |i: usize, radius: f64| {
                let (u, v) = cloud.uv(i);
                let ray = cloud.ray(u, v);
                (c - ray * (ray.dot(&c) / ray.norm_squared())).norm() <= radius
            };
            let all = 0..cloud.len();
            assert_eq!(disc, all.clone().filter(|i| within(*i, radii[0])).collect::<Vec<_>>());
            let between = |i: &usize| within(*i, radii[2]) && !within(*i, radii[1]);
            assert_eq!(ring, all.filter(between).collect::<Vec<_>>());
        }
    }
}
