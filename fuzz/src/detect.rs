//! The detector on any image, intrinsics, mask and choice of gates: an error or finite detections.

use arbitrary::{Arbitrary, Unstructured};
use orchard_geometry::{DepthImage, Image, Intrinsics, Pose, Shape, Vec3};
use orchard_perception::{DetectorConfig, candidates, mask};

struct Input {
    width: u8,
    height: u8,
    intrinsics: [f64; 4],
    usual_intrinsics: bool,
    detector: u8,
    refine: bool,
    on: [bool; 8],
    up: [f64; 3],
    sphere: [f64; 4],
    masked: bool,
    /// Depths: some bits of each value choose what it is.
    pixels: Vec<u16>,
    odd: f32,
}

impl<'a> Arbitrary<'a> for Input {
    fn arbitrary(u: &mut Unstructured<'a>) -> arbitrary::Result<Self> {
        Ok(Self {
            width: u.arbitrary()?,
            height: u.arbitrary()?,
            intrinsics: u.arbitrary()?,
            usual_intrinsics: u.arbitrary()?,
            detector: u.arbitrary()?,
            refine: u.arbitrary()?,
            on: u.arbitrary()?,
            up: u.arbitrary()?,
            sphere: u.arbitrary()?,
            masked: u.arbitrary()?,
            pixels: u.arbitrary()?,
            odd: u.arbitrary()?,
        })
    }
}

/// One case.
pub fn run(bytes: &[u8]) {
    let Ok(input) = Input::arbitrary_take_rest(Unstructured::new(bytes)) else { return };
    let (width, height) = (usize::from(input.width % 33), usize::from(input.height % 33));
    let pixel = |i: usize| match input.pixels.get(i % input.pixels.len().max(1)).copied().unwrap_or(0) {
        0 => 0.0,
        1 => input.odd,
        value => f32::from(value) * 2.5e-5,
    };
    let Some(depth) = DepthImage::from_pixels(width, height, (0..width * height).map(pixel).collect()) else {
        return;
    };
    let [fx, fy, cx, cy] = if input.usual_intrinsics { [40.0, 40.0, 16.0, 16.0] } else { input.intrinsics };
    let k = Intrinsics { width, height, fx, fy, cx, cy };
    let names = DetectorConfig::FILES;
    let Ok(mut config) = DetectorConfig::named(names[usize::from(input.detector) % names.len()].0) else {
        return;
    };
    config.fit.refine = input.refine;
    let gates = &mut config.gates;
    gates.radius.on = input.on[0];
    gates.residual.on = input.on[1];
    gates.convexity.on = input.on[2];
    gates.pixel_ratio.on = input.on[3];
    gates.elongation.on = input.on[4];
    gates.isolation.on = input.on[5];
    gates.cylinder.on = input.on[6];
    gates.hidden.on = input.on[7];
    let [x, y, z, radius] = input.sphere;
    let ball = (Shape::Sphere { radius }, Pose::translation(x, y, z));
    let ground = mask::ground_mask(&depth, &k, &Vec3::from(input.up), 1.0, 0.05);
    let mut masked: Image<bool> = mask::self_mask(&depth, &k, &[ball], 0.01);
    mask::add(&mut masked, &ground);
    let found = candidates(&depth, &k, input.masked.then_some(&masked), &config);
    for d in found.into_iter().flatten().map(|c| c.detection) {
        let numbers =
            [d.p_camera.x, d.p_camera.y, d.p_camera.z, d.radius, d.rms, d.center_px.0, d.center_px.1];
        assert!(numbers.iter().all(|x| x.is_finite()) && d.p_camera.z > 0.0, "{d:?}");
        assert!((0.0..=1.0).contains(&d.score) && (0.0..=1.0).contains(&d.visible), "{d:?}");
        assert!(d.radius_deviation >= 0.0 && d.center_deviation >= 0.0, "{d:?}");
    }
}
