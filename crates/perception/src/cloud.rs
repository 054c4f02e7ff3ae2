//! Back-projection: a depth image as points in the camera frame.

use crate::PerceptionError;
use orchard_geometry::{DepthImage, Image, Intrinsics, Vec3};

/// What a pixel offers to the detector.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Pixel {
    /// A point within the working range.
    Usable,
    /// A point out of the working range.
    OutOfRange,
    /// To be ignored: robot or ground.
    Masked,
    /// No measurement.
    Empty,
}

/// A depth image with the point of every pixel that measured one.
#[derive(Debug, Clone)]
pub(crate) struct Cloud {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Row by row, camera frame [m]; zero where nothing was measured.
    pub(crate) points: Vec<Vec3>,
    pub(crate) pixels: Vec<Pixel>,
    /// Geometric mean of the focal lengths [px].
    pub(crate) focal: f64,
    pub(crate) intrinsics: Intrinsics,
}

impl Cloud {
    pub(crate) fn new(
        depth: &DepthImage,
        intrinsics: &Intrinsics,
        mask: Option<&Image<bool>>,
        range: (f64, f64),
    ) -> Result<Self, PerceptionError> {
        let (width, height) = (depth.width(), depth.height());
        check(depth, intrinsics, mask)?;
        let mut points = Vec::with_capacity(width * height);
        let mut pixels = Vec::with_capacity(width * height);
        for (i, &z) in depth.pixels().iter().enumerate() {
            let z = f64::from(z);
            let measured = z.is_finite() && z > 0.0;
            let pixel = if mask.is_some_and(|m| m.pixels()[i]) {
                Pixel::Masked
            } else if !measured {
                Pixel::Empty
            } else if (range.0..=range.1).contains(&z) {
                Pixel::Usable
            } else {
                Pixel::OutOfRange
            };
            pixels.push(pixel);
            let (u, v) = ((i % width) as f64, (i / width) as f64);
            points.push(if measured { intrinsics.back_project(u, v, z) } else { Vec3::zeros() });
        }
        let focal = (intrinsics.fx * intrinsics.fy).sqrt();
        Ok(Self { width, height, points, pixels, focal, intrinsics: *intrinsics })
    }

    /// Column and row of a pixel.
    pub(crate) fn uv(&self, i: usize) -> (usize, usize) {
        (i % self.width, i / self.width)
    }

    /// The pixels right, left, below and above, where the image has them.
    pub(crate) fn neighbours(&self, i: usize) -> [Option<usize>; 4] {
        let (u, v) = self.uv(i);
        [
            (u + 1 < self.width).then(|| i + 1),
            (u > 0).then(|| i - 1),
            (v + 1 < self.height).then(|| i + self.width),
            (v > 0).then(|| i - self.width),
        ]
    }

    /// Calls `f` with the usable pixels of the rectangle of centre (u, v) and half-sizes, clipped to the image.
    pub(crate) fn usable_around(&self, center: (f64, f64), half: (f64, f64), mut f: impl FnMut(usize)) {
        // A float-to-integer cast saturates, so that far or non-finite centres give an empty rectangle.
        let span = |c: f64, h: f64, n: usize| {
            ((c - h).ceil().max(0.0) as usize, ((c + h).floor() + 1.0).max(0.0).min(n as f64) as usize)
        };
        let (u0, u1) = span(center.0, half.0, self.width);
        let (v0, v1) = span(center.1, half.1, self.height);
        for v in v0..v1 {
            for i in v * self.width + u0..(v * self.width + u1).max(v * self.width + u0) {
                if self.pixels[i] == Pixel::Usable {
                    f(i);
                }
            }
        }
    }
}

fn check(
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
