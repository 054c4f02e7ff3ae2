//! Segmentation of a depth image into depth-continuous patches.

use crate::cloud::{Cloud, Pixel};

/// Returns the 4-connected sets of at least `min_pixels` usable pixels whose neighbours differ in depth by at most `jump` \[m\], which
/// takes the depth \[m\]. The pixels of a patch are in the order of a flood fill from the first one.
pub(crate) fn patches(cloud: &Cloud, jump: impl Fn(f64) -> f64, min_pixels: usize) -> Vec<Vec<usize>> {
    let mut seen = vec![false; cloud.len()];
    let mut out = Vec::new();
    for start in 0..cloud.len() {
        if seen[start] || cloud.pixel(start) != Pixel::Usable {
            continue;
        }
        seen[start] = true;
        let mut patch = vec![start];
        let mut next = 0;
        while let Some(&i) = patch.get(next) {
            next += 1;
            let most = jump(cloud.z(i));
            for j in cloud.neighbours(i).into_iter().flatten() {
                let step = (cloud.z(i) - cloud.z(j)).abs();
                if !seen[j] && cloud.pixel(j) == Pixel::Usable && step <= most {
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
