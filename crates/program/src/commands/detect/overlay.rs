//! Picture of a depth image with its detections.

use orchard_camera::picture::depth_picture_enlarged;
use orchard_geometry::{DepthImage, Image, Intrinsics};
use orchard_perception::Detection;

use crate::commands::gallery::caption;

/// Smallest width of a picture \[px\].
const WIDTH: usize = 960;

/// Height of the letters \[px\].
const LETTERS: f64 = 13.0;

/// Draws depth in false colour, with the outline of each fruit and its radius \[mm\] beside it.
pub fn picture(depth: &DepthImage, k: &Intrinsics, detections: &[&Detection]) -> Image<[u8; 3]> {
    let scale = (WIDTH / depth.width().max(1)).clamp(1, 8);
    let circles: Vec<(f64, f64, f64)> =
        detections.iter().map(|d| (d.center_px.0, d.center_px.1, k.fx * d.radius / d.p_camera.z)).collect();
    let mut picture = depth_picture_enlarged(depth, &circles, scale);
    for (d, (u, v, radius)) in detections.iter().zip(circles) {
        let text = format!("{:.0}", 1e3 * d.radius);
        let (left, top) = ((u + radius + 0.5) * scale as f64 + 2.0, (v + 0.5) * scale as f64);
        let top = top - 0.5 * LETTERS;
        caption::write_label(&mut picture, &text, left as i32, top as i32);
    }
    picture
}
