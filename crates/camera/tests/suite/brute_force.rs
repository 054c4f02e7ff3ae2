//! Compares the renderer with an independent ray caster: every ray against every item, through parry.

use super::common;
use super::ray_cast;

use super::direction::direction;
use super::shapes::{rotation, shapes};
use orchard_camera::{Frame, Label, NO_INSTANCE, Scene, picture::look_at, render};
use orchard_geometry::{Intrinsics, Pose, Vec3};
use orchard_spec::{Purpose, Stream};
use ray_cast::RayCaster;

/// Agreement asked of two float implementations at metres of range, f32 output \[m\].
const TOLERANCE: f64 = 1e-5;

/// Compares every pixel; a ray that grazes a silhouette within rounding may differ, and is counted instead.
fn compare(scene: &Scene, k: &Intrinsics, x: &Pose, near: f64, far: f64) -> (usize, usize) {
    let mut frame = Frame::new(1, 1);
    render(scene, k, x, near, far, &mut frame);
    let caster = RayCaster::new(scene);
    let (mut grazing, mut valid) = (0, 0);
    for v in 0..k.height {
        for u in 0..k.width {
            let hit = caster.at_pixel(k, x, u as f64, v as f64);
            let expected = hit.filter(|(z, _)| (near..=far).contains(z));
            let z = f64::from(frame.depth[(u, v)]);
            let agrees = match expected {
                Some((t, i)) => {
                    let item = &scene.items[i];
                    let same = frame.label[(u, v)] == item.label && frame.instance[(u, v)] == item.instance;
                    (z - t).abs() <= TOLERANCE && same
                }
                None => {
                    z == 0.0 && frame.label[(u, v)] == Label::None && frame.instance[(u, v)] == NO_INSTANCE
                }
            };
            valid += usize::from(expected.is_some());
            if !agrees {
                // The ray moved by a ten-thousandth of a pixel either way must meet the two answers.
                let answers = caster.beside_pixel(k, x, u as f64, v as f64);
                let answers = answers.map(|z| z.filter(|z| (near..=far).contains(z)));
                let explained = answers.iter().any(|a| (a.unwrap_or(0.0) - z).abs() <= 1e-3);
                assert!(explained, "({u}, {v}): rendered {z}, cast {hit:?}, around {answers:?}");
                grazing += 1;
            }
        }
    }
    (grazing, valid)
}

#[test]
fn orchard_scenes_agree() {
    let k = Intrinsics::from_vertical_fov(192, 144, 75_f64.to_radians());
    let eyes = [[-0.6, 0.1, 1.2], [0.3, -0.2, 1.0]];
    for (i, eye) in eyes.into_iter().enumerate() {
        let scene = common::orchard(i as u64, 350, 40);
        let x = look_at(&Vec3::from(eye), &Vec3::new(0.05, 0.0, 0.9));
        let (grazing, valid) = compare(&scene, &k, &x, 0.3, 3.0);
        assert!(valid > 2000, "the image must show something: {valid}");
        assert!(grazing * 1000 <= valid, "{grazing} of {valid}");
    }
}

/// Random shapes all around the camera: through the near plane, behind, about it.
#[test]
fn random_shapes_around_the_camera_agree() {
    let k = Intrinsics { width: 48, height: 40, fx: 30.0, fy: 41.0, cx: 20.3, cy: 22.8 };
    let mut rng = Stream::new(5, 0, Purpose::Test);
    let (mut grazing, mut valid) = (0, 0);
    for _ in 0..300 {
        let scene = shapes(&mut rng, 4);
        let x = Pose::from_parts((0.2 * direction(&mut rng)).into(), rotation(&mut rng));
        let (g, n) = compare(&scene, &k, &x, 0.1, 2.5);
        grazing += g;
        valid += n;
    }
    assert!(valid > 100_000 && grazing * 1000 <= valid, "{grazing} of {valid}");
}
