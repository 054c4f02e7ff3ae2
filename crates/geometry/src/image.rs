//! Images and the pinhole model. Camera frame: x right, y down, z forward (optical).

use crate::Vec3;
use crate::math;
use serde::Serialize;

/// A row-major image.
#[derive(Debug, Clone, PartialEq)]
pub struct Image<T> {
    width: usize,
    height: usize,
    pixels: Vec<T>,
}

/// Depth along the optical axis \[m\], 0 where there is no valid measurement.
pub type DepthImage = Image<f32>;

impl<T: Clone> Image<T> {
    /// Makes an image filled with one value.
    pub fn filled(width: usize, height: usize, value: T) -> Self {
        Self { width, height, pixels: vec![value; width * height] }
    }
}

impl<T> Image<T> {
    /// Makes an image from row-major pixels; `None` if the number of pixels is not width x height.
    pub fn from_pixels(width: usize, height: usize, pixels: Vec<T>) -> Option<Self> {
        (pixels.len() == width.checked_mul(height)?).then_some(Self { width, height, pixels })
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// All pixels, row by row.
    pub fn pixels(&self) -> &[T] {
        &self.pixels
    }

    /// All pixels, row by row.
    pub fn pixels_mut(&mut self) -> &mut [T] {
        &mut self.pixels
    }
}

impl<T> std::ops::Index<(usize, usize)> for Image<T> {
    type Output = T;

    /// Pixel at (column, row).
    fn index(&self, (u, v): (usize, usize)) -> &T {
        &self.pixels[v * self.width + u]
    }
}

impl<T> std::ops::IndexMut<(usize, usize)> for Image<T> {
    fn index_mut(&mut self, (u, v): (usize, usize)) -> &mut T {
        &mut self.pixels[v * self.width + u]
    }
}

/// Pinhole intrinsics; pixel (u, v) has its centre at (u, v) and looks along ((u - cx)/fx, (v - cy)/fy, 1).
///
/// Serialised in the form that `orchard_exchange::intrinsics` reads.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Intrinsics {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Horizontal focal length \[px\].
    pub fx: f64,
    /// Vertical focal length \[px\].
    pub fy: f64,
    /// Column of the optical axis \[px\].
    pub cx: f64,
    /// Row of the optical axis \[px\].
    pub cy: f64,
}

impl Intrinsics {
    /// Makes intrinsics with square pixels and a centred axis from the vertical field of view \[rad\].
    pub fn from_vertical_fov(width: usize, height: usize, vertical_fov: f64) -> Self {
        let f = 0.5 * height as f64 / math::tan(0.5 * vertical_fov);
        Self { width, height, fx: f, fy: f, cx: 0.5 * (width as f64 - 1.0), cy: 0.5 * (height as f64 - 1.0) }
    }

    /// Ray of a pixel in the camera frame, scaled to z = 1.
    #[inline]
    pub fn ray(&self, u: f64, v: f64) -> Vec3 {
        Vec3::new((u - self.cx) / self.fx, (v - self.cy) / self.fy, 1.0)
    }

    /// Point in the camera frame \[m\] of a pixel with a depth \[m\].
    #[inline]
    pub fn back_project(&self, u: f64, v: f64, depth: f64) -> Vec3 {
        self.ray(u, v) * depth
    }

    /// Pixel of a point in the camera frame; `None` behind the camera.
    #[inline]
    pub fn project(&self, p_camera: &Vec3) -> Option<(f64, f64)> {
        (p_camera.z > 0.0).then(|| {
            (self.fx * p_camera.x / p_camera.z + self.cx, self.fy * p_camera.y / p_camera.z + self.cy)
        })
    }
}
