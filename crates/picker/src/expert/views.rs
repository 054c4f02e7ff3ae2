//! Views of the target from near by, in the states reach and grasp.

use crate::expert::ExpertPicker;
use crate::plan::Target;
use orchard_geometry::{Intrinsics, Vec3, inverse_transform};

/// Views of the target from near by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Views {
    /// Number of images that should show the target.
    pub images: u32,
    /// Number of images that showed it, and the sums of its centre (odom) and radius \[m\].
    pub hits: u32,
    sum: Vec3,
    radius_sum: f64,
}

impl Views {
    pub fn new() -> Self {
        Self { images: 0, hits: 0, sum: Vec3::zeros(), radius_sum: 0.0 }
    }

    /// Mean of all sightings.
    fn target(&self) -> Option<Target> {
        let hits = f64::from(self.hits);
        (self.hits > 0).then(|| Target { p: self.sum / hits, radius: self.radius_sum / hits })
    }
}

impl ExpertPicker {
    /// Counts the frame's image as a view of the target if it was taken from near by. Returns true if it showed the target.
    pub(crate) fn view(&mut self, views: &mut Views) -> bool {
        let farthest = self.core.match_distance();
        let (Some((then, camera)), Some(attempt)) = (&self.core.imaged, &mut self.core.attempt) else {
            return false;
        };
        let x_odom_camera = then.x_odom_base * self.core.arm.camera(&then.q);
        let p_camera = inverse_transform(&x_odom_camera, &attempt.target.p);
        if p_camera.norm() > self.config.unfold.range.si() || !shows(camera, &p_camera) {
            return false;
        }
        views.images += 1;
        let off = |p: &Vec3| (p - attempt.target.p).norm();
        let nearest =
            self.core.perception.sightings.iter().min_by(|a, b| off(&a.p_odom).total_cmp(&off(&b.p_odom)));
        let Some(sighting) = nearest.filter(|s| off(&s.p_odom) <= farthest) else {
            return false;
        };
        views.hits += 1;
        views.sum += sighting.p_odom;
        views.radius_sum += sighting.radius;
        if let Some(target) = views.target() {
            attempt.target = target;
        }
        true
    }
}

/// True if a point of the camera's frame is in the image.
fn shows(camera: &Intrinsics, p_camera: &Vec3) -> bool {
    let (width, height) = (camera.width as f64, camera.height as f64);
    camera.project(p_camera).is_some_and(|(u, v)| u >= 0.0 && v >= 0.0 && u < width && v < height)
}
