//! Random directions.

use orchard_geometry::Vec3;
use orchard_spec::Stream;

/// A unit vector, uniform on the sphere.
pub fn direction(rng: &mut Stream) -> Vec3 {
    loop {
        let v = Vec3::from_fn(|_, _| rng.uniform(-1.0, 1.0));
        if (0.01..=1.0).contains(&v.norm()) {
            return v.normalize();
        }
    }
}
