//! Depth-continuous patches.

use crate::cloud::{Cloud, Pixel};

/// 4-connected sets of usable pixels whose neighbours differ in depth by at most `jump` [m], with at least
/// `min_pixels`; each in the order in which a flood fill from its first pixel meets them.
pub(crate) fn patches(cloud: &Cloud, jump: f64, min_pixels: usize) -> Vec<Vec<usize>> {
    let mut seen = vec![false; cloud.pixels.len()];
    let mut out = Vec::new();
    for start in 0..cloud.pixels.len() {
        if seen[start] || cloud.pixels[start] != Pixel::Usable {
            continue;
        }
        seen[start] = true;
        let mut patch = vec![start];
        let mut next = 0;
        while let Some(&i) = patch.get(next) {
            next += 1;
            for j in cloud.neighbours(i).into_iter().flatten() {
                let step = (cloud.points[i].z - cloud.points[j].z).abs();
                if !seen[j] && cloud.pixels[j] == Pixel::Usable && step <= jump {
                    seen[j] = true;
                    patch.push(j);
                }
            }
        }
        if patch.len() >= min_pixels {
            out.push(patch);
        }
    }
    out
}
