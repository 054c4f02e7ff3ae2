//! Draws depth images in false colour.

use orchard_geometry::{DepthImage, Image};

/// Colours from near to far.
const RAMP: [[f64; 3]; 5] = [
    [252.0, 245.0, 190.0],
    [250.0, 165.0, 75.0],
    [205.0, 70.0, 95.0],
    [95.0, 35.0, 120.0],
    [18.0, 16.0, 55.0],
];
/// Colour of a pixel without a measurement.
const INVALID: [u8; 3] = [28, 30, 32];
/// Colour of the circles around detections.
const CIRCLE: [u8; 3] = [60, 255, 120];

/// Draws a depth image in false colour (bright is near) with a circle for every detection, given as
/// (u, v, radius) \[px\].
pub fn depth_picture(depth: &DepthImage, circles: &[(f64, f64, f64)]) -> Image<[u8; 3]> {
    depth_picture_enlarged(depth, circles, 1)
}

/// Draws the same picture with `scale` x `scale` dots a pixel, so that circles are finer than pixels. Circles are
/// given in pixels of the depth image.
pub fn depth_picture_enlarged(
    depth: &DepthImage,
    circles: &[(f64, f64, f64)],
    scale: usize,
) -> Image<[u8; 3]> {
    let scale = scale.max(1);
    let (width, height) = (depth.width() * scale, depth.height() * scale);
    let valid = || depth.pixels().iter().map(|&z| f64::from(z)).filter(|z| z.is_finite() && *z > 0.0);
    let near = valid().fold(f64::INFINITY, f64::min);
    let far = valid().fold(0.0, f64::max);
    let mut out = Image::filled(width, height, INVALID);
    for v in 0..height {
        for u in 0..width {
            let z = f64::from(depth[(u / scale, v / scale)]);
            if z.is_finite() && z > 0.0 {
                out[(u, v)] = ramp((z - near) / (far - near).max(f64::MIN_POSITIVE));
            }
            // Centre of this dot in pixels of the depth image.
            let x = (u as f64 + 0.5) / scale as f64 - 0.5;
            let y = (v as f64 + 0.5) / scale as f64 - 0.5;
            let thickness = 1.2 / scale as f64;
            let on_circle = |&(cu, cv, r): &(f64, f64, f64)| {
                let distance = ((x - cu) * (x - cu) + (y - cv) * (y - cv)).sqrt();
                (distance - r).abs() <= thickness
            };
            if circles.iter().any(on_circle) {
                out[(u, v)] = CIRCLE;
            }
        }
    }
    out
}

fn ramp(t: f64) -> [u8; 3] {
    let last = RAMP.len() - 1;
    let x = t.clamp(0.0, 1.0) * last as f64;
    let i = (x as usize).min(last - 1);
    let f = x - i as f64;
    [0, 1, 2].map(|k| (RAMP[i][k] + (RAMP[i + 1][k] - RAMP[i][k]) * f).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_is_bright_invalid_is_grey_and_circles_are_drawn() {
        let mut depth = DepthImage::filled(9, 9, 2.0);
        depth[(0, 0)] = 0.5;
        depth[(1, 0)] = 0.0;
        depth[(2, 0)] = f32::NAN;
        let image = depth_picture_enlarged(&depth, &[(4.0, 5.0, 2.0)], 2);
        assert_eq!((image.width(), image.height()), (18, 18));
        assert_eq!(image[(1, 1)], RAMP[0].map(|c| c as u8));
        assert_eq!(image[(17, 1)], RAMP[4].map(|c| c as u8));
        assert_eq!((image[(2, 0)], image[(4, 0)]), (INVALID, INVALID));
        assert_eq!((image[(4, 10)], image[(9, 11)]), (CIRCLE, RAMP[4].map(|c| c as u8)));
    }
}
