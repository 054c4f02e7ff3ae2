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
/// Colour of a pixel outside the range of colours.
const OUTSIDE: [u8; 3] = [72, 76, 80];
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
    let valid = || depth.pixels().iter().map(|&z| f64::from(z)).filter(|z| z.is_finite() && *z > 0.0);
    let near = valid().fold(f64::INFINITY, f64::min);
    let far = valid().fold(0.0, f64::max);
    let mut out = depth_picture_in_range(depth, (near, far), scale);
    let green: Vec<_> = circles.iter().map(|&circle| (circle, CIRCLE)).collect();
    draw_circles(&mut out, &green, scale);
    out
}

/// Draws a depth image with the colours from near to far spread over a range \[m\]; what is measured outside of it is grey.
pub fn depth_picture_in_range(depth: &DepthImage, range: (f64, f64), scale: usize) -> Image<[u8; 3]> {
    let scale = scale.max(1);
    let mut out = Image::filled(depth.width() * scale, depth.height() * scale, INVALID);
    for v in 0..out.height() {
        for u in 0..out.width() {
            let z = f64::from(depth[(u / scale, v / scale)]);
            if z.is_finite() && z > 0.0 {
                let inside = z >= range.0 && z <= range.1;
                out[(u, v)] = if inside { depth_colour(z, range) } else { OUTSIDE };
            }
        }
    }
    out
}

/// Colour of a depth \[m\] if the colours are spread over a range \[m\].
pub fn depth_colour(z: f64, (near, far): (f64, f64)) -> [u8; 3] {
    ramp((z - near) / (far - near).max(f64::MIN_POSITIVE))
}

/// Circle (u, v, radius), in pixels of the depth image, with its colour.
pub type ColouredCircle = ((f64, f64, f64), [u8; 3]);

/// Draws circles on a picture with `scale` x `scale` dots a pixel; the first circle is on top.
pub fn draw_circles(picture: &mut Image<[u8; 3]>, circles: &[ColouredCircle], scale: usize) {
    let thickness = 1.2 / scale.max(1) as f64;
    for &((cu, cv, r), colour) in circles.iter().rev() {
        let span = |center: f64, size: usize| {
            // First and last dot that the circle can reach; a cast saturates.
            let dot = |at: f64| ((at + 0.5) * scale.max(1) as f64).max(0.0) as usize;
            (dot(center - r - thickness).min(size), dot(center + r + thickness).saturating_add(1).min(size))
        };
        let ((left, right), (top, bottom)) = (span(cu, picture.width()), span(cv, picture.height()));
        for v in top..bottom {
            for u in left..right {
                // Centre of this dot in pixels of the depth image.
                let x = (u as f64 + 0.5) / scale.max(1) as f64 - 0.5;
                let y = (v as f64 + 0.5) / scale.max(1) as f64 - 0.5;
                let distance = ((x - cu) * (x - cu) + (y - cv) * (y - cv)).sqrt();
                if (distance - r).abs() <= thickness {
                    picture[(u, v)] = colour;
                }
            }
        }
    }
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
        // Beyond the range is another grey than nothing.
        let ranged = depth_picture_in_range(&depth, (0.1, 0.5), 1);
        assert_eq!((ranged[(0, 0)], ranged[(3, 3)]), (RAMP[4].map(|c| c as u8), OUTSIDE));
        assert_eq!((ranged[(1, 0)], ranged[(2, 0)]), (INVALID, INVALID));
    }

    #[test]
    fn circles_of_any_place_and_size_are_drawn() {
        let mut image = Image::filled(5, 5, [0; 3]);
        let circles = [
            (2.0, 2.0, 1.0),
            (-50.0, 2.0, 3.0),
            (2.0, f64::INFINITY, 1.0),
            (f64::NAN, 2.0, 1.0),
            (2.0, 2.0, 1e300),
        ];
        draw_circles(&mut image, &circles.map(|circle| (circle, [9; 3])), 1);
        assert_eq!((image[(1, 2)], image[(2, 1)], image[(0, 0)]), ([9; 3], [9; 3], [0; 3]));
    }
}
