//! Lens distortion: the models plumb_bob and rational_polynomial of ROS and OpenCV (Brown 1966), and its removal from images.

use orchard_geometry::{Image, Intrinsics};

/// Lens with radial and tangential distortion.
///
/// A ray (x, y, 1) is seen at (x d + 2 p1 x y + p2 (r^2 + 2 x^2), y d + p1 (r^2 + 2 y^2) + 2 p2 x y) with
/// d = (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6) and r^2 = x^2 + y^2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lens {
    /// k1 to k6.
    radial: [f64; 6],
    /// p1 and p2.
    tangential: [f64; 2],
}

impl Lens {
    /// Makes a lens from coefficients in the order k1, k2, p1, p2, k3, k4, k5, k6, of which the last may be left out.
    pub fn of_coefficients(coefficients: &[f64]) -> Self {
        let at = |i: usize| coefficients.get(i).copied().unwrap_or(0.0);
        Self { radial: [at(0), at(1), at(4), at(5), at(6), at(7)], tangential: [at(2), at(3)] }
    }

    /// Returns the place (x, y), at depth 1, where the lens images the ray (x, y, 1); `None` so far off the axis that the model's radius falls as the ray's grows.
    pub fn distorted(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        let [k1, k2, k3, k4, k5, k6] = self.radial;
        let [p1, p2] = self.tangential;
        let s = x * x + y * y;
        let (above, below) = (1.0 + s * (k1 + s * (k2 + s * k3)), 1.0 + s * (k4 + s * (k5 + s * k6)));
        let (d_above, d_below) = (k1 + s * (2.0 * k2 + s * 3.0 * k3), k4 + s * (2.0 * k5 + s * 3.0 * k6));
        // Derivative of r d by r: the radius seen must grow with the radius.
        let growth = above / below + 2.0 * s * (d_above * below - above * d_below) / (below * below);
        let d = above / below;
        let seen = (
            x * d + 2.0 * p1 * x * y + p2 * (s + 2.0 * x * x),
            y * d + p1 * (s + 2.0 * y * y) + 2.0 * p2 * x * y,
        );
        let sound = below > 0.0 && growth > 0.0 && seen.0.is_finite() && seen.1.is_finite();
        sound.then_some(seen)
    }

    /// The image that a pinhole with the same intrinsics would have taken: each pixel has the value of the pixel nearest to where its ray is
    /// seen, without a mean of neighbours, which would invent depths at edges. Pixels that the image does not show get `nothing`.
    pub fn undone<T: Clone>(&self, image: &Image<T>, k: &Intrinsics, nothing: T) -> Image<T> {
        let mut out = Image::filled(image.width(), image.height(), nothing);
        for v in 0..image.height() {
            for u in 0..image.width() {
                if let Some((column, row)) = self.seen_at(k, u as f64, v as f64)
                    && (0.0..image.width() as f64).contains(&column)
                    && (0.0..image.height() as f64).contains(&row)
                {
                    out[(u, v)] = image[(column as usize, row as usize)].clone();
                }
            }
        }
        out
    }

    /// Column and row of the pixel in which the lens shows what a pinhole shows at (u, v).
    fn seen_at(&self, k: &Intrinsics, u: f64, v: f64) -> Option<(f64, f64)> {
        let ray = k.ray(u, v);
        let (x, y) = self.distorted(ray.x, ray.y)?;
        Some(((k.fx * x + k.cx).round(), (k.fy * y + k.cy).round()))
    }

    /// Position in the lens's image of a position in the pinhole's \[px\]; the same position where the model means nothing.
    pub fn in_image(&self, k: &Intrinsics, (u, v): (f64, f64)) -> (f64, f64) {
        let ray = k.ray(u, v);
        self.distorted(ray.x, ray.y).map_or((u, v), |(x, y)| (k.fx * x + k.cx, k.fy * y + k.cy))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const K: Intrinsics = Intrinsics { width: 64, height: 48, fx: 50.0, fy: 50.0, cx: 31.5, cy: 23.5 };

    /// By hand, with x = 0.5, y = -0.25: r^2 = 0.3125.
    #[test]
    fn the_model_is_that_of_opencv() {
        let near = |(a, b): (f64, f64), (c, d): (f64, f64)| (a - c).abs() < 1e-15 && (b - d).abs() < 1e-15;
        let (x, y, s) = (0.5, -0.25, 0.3125_f64);
        let radial = Lens::of_coefficients(&[0.1]).distorted(x, y).unwrap();
        assert!(near(radial, (x * (1.0 + 0.1 * s), y * (1.0 + 0.1 * s))));
        let tangential = Lens::of_coefficients(&[0.0, 0.0, 0.01, 0.02]).distorted(x, y).unwrap();
        let expected =
            (x + 0.02 * x * y + 0.02 * (s + 2.0 * x * x), y + 0.01 * (s + 2.0 * y * y) + 0.04 * x * y);
        assert!(near(tangential, expected));
        let k3 = Lens::of_coefficients(&[0.0, 0.0, 0.0, 0.0, 0.3]).distorted(x, y).unwrap();
        assert!(near(k3, (x * (1.0 + 0.3 * s * s * s), y * (1.0 + 0.3 * s * s * s))));
        // Equal polynomials above and below the line.
        let equal = Lens::of_coefficients(&[0.2, 0.3, 0.0, 0.0, 0.4, 0.2, 0.3, 0.4]).distorted(x, y).unwrap();
        assert!(near(equal, (x, y)));
    }

    #[test]
    fn an_image_through_the_lens_comes_back() {
        // Barrel distortion of 10 % at the corners.
        let lens = Lens::of_coefficients(&[-0.2, 0.05, 0.001, -0.001, 0.0]);
        // A smooth picture as the pinhole sees it, and as the lens shows it: the ray of a lens pixel by fixed-point iteration.
        let value = |u: f64, v: f64| u + 100.0 * v;
        let mut seen = Image::filled(K.width, K.height, 0.0);
        for v in 0..K.height {
            for u in 0..K.width {
                let (mut a, mut b) = (u as f64, v as f64);
                for _ in 0..50 {
                    let (c, d) = lens.in_image(&K, (a, b));
                    (a, b) = (a + u as f64 - c, b + v as f64 - d);
                }
                seen[(u, v)] = value(a, b);
            }
        }
        let back = lens.undone(&seen, &K, f64::NAN);
        let middle = (10..54).flat_map(|u| (8..40).map(move |v| (u, v)));
        for (u, v) in middle {
            let off = (back[(u, v)] - value(u as f64, v as f64)).abs();
            assert!(off < 70.0, "nearest pixel, half a row off at most: {u} {v} {off}");
        }
        // Barrel distortion leaves no corner empty; pincushion does.
        assert!(back.pixels().iter().all(|x| x.is_finite()));
        let pincushion = Lens::of_coefficients(&[0.3]).undone(&seen, &K, f64::NAN);
        assert!(pincushion[(0, 0)].is_nan() && pincushion[(32, 24)].is_finite());
    }

    #[test]
    fn where_the_model_folds_over_there_is_nothing() {
        let folding = Lens::of_coefficients(&[-1.0]);
        // r (1 - r^2) grows up to r = 1/sqrt(3).
        assert!(folding.distorted(0.57, 0.0).is_some());
        assert_eq!(folding.distorted(0.58, 0.0), None);
        assert_eq!(Lens::of_coefficients(&[f64::MAX]).distorted(1e200, 1.0), None);
        assert_eq!(Lens::of_coefficients(&[0.0, 0.0, 0.0, 0.0, 0.0, -1.0]).distorted(1.0, 0.0), None);
    }
}
