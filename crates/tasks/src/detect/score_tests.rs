//! Hand-made views, worked out by hand.

use orchard_camera::{Geometry, ImageKey, Scene, Sensor};
use orchard_geometry::{Pose, Rotation, Shape};
use orchard_spec::Spec;

use super::*;
use crate::protocol::Protocol;

const RADIUS: f64 = 0.04;

fn pose(p: [f64; 3]) -> Pose {
    Pose::from_parts(Vec3::from(p).into(), Rotation::identity())
}

/// Two apples and an upright limb, 1 m before a camera that looks along z.
fn view() -> (View, Vec<Ball>) {
    let mut scene = Scene::default();
    let places = [[0.0, 0.0, 1.0], [0.3, 0.0, 1.0]];
    for (i, place) in (0..).zip(places) {
        scene.push(Geometry::Shape(Shape::Sphere { radius: RADIUS }), pose(place), Label::Fruit, i);
    }
    let limb = Geometry::Shape(Shape::Capsule { radius: 0.03, length: 0.4 });
    let upright = Rotation::from_axis_angle(&Vec3::x_axis(), std::f64::consts::FRAC_PI_2);
    scene.push(limb, Pose::from_parts(Vec3::new(-0.3, 0.2, 1.0).into(), upright), Label::Wood, 9);
    let view = View::take(
        &Sensor::new(&Spec::paper().camera),
        (&scene, None),
        &Pose::identity(),
        ImageKey { seed: 0, world: 0, frame: 0 },
        0.06,
    );
    let balls = places.map(|p| Ball { p_world: p.into(), radius: RADIUS });
    (view, balls.to_vec())
}

fn detection(p: [f64; 3], radius: f64) -> Detection {
    Detection {
        p_camera: p.into(),
        radius,
        score: 0.9,
        center_deviation: 1e-3,
        radius_deviation: 1e-3,
        visible: 0.8,
        rms: 1e-4,
        pixels: 30,
        center_px: (0.0, 0.0),
    }
}

#[test]
fn a_detection_is_judged_by_its_centre_and_named_by_its_pixels() {
    let (view, balls) = view();
    let off = RADIUS + 0.005;
    let detections = [
        detection([0.003, 0.004, 1.0], 0.042),
        // Beyond one radius of the apple that the first is matched to, and of one that none is matched to.
        detection([0.0, off, 1.0], RADIUS),
        detection([0.3, off, 1.0], RADIUS),
        detection([-0.3, 0.0, 1.0], 0.03),
        detection([0.0, -0.4, 1.0], 0.03),
        detection([0.0, 0.0, -1.0], 0.03),
    ];
    let records = score(&view, &detections, &balls, None);
    let on: Vec<SitsOn> = records.iter().map(|r| r.on).collect();
    use SitsOn::{Fruit, FruitAgain, Nothing, Wood};
    assert_eq!(on, [Fruit, FruitAgain, Fruit, Wood, Nothing, Nothing]);
    let fruit: Vec<Option<u32>> = records.iter().map(|r| r.fruit).collect();
    assert_eq!(fruit, [Some(0), None, None, None, None, None]);
    // 3, 4, 5; and the radii. A few units in the last place of numbers near 1.
    assert!((records[0].centre_error.unwrap() - 0.005).abs() < 1e-15);
    assert!((records[0].radius_error.unwrap() - 0.002).abs() < 1e-15);
    assert_eq!((records[1].centre_error, records[1].radius_error, records[1].zone), (None, None, None));
    assert!(score(&view, &[], &balls, None).is_empty());
    assert_eq!(score(&view, &detections[..1], &[], None)[0].fruit, None);
}

#[test]
fn two_detections_of_one_apple_are_one_true_positive() {
    let (view, balls) = view();
    let twice = [detection([0.0, 0.01, 1.0], RADIUS), detection([0.0, 0.005, 1.0], RADIUS)];
    let records = score(&view, &twice, &balls, None);
    assert_eq!((records[0].fruit, records[0].on), (None, SitsOn::FruitAgain));
    assert_eq!((records[1].fruit, records[1].on), (Some(0), SitsOn::Fruit));
}

#[test]
fn fruit_ought_to_be_found_from_the_thresholds_on() {
    let rules = Protocol::paper().detect.found;
    let view = |visible_px, unoccluded_px, z| FruitView {
        instance: 5,
        visible_px,
        unoccluded_px,
        visible_box: None,
        p_camera: Vec3::new(0.1, 0.1, z),
        radius: RADIUS,
    };
    let views = [
        view(14, 35, 1.35),
        view(13, 20, 1.0),
        view(39, 100, 1.0),
        view(40, 100, 1.3501),
        view(40, 100, 0.2999),
        view(40, 100, 0.3),
        view(0, 100, 1.0),
    ];
    let seen = fruit_seen(&views, &rules);
    // 14 px of 35 are 40 %. Fruit without a visible pixel is not listed.
    let expected: Vec<bool> = seen.iter().map(|f| f.expected).collect();
    assert_eq!(expected, [true, false, false, false, false, true]);
    let in_range: Vec<bool> = seen.iter().map(|f| f.in_range).collect();
    assert_eq!(in_range, [true, true, true, false, false, true]);
    assert_eq!((seen[0].fruit, seen[0].visible_px, seen[0].depth), (5, 14, 1.35));
}

#[test]
fn equally_frequent_labels_go_to_the_first() {
    let most = |labels: &[Label]| most_frequent(labels.iter().copied());
    assert_eq!(most(&[Label::Wood, Label::Leaf, Label::Wood, Label::Leaf]), Some(Label::Leaf));
    assert_eq!(most(&[]), None);
    for (center, half, size) in [(f64::NAN, 1.0, 9), (1e300, 1.0, 9), (-1e300, 1.0, 9), (0.0, 1.0, 0)] {
        assert!(span(center, half, size).is_empty());
    }
    assert_eq!(span(2.0, 1e300, 9), 0..9);
}
