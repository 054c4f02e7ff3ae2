//! Colour pictures for a controller that asks for them.

use orchard_geometry::Vec3;
use serde::{Deserialize, Serialize};

/// Colour pictures of the camera on the hand and of a fixed camera, which moves with the base: rows of pixels, each red, green and blue (sRGB).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Pictures {
    /// Time at which they were taken, since the episode began \[s\].
    pub time: f64,
    /// Picture of the camera on the hand, which has the place and the vertical field of view of the depth camera.
    pub wrist: Vec<u8>,
    /// Picture of the fixed camera.
    pub base: Vec<u8>,
}

/// Pictures that a controller asks for: their rate and size, the fixed camera, and the quality of light and shadow.
#[derive(Debug, Clone, PartialEq)]
pub struct PictureRequest {
    /// Frames from pictures to pictures; the first are taken at the start.
    pub period: u32,
    /// Frames from one look at them to the next; the first is at the start. Pictures that newer ones replace before a look are not drawn.
    pub look: u32,
    /// Columns and rows.
    pub size: [usize; 2],
    /// Place of the fixed camera \[m, base\].
    pub p_base_eye: Vec3,
    /// The point in the middle of its picture \[m, base\].
    pub p_base_aim: Vec3,
    /// Vertical field of view of the fixed camera \[rad\].
    pub vertical_fov: f64,
    /// Samples a pixel side.
    pub supersampling: usize,
    /// Pixels a side of the map of the sun's shadow.
    pub sun_map: usize,
    /// Pixels a side of the maps of the sky's light; 0: nothing hides the sky.
    pub sky_map: usize,
}

impl PictureRequest {
    /// True if pictures are drawn in a frame: they are taken there, and they are the newest ones at a look.
    pub fn is_due(&self, frame: u32) -> bool {
        let age_at_look = frame.next_multiple_of(self.look) - frame;
        frame.is_multiple_of(self.period) && age_at_look < self.period
    }

    /// True if pictures have the size that was asked for.
    pub fn fits(&self, pictures: &Pictures) -> bool {
        let [width, height] = self.size;
        [&pictures.wrist, &pictures.base].iter().all(|bytes| bytes.len() == 3 * width * height)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(period: u32, look: u32) -> PictureRequest {
        PictureRequest {
            period,
            look,
            size: [1, 1],
            p_base_eye: Vec3::zeros(),
            p_base_aim: Vec3::x(),
            vertical_fov: 1.0,
            supersampling: 1,
            sun_map: 16,
            sky_map: 0,
        }
    }

    #[test]
    fn each_look_sees_the_pictures_that_it_would_see_if_all_were_drawn() {
        for period in 1..=12 {
            for look in 1..=12 {
                let drawn = |frame: &u32| request(period, look).is_due(*frame);
                for at in (0..200).step_by(look as usize) {
                    assert_eq!((0..=at).rev().find(drawn), Some(at - at % period), "{period} {look} {at}");
                }
                // Each is seen.
                let count = (0..200).filter(drawn).count() as u32;
                assert!(count <= 200_u32.div_ceil(period.max(look)) + 1, "{period} {look} {count}");
            }
        }
    }
}
