//! Images that no camera should deliver give an error or no detection, never a panic and never a number that is not finite.

use orchard_geometry::{DepthImage, Image, Intrinsics};
use orchard_perception::{DetectorConfig, PerceptionError, detect, mask};
use proptest::prelude::*;

fn intrinsics(width: usize, height: usize) -> Intrinsics {
    Intrinsics { width, height, fx: 20.0, fy: 20.0, cx: 0.5 * width as f64, cy: 0.5 * height as f64 }
}

#[test]
fn lenses_that_no_camera_has_are_survived() {
    let depth = DepthImage::filled(40, 40, 0.5);
    for cx in [-1e9, 1e18, -1e89, 1e300] {
        let k = Intrinsics { cx, ..intrinsics(40, 40) };
        assert!(detect(&depth, &k, None, &DetectorConfig::d435i()).unwrap().is_empty());
    }
    let depth = DepthImage::filled(40, 1, 0.5);
    for fx in [1e18, 1e30, 1e300] {
        let k = Intrinsics { fx, ..intrinsics(40, 1) };
        assert!(detect(&depth, &k, None, &DetectorConfig::d435i()).unwrap().is_empty());
    }
}

#[test]
fn empty_and_mismatched_images_are_named() {
    let config = DetectorConfig::paper();
    let empty = DepthImage::filled(0, 5, 0.5);
    let e = detect(&empty, &intrinsics(0, 5), None, &config).unwrap_err();
    assert_eq!(e.to_string(), "depth image is empty (0 x 5)");
    let depth = DepthImage::filled(8, 6, 0.5);
    let e = detect(&depth, &intrinsics(8, 7), None, &config).unwrap_err();
    assert_eq!(e.to_string(), "the intrinsics' image is 8 x 7, the depth image 8 x 6");
    let mask = Image::filled(7, 6, false);
    let e = detect(&depth, &intrinsics(8, 6), Some(&mask), &config).unwrap_err();
    assert_eq!(e.to_string(), "the mask is 7 x 6, the depth image 8 x 6");
    for bad in [0.0, -20.0, f64::NAN, f64::INFINITY] {
        let k = Intrinsics { fx: bad, ..intrinsics(8, 6) };
        let e = detect(&depth, &k, None, &config).unwrap_err();
        assert!(matches!(e, PerceptionError::Intrinsics { .. }), "{e}");
    }
}

#[test]
fn images_without_a_measurement_hold_no_fruit() {
    let config = DetectorConfig::paper();
    for value in [0.0, -1.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 0.29, 1.36] {
        for (w, h) in [(1, 1), (32, 24)] {
            let depth = DepthImage::filled(w, h, value);
            assert_eq!(detect(&depth, &intrinsics(w, h), None, &config), Ok(Vec::new()));
        }
    }
}

/// Hard images of the size of a real camera's: none takes more pixel accesses than the config allows.
#[test]
fn large_images_without_fruit_end() {
    let mut config = DetectorConfig::paper();
    config.fit.effort = config.fit.effort.with_value(30).unwrap();
    let (w, h) = (640, 480);
    // A hash of the pixel's number in [0, 1).
    let hash = |i: usize| ((i as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40) as f32 / (1 << 24) as f32;
    let wave =
        |i: usize, period: f64| orchard_geometry::math::sin(std::f64::consts::TAU * i as f64 / period) as f32;
    let images: [&dyn Fn(usize) -> f32; 5] = [
        &|_| 0.5,
        &|i| 0.5 + 1e-4 * (i % w) as f32 + 2e-4 * (i / w) as f32,
        &|i| 0.3 + hash(i),
        &|i| 0.5 + 0.0005 * hash(i),
        // Waves whose crests and hollows are as curved as apples.
        &|i| 0.4 + 0.002 * wave(i % w, 23.0) * wave(i / w, 29.0),
    ];
    for focal in [1e-6, 20.0, 600.0, 1e7] {
        let k = Intrinsics { fx: focal, fy: focal, ..intrinsics(w, h) };
        for image in images {
            let depth = DepthImage::from_pixels(w, h, (0..w * h).map(image).collect()).unwrap();
            for d in detect(&depth, &k, None, &config).unwrap() {
                assert!(d.p_camera.iter().all(|x| x.is_finite()) && d.radius.is_finite(), "{d:?}");
            }
        }
    }
}

fn any_depth() -> impl Strategy<Value = f32> {
    prop_oneof![
        6 => 0.3_f32..1.4,
        2 => 0.48_f32..0.52,
        1 => any::<f32>(),
        1 => Just(0.0_f32),
        1 => Just(f32::NAN),
        1 => Just(f32::MIN_POSITIVE),
        1 => Just(1e-40_f32),
        1 => Just(-0.5_f32),
        1 => Just(f32::INFINITY),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn any_pixels_are_survived(
        (w, h, pixels, mask) in prop_oneof![(0_usize..16, 0_usize..16), (Just(1_usize), 0_usize..200), (0_usize..200, Just(1_usize))].prop_flat_map(|(w, h)| (
            Just(w), Just(h),
            prop::collection::vec(any_depth(), w * h),
            prop::collection::vec(any::<bool>(), w * h),
        )),
        refine: bool, gates: bool, stereo: bool, fx in prop_oneof![1.0_f64..200.0, any::<f64>()], cx in prop_oneof![0.0_f64..16.0, any::<f64>()],
    ) {
        let depth = DepthImage::from_pixels(w, h, pixels).unwrap();
        let mask = Image::from_pixels(w, h, mask).unwrap();
        let mut config = if stereo { DetectorConfig::d435i() } else { DetectorConfig::paper() };
        config.fit.refine = refine;
        for gate in [&mut config.gates.residual, &mut config.gates.elongation, &mut config.gates.isolation,
                     &mut config.gates.convexity, &mut config.gates.cylinder, &mut config.gates.hidden] {
            gate.on = gates;
        }
        config.gates.radius.on = gates;
        config.gates.pixel_ratio.on = gates;
        let k = Intrinsics { fx, cx, ..intrinsics(w, h) };
        for mask in [None, Some(&mask)] {
            if let Ok(detections) = detect(&depth, &k, mask, &config) {
                for d in detections {
                    let numbers = [d.p_camera.x, d.p_camera.y, d.p_camera.z, d.radius, d.rms, d.center_px.0, d.center_px.1];
                    prop_assert!(numbers.iter().all(|x| x.is_finite()), "{:?}", d);
                }
            }
        }
        let up = orchard_geometry::Vec3::new(0.0, -1.0, 0.0);
        let shape = (orchard_geometry::Shape::Sphere { radius: 0.5 }, orchard_geometry::Pose::identity());
        let mut all = mask::ground_mask(&depth, &k, &up, 0.5, 0.05);
        mask::add(&mut all, &mask::self_mask(&depth, &k, &[shape], 0.01));
    }
}
