//! Each gate refuses the surface that it is made for; with that gate off the surface is accepted.

use super::common;

use common::*;
use orchard_geometry::Vec3;
use orchard_perception::{DetectorConfig, Gate};

/// Asserts that a gate alone prevents a detection of the surfaces.
fn only_this_gate_refuses(
    gate: Gate,
    surfaces: &[Surface],
    on: &DetectorConfig,
    switch: impl Fn(&mut DetectorConfig),
) {
    let candidates = considered(surfaces, on);
    assert!(candidates.iter().all(|c| c.refused_by.is_some()), "{candidates:?}");
    assert!(candidates.iter().any(|c| c.refused_by == Some(gate)), "{candidates:?}");
    let mut off = on.clone();
    switch(&mut off);
    assert_eq!(found(surfaces, &off).len(), 1, "{:?}", considered(surfaces, &off));
}

#[test]
fn radius() {
    let config = one_fit_a_patch();
    for (z, radius) in [(0.8, 0.08), (0.35, 0.015)] {
        let ball = ball(Vec3::new(0.05, -0.03, z), radius);
        only_this_gate_refuses(Gate::Radius, &[&ball], &config, |c| c.gates.radius.on = false);
    }
}

#[test]
fn residual() {
    // A ball with smooth bumps of 8 mm, 33 mm apart.
    let center = Vec3::new(0.0, 0.0, 0.5);
    let smooth = ball(center, 0.055);
    let bumpy = |d: &Vec3| {
        let t = smooth(d)?;
        let p = d * t;
        let wave = |x: f64| orchard_geometry::math::cos(x * std::f64::consts::TAU / 0.033);
        Some(t - 0.012 * wave(p.x) * wave(p.y))
    };
    let bumpy = part(bumpy, |p| (p.x * p.x + p.y * p.y).sqrt() < 0.04);
    only_this_gate_refuses(Gate::Residual, &[&bumpy], &one_fit_a_patch(), |c| c.gates.residual.on = false);
}

#[test]
fn convexity() {
    let center = Vec3::new(0.0, 0.02, 0.5);
    let bowl = part(bowl(center, 0.04), move |p| (p - center).normalize().z > 0.6);
    only_this_gate_refuses(Gate::Convexity, &[&bowl], &one_fit_a_patch(), |c| c.gates.convexity.on = false);
}

#[test]
fn pixel_ratio() {
    // A cap that shows (15/55)^2 = 7 % of the ball's disc.
    let cap = part(ball(Vec3::new(0.0, 0.0, 0.5), 0.055), |p| p.x * p.x + p.y * p.y < 0.015 * 0.015);
    only_this_gate_refuses(Gate::PixelRatio, &[&cap], &one_fit_a_patch(), |c| {
        c.gates.pixel_ratio.on = false;
    });
}

#[test]
fn elongation() {
    let strip = part(ball(Vec3::new(0.0, 0.0, 0.5), 0.035), |p| p.y.abs() < 0.008);
    only_this_gate_refuses(Gate::Elongation, &[&strip], &one_fit_a_patch(), |c| {
        c.gates.elongation.on = false;
    });
}

/// Not a gate: a leaf in front of half of the fruit leaves a crescent, which elongation refuses unless hidden pixels count.
#[test]
fn what_hides_a_fruit_counts_for_it() {
    let config = DetectorConfig::paper();
    let ball = ball(Vec3::new(0.0, 0.0, 0.5), 0.035);
    let front = part(plane(Vec3::new(0.0, 0.0, 0.4), Vec3::z()), |p| p.x > -0.006);
    let surfaces: [Surface; 2] = [&ball, &front];
    assert_eq!(found(&surfaces, &config).len(), 1);
    let mut off = config.clone();
    off.gates.hidden.on = false;
    assert!(considered(&surfaces, &off).iter().any(|c| c.refused_by == Some(Gate::Elongation)));
    assert!(found(&surfaces, &off).is_empty());
    // Nothing is behind the strip: pixels that are not hidden must show the fruit.
    let strip = part(ball_of(), |p| p.y.abs() < 0.008);
    let behind = plane(Vec3::new(0.0, 0.0, 0.7), Vec3::z());
    assert!(found(&[&strip, &behind], &config).is_empty());
}

/// Two rows of pixels across a limb are equal circles, which lie exactly on a sphere. Hidden pixels must not turn them into a fruit.
#[test]
fn a_limb_seen_through_a_slot_is_no_fruit() {
    let k = camera();
    let limb = cylinder_along_x(Vec3::new(0.0, 0.0, 1.1), 0.042);
    // The image's middle lies between two columns.
    let slot = part(plane(Vec3::new(0.0, 0.0, 0.6), Vec3::z()), |p| p.x.abs() > 0.6 / k.fx);
    let depth = image(&k, &[&slot, &limb]);
    let measured = depth.pixels().iter().filter(|z| **z > 1.0).count();
    assert!(measured >= 14, "{measured} pixels of the limb");
    let all = considered(&[&slot, &limb], &DetectorConfig::paper());
    assert!(all.iter().any(|c| c.refused_by == Some(Gate::Elongation) && c.detection.rms < 1e-6), "{all:?}");
    assert!(all.iter().all(|c| c.refused_by.is_some()), "{all:?}");
}

fn ball_of() -> impl Fn(&Vec3) -> Option<f64> {
    ball(Vec3::new(0.0, 0.0, 0.5), 0.035)
}

#[test]
fn isolation() {
    // A shallow bump on a wall: the wall goes on where the sphere would turn away.
    let bump = ball(Vec3::new(0.0, 0.0, 0.525), 0.04);
    let wall = plane(Vec3::new(0.0, 0.0, 0.5), Vec3::z());
    only_this_gate_refuses(Gate::Isolation, &[&bump, &wall], &DetectorConfig::paper(), |c| {
        c.gates.isolation.on = false;
    });
}

/// Two flaps 12 mm in front of a ball leave a strip of it in view: too near for a jump in depth, far enough to hide. Along the flaps the ball's
/// border is left out.
#[test]
fn what_hides_a_fruit_is_no_border() {
    let strip = 0.012;
    let flap = part(ball(Vec3::new(0.0, 0.0, 0.5), 0.035 + 0.012), move |p| p.y.abs() > strip);
    let mut config = DetectorConfig::paper();
    config.gates.elongation.on = false;
    // The flaps cover more than the required share.
    let gate = &mut config.gates.radius.limit;
    *gate = gate.with_ends(20.0, 40.0).unwrap();
    assert_eq!(found(&[&ball_of(), &flap], &config).len(), 1);
    config.gates.hidden.on = false;
    let all = considered(&[&ball_of(), &flap], &config);
    assert!(all.iter().any(|c| c.refused_by == Some(Gate::Isolation)), "{all:?}");
    assert!(all.iter().all(|c| c.refused_by.is_some()), "{all:?}");
}

#[test]
fn cylinder() {
    // A foreshortened limb section about as long as thick.
    let limb = cylinder_along_x(Vec3::new(0.0, 0.01, 0.5), 0.03);
    let section = part(limb, |p| p.x.abs() < 0.03);
    only_this_gate_refuses(Gate::Cylinder, &[&section], &one_fit_a_patch(), |c| c.gates.cylinder.on = false);
}

#[test]
fn min_pixels() {
    let mut config = one_fit_a_patch();
    let far = ball(Vec3::new(0.0, 0.0, 1.3), 0.026);
    assert!(found(&[&far], &config).is_empty());
    config.segmentation.min_pixels = config.segmentation.min_pixels.with_value(8).unwrap();
    assert_eq!(found(&[&far], &config).len(), 1);
}

#[test]
fn walls_leaves_and_branches_are_no_fruit() {
    let config = DetectorConfig::paper();
    let tilted = Vec3::new(0.3, -0.2, 1.0);
    let wall = plane(Vec3::new(0.0, 0.0, 0.7), tilted);
    assert!(found(&[&wall], &config).is_empty());
    // A blade of 85 x 50 mm folded by 20 degrees along its midrib.
    let fold = 0.36;
    let half = |side: f64| {
        part(plane(Vec3::new(0.0, 0.0, 0.5), Vec3::new(0.1, side * fold, 1.0)), move |p: &Vec3| {
            let (x, y) = (p.x / 0.0425, p.y / 0.025);
            side * p.y >= 0.0 && x * x + y * y < 1.0
        })
    };
    let (left, right) = (half(1.0), half(-1.0));
    assert!(found(&[&left, &right], &config).is_empty());
    for radius in [0.008, 0.02, 0.035, 0.06] {
        let limb = cylinder_along_x(Vec3::new(0.0, 0.02, 0.55), radius);
        assert!(found(&[&limb], &config).is_empty(), "{radius}");
    }
}
