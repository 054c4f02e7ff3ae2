//! Points that the camera has seen, and which of them show wood.
//!
//! Leaves and wood differ in the length of the surface that they show without a step in depth: a leaf ends after some centimetres, a limb goes on. An image
//! falls into pieces of pixels whose neighbours lie next to each other in depth; a piece that is longer than any leaf counts as wood.

use crate::config::CloudConfig;
use orchard_geometry::{DepthImage, Image, Intrinsics, Pose, Vec3, inverse_transform};

/// A point that the camera has seen; the context gives the frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SeenPoint {
    pub p: Vec3,
    pub is_wood: bool,
}

impl SeenPoint {
    /// The point in the frame of a body at this pose.
    pub fn within(&self, x: &Pose) -> Self {
        Self { p: inverse_transform(x, &self.p), ..*self }
    }

    /// Number of points for which it counts where a hand would meet it.
    pub fn weight(&self, of_wood: f64) -> f64 {
        if self.is_wood { of_wood } else { 1.0 }
    }
}

/// Pieces of an image without a step in depth, by cells of some pixels a side.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Pieces {
    /// Pixels a side of a cell.
    step: usize,
    columns: usize,
    /// True of the cells of long pieces; empty if the config tells none apart.
    is_long: Vec<bool>,
}

impl Pieces {
    /// Finds the pieces among the pixels that are not `ignored` and no farther than the cloud's range.
    pub fn of(depth: &DepthImage, camera: &Intrinsics, ignored: &Image<bool>, c: &CloudConfig) -> Self {
        let least = c.wood_length.si();
        let step = depth.width().div_ceil(c.wood_columns.get().max(1) as usize).max(1);
        let [columns, rows] = [depth.width(), depth.height()].map(|pixels| pixels.div_ceil(step));
        if least <= 0.0 {
            return Self { step, columns, is_long: Vec::new() };
        }
        let at = |cell: usize| [cell % columns * step, cell / columns * step];
        let z_of = |cell: usize| {
            let [u, v] = at(cell);
            let z = f64::from(depth[(u, v)]);
            (z > 0.0 && z <= c.range.si() && !ignored[(u, v)]).then_some(z)
        };
        // Depths of neighbours on a surface differ by some widths of a cell there.
        let steepest = c.wood_step.si() * step as f64 / camera.fx;
        let z: Vec<Option<f64>> = (0..columns * rows).map(z_of).collect();
        let mut pieces = Forest::new(z.len());
        for cell in 0..z.len() {
            let Some(here) = z[cell] else { continue };
            let right = (cell % columns + 1 < columns).then(|| cell + 1);
            for next in right.into_iter().chain([cell + columns]) {
                if let Some(&Some(there)) = z.get(next)
                    && (here - there).abs() < steepest * here.min(there)
                {
                    pieces.join(cell, next);
                }
            }
        }
        let none = [Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY)];
        let mut bounds = vec![none; z.len()];
        for cell in 0..z.len() {
            let Some(z) = z[cell] else { continue };
            let [u, v] = at(cell);
            let p_camera = camera.back_project(u as f64, v as f64, z);
            let [low, high] = &mut bounds[pieces.root(cell)];
            (*low, *high) = (low.inf(&p_camera), high.sup(&p_camera));
        }
        let is_long = (0..z.len()).map(|cell| {
            let [low, high] = bounds[pieces.root(cell)];
            z[cell].is_some() && (high - low).norm() >= least
        });
        Self { step, columns, is_long: is_long.collect() }
    }

    /// True if a pixel belongs to a long piece.
    pub fn is_wood(&self, u: usize, v: usize) -> bool {
        self.is_long.get(v / self.step * self.columns + u / self.step).copied().unwrap_or(false)
    }
}

/// Disjoint sets of cells.
struct Forest {
    parents: Vec<usize>,
}

impl Forest {
    fn new(cells: usize) -> Self {
        Self { parents: (0..cells).collect() }
    }

    /// First cell of a cell's set.
    fn root(&mut self, mut cell: usize) -> usize {
        while self.parents[cell] != cell {
            self.parents[cell] = self.parents[self.parents[cell]];
            cell = self.parents[cell];
        }
        cell
    }

    fn join(&mut self, a: usize, b: usize) {
        let [a, b] = [self.root(a), self.root(b)];
        self.parents[a.max(b)] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expert::ExpertConfig;

    /// A limb across the image is wood; a leaf before it, the background and the pixels of the robot are not. With larger images cells are larger, and the same
    /// pixels count. The baseline tells nothing apart.
    #[test]
    fn long_smooth_pieces_are_wood() {
        let config = ExpertConfig::preset().shared.cloud;
        for scale in [1, 4] {
            let (width, height) = (192 * scale, 144 * scale);
            let camera = Intrinsics::from_vertical_fov(width, height, 1.0);
            // A limb of 16 rows, 1 m away and slanted; a leaf of 16 x 12 pixels, 8 cm wide, 0.2 m before it.
            let z = |u: usize, v: usize| match (u / scale, v / scale) {
                (80..96, 60..72) => 0.8,
                (_, 56..72) => 1.0 + 0.0005 * (u / scale) as f64,
                _ => 5.0,
            };
            let mut depth = DepthImage::filled(width, height, 0.0);
            let mut ignored = Image::filled(width, height, false);
            for v in 0..height {
                for u in 0..width {
                    depth[(u, v)] = z(u, v) as f32;
                    ignored[(u, v)] = u / scale >= 160;
                }
            }
            let pieces = Pieces::of(&depth, &camera, &ignored, &config);
            let is_wood = |u: usize, v: usize| pieces.is_wood(u * scale, v * scale);
            assert!(is_wood(40, 64) && is_wood(140, 60), "the limb on both sides of the leaf");
            assert!(!is_wood(88, 64), "the leaf");
            assert!(!is_wood(40, 100) && !is_wood(170, 64), "too far away, and the robot");
            let none = Pieces::of(&depth, &camera, &ignored, &crate::config::PickerConfig::baseline().cloud);
            assert!(!none.is_wood(40 * scale, 64 * scale));
        }
    }
}
