//! Point cloud: back-projection of a depth image to points in the camera frame.

use crate::PerceptionError;
use orchard_geometry::{DepthImage, Image, Intrinsics, Vec3};

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
        let taken = || (0..height).flat_map(|v| (0..width).map(move |u| (step * u, step * v)));
        let z: Vec<f64> = taken().map(|at| measured(depth[at])).collect();
        let classify = |&z: &f64| {
            if z <= 0.0 {
                Pixel::Empty
            } else if (range.0..=range.1).contains(&z) {
                Pixel::Usable
            } else {
                Pixel::OutOfRange
            }
        };
        let mut pixels: Vec<Pixel> = z.iter().map(classify).collect();
        if let Some(mask) = mask {
            for (pixel, _) in pixels.iter_mut().zip(taken()).filter(|(_, at)| mask[*at]) {
                *pixel = Pixel::Masked;
            }
        }
        let usable = |(&z, &pixel): (&f64, &Pixel)| if pixel == Pixel::Usable { z } else { 0.0 };
        let usable_z = z.iter().zip(&pixels).map(usable).collect();
        let slope_x = (0..width).map(|u| intrinsics.ray(u as f64, 0.0).x).collect();
        let slope_y = (0..height).map(|v| intrinsics.ray(0.0, v as f64).y).collect();
        let focal = (intrinsics.fx * intrinsics.fy).sqrt();
        Ok(Self { width, height, z, usable_z, pixels, slope_x, slope_y, focal, intrinsics, step })
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

    /// Calls `f` with the usable points in every `step`-th column and row of those whose rays meet a ball, row by row. Returns the number
    /// of pixels looked at.
    pub(crate) fn sample_in_ball(
        &self,
        c: &Vec3,
        radius: f64,
        step: usize,
        mut f: impl FnMut(Vec3),
    ) -> usize {
        let mut pixels = 0;
        self.rows_of_ball(c, radius, step, |v, (u0, u1)| {
            let (row, y) = (v * self.width, self.slope_y[v]);
            let (zs, xs) = (&self.usable_z[row..row + u1], &self.slope_x[..u1]);
            let mut u = u0.next_multiple_of(step);
            while u < u1 {
                pixels += 1;
                let z = zs[u];
                if z > 0.0 {
                    f(Vec3::new(xs[u] * z, y * z, z));
                }
                u += step;
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

    /// Calls `f` with the pixels whose rays meet a ball, row by row, and the rays, scaled to z = 1.
    pub(crate) fn rays_of_ball(&self, c: &Vec3, radius: f64, mut f: impl FnMut(usize, Vec3)) {
        self.rows_of_ball(c, radius, 1, |v, (u0, u1)| {
            for u in u0..u1 {
                f(v * self.width + u, self.ray(u, v));
            }
        });
    }

    /// Returns the depth \[m\] at which a pixel's ray first meets a ball; `None` if it misses the ball.
    pub(crate) fn z_of_ball(&self, i: usize, c: &Vec3, radius: f64) -> Option<f64> {
        let (u, v) = self.uv(i);
        let ray = self.ray(u, v);
        let (along, square) = (ray.dot(c), ray.norm_squared());
        let discriminant = along * along - square * (c.norm_squared() - radius * radius);
        (discriminant >= 0.0).then(|| (along - discriminant.sqrt()) / square)
    }

    /// Calls `f` with every `step`-th row of those that a ball covers and the columns that it covers there, the end excluded. A ball that
    /// reaches behind the camera covers none.
    ///
    /// The ray (x, y, 1) meets the ball of centre c and radius R where ((x, y, 1).c)^2 >= |(x, y, 1)|^2 (|c|^2 - R^2): between two x in
    /// each row. The rows are those between two y: the same condition in the plane x = 0 for the ball's projection along x.
    fn rows_of_ball(&self, c: &Vec3, radius: f64, step: usize, mut f: impl FnMut(usize, (usize, usize))) {
        let k = &self.intrinsics;
        let beyond = c.z * c.z - radius * radius;
        if c.z <= radius || beyond.is_nan() {
            return;
        }
        let pixels = |a: f64, b: f64, f: f64, c: f64, n: usize| span(a * f + c, b * f + c, n);
        let reach = radius * (c.y * c.y + beyond).sqrt();
        let (y0, y1) = ((c.y * c.z - reach) / beyond, (c.y * c.z + reach) / beyond);
        let rows = pixels(y0, y1, k.fy, k.cy, self.height);
        let power = c.norm_squared() - radius * radius;
        let a = power - c.x * c.x;
        for v in (rows.0.next_multiple_of(step)..rows.1).step_by(step) {
            let y = self.slope_y[v];
            let along = y * c.y + c.z;
            let half = (power * (along * along - a * (y * y + 1.0)).max(0.0)).sqrt();
            let middle = along * c.x;
            f(v, pixels((middle - half) / a, (middle + half) / a, k.fx, k.cx, self.width));
        }
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
