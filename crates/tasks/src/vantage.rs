//! Poses of a depth camera about a tree: the views of the detection task and of data sets.

use orchard_camera::picture::look_at;
use orchard_camera::{Geometry, Label, Scene};
use orchard_geometry::{Pose, Vec3, inverse_transform, math};
use orchard_quantity::{Quantity, Span};
use orchard_spec::{Purpose, Stream};
use serde::{Deserialize, Serialize};

/// The range of lens positions and aims of a tree's views.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VantageSpec {
    /// Distance of the lens from the trunk's axis.
    pub distance: Span,
    /// Height of the lens over the trunk's base.
    pub height: Span,
    /// Height of the point on the trunk's axis at which the camera is aimed.
    pub aim: Span,
    /// Smallest distance of the lens from wood and fruit; a lens that is nearer is moved back.
    pub clearance: Quantity,
}

/// Steps of the R3 sequence (Roberts 2018), which fills a cube evenly for any number of points: powers of the inverse of the
/// root of x^4 = x + 1.
const R3: [f64; 3] = [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_3];

/// Step by which a lens that is too near moves back \[m\].
const STEP: f64 = 0.05;

/// Returns `count` poses of the optical frame in the world: even bearings around the tree; distances, heights and aims from a
/// low-discrepancy sequence with a start that depends on the world.
pub fn vantages(spec: &VantageSpec, scene: &Scene, seed: u64, world: u32, count: u32) -> Vec<Pose> {
    let mut stream = Stream::new(seed, world, Purpose::Vantage);
    let first_bearing = stream.unit();
    let start = [(); 3].map(|()| stream.unit());
    let within = |span: &Span, part: f64| {
        let (low, high) = span.si();
        low + (high - low) * part
    };
    let vantage = |i: u32| {
        let part = |k: usize| (start[k] + f64::from(i) * R3[k]).fract();
        let bearing = std::f64::consts::TAU * (f64::from(i) + first_bearing) / f64::from(count.max(1));
        let (sin, cos) = math::sin_cos(bearing);
        let outward = Vec3::new(cos, sin, 0.0);
        let height = Vec3::z() * within(&spec.height, part(1));
        let target = Vec3::z() * within(&spec.aim, part(2));
        let mut distance = within(&spec.distance, part(0));
        let lens = |distance: f64| height + outward * distance;
        // The tree is finite, so the loop ends.
        while is_near(scene, &lens(distance), spec.clearance.si()) {
            distance += STEP;
        }
        look_at(&lens(distance), &target)
    };
    (0..count).map(vantage).collect()
}

/// True if wood or fruit is within a distance \[m\] of a point.
fn is_near(scene: &Scene, p_world: &Vec3, distance: f64) -> bool {
    scene.items.iter().any(|item| match (&item.geometry, item.label) {
        (Geometry::Shape(shape), Label::Wood | Label::Fruit | Label::Scenery) => {
            shape.signed_distance(&inverse_transform(&item.x_world_item, p_world)) < distance
        }
        _ => false,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::Protocol;
    use orchard_geometry::Shape;

    #[test]
    fn views_fill_their_space_and_look_at_the_tree() {
        let spec = Protocol::paper().detect.vantage;
        let all = vantages(&spec, &Scene::default(), 1, 0, 64);
        let (low, high) = spec.distance.si();
        let mut distances: Vec<f64> = all.iter().map(|x| x.translation.vector.xy().norm()).collect();
        distances.sort_by(f64::total_cmp);
        for (i, distance) in distances.iter().enumerate() {
            let even = low + (high - low) * (i as f64 + 0.5) / 64.0;
            // Discrepancy of the sequence: a few times 1 / count.
            assert!((distance - even).abs() < 4.0 / 64.0 * (high - low), "{distance} {even}");
        }
        for x in &all {
            let p_axis = inverse_transform(x, &Vec3::new(0.0, 0.0, x.translation.z));
            assert!(p_axis.x.abs() < 1e-12 && p_axis.z > 0.0, "{p_axis}");
        }
        assert_eq!(all, vantages(&spec, &Scene::default(), 1, 0, 64));
        assert_ne!(all, vantages(&spec, &Scene::default(), 1, 1, 64));
    }

    #[test]
    fn a_lens_stands_clear_of_wood() {
        let spec = Protocol::paper().detect.vantage;
        let (_, far) = spec.distance.si();
        let mut scene = Scene::default();
        let radius = far + 0.2;
        let stout = Shape::Capsule { radius, length: 10.0 };
        scene.push(Geometry::Shape(stout), Pose::translation(0.0, 0.0, -5.0), Label::Wood, 0);
        for x in vantages(&spec, &scene, 1, 0, 8) {
            let gap = x.translation.vector.xy().norm() - radius;
            assert!(gap >= spec.clearance.si() && gap < spec.clearance.si() + STEP, "{gap}");
        }
    }
}
