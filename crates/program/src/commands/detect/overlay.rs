//! Picture of a depth or colour image with its detections.

use orchard_camera::picture::{ColouredCircle, depth_colour, depth_picture_in_range, draw_circles};
use orchard_geometry::{DepthImage, Image, Intrinsics};
use orchard_perception::Detection;

use crate::commands::gallery::caption;

/// Smallest width of a picture \[px\].
const WIDTH: usize = 960;

/// Height of the letters \[px\].
const LETTERS: f64 = 13.0;

/// Colour of circles on false colours.
const GREEN: [u8; 3] = [60, 255, 120];
/// Colour of the rings around circles on a colour image, where a dark circle would be lost in the leaves.
const WHITE: [u8; 3] = [255, 255, 255];
/// By how much a ring is larger than its circle, in dots of the picture.
const RING: f64 = 2.4;

/// Draws the outline of each fruit and its radius \[mm\] beside it: on the colour image, in the colour of its depth within the range \[m\]
/// with a white ring; without one, on depth in false colour over that range.
pub fn picture(
    depth: &DepthImage,
    colour: Option<&Image<[u8; 3]>>,
    k: &Intrinsics,
    range: (f64, f64),
    detections: &[&Detection],
) -> Image<[u8; 3]> {
    let scale = (WIDTH / depth.width().max(1)).clamp(1, 8);
    let circles: Vec<ColouredCircle> = detections
        .iter()
        .map(|d| {
            let ink = if colour.is_some() { depth_colour(d.p_camera.z, range) } else { GREEN };
            ((d.center_px.0, d.center_px.1, k.fx * d.radius / d.p_camera.z), ink)
        })
        .collect();
    let mut picture = match colour {
        Some(colour) => enlarged(colour, scale),
        None => depth_picture_in_range(depth, range, scale),
    };
    if colour.is_some() {
        let wider = RING / scale as f64;
        let rings: Vec<ColouredCircle> =
            circles.iter().map(|&((u, v, radius), _)| ((u, v, radius + wider), WHITE)).collect();
        draw_circles(&mut picture, &rings, scale);
    }
    draw_circles(&mut picture, &circles, scale);
    for (d, ((u, v, radius), _)) in detections.iter().zip(circles) {
        let text = format!("{:.0}", 1e3 * d.radius);
        let (left, top) = ((u + radius + 0.5) * scale as f64 + 2.0, (v + 0.5) * scale as f64);
        let top = top - 0.5 * LETTERS;
        caption::write_label(&mut picture, &text, left as i32, top as i32);
    }
    picture
}

fn enlarged(image: &Image<[u8; 3]>, scale: usize) -> Image<[u8; 3]> {
    let mut out = Image::filled(image.width() * scale, image.height() * scale, [0; 3]);
    for v in 0..out.height() {
        for u in 0..out.width() {
            out[(u, v)] = image[(u / scale, v / scale)];
        }
    }
    out
}
