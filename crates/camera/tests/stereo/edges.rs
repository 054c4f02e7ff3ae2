//! Position of the measured edge of a straight object.

use crate::Camera;
use orchard_camera::Scene;
use orchard_geometry::math;

/// Last column of the near wall.
const EDGE: usize = 60;
const COLUMNS: usize = 110;
const ROWS: usize = 4096;
const IMAGES: u32 = 8;

/// A slit of an image: few columns, many rows, pixels as large as the d435i's.
fn slit() -> Camera {
    let fov = |n: usize, f: f64| 2.0 * math::atan2(0.5 * n as f64, f).to_degrees();
    let mut text = "[d435i]\nsunlight = { value = 0, range = [0, 1], unit = '1', source = 'x' }\n".to_owned();
    text += "edge_ramp = { value = 0, range = [0, 15], unit = 'px', source = 'x' }\n[d435i.view]\n";
    for (axis, n) in [("width", COLUMNS), ("height", ROWS)] {
        text += &format!("{axis} = {{ value = {n}, range = [1, 8192], unit = 'px', source = 'x' }}\n");
    }
    for (axis, n) in [("horizontal_fov", COLUMNS), ("vertical_fov", ROWS)] {
        text += &format!(
            "{axis} = {{ value = {}, range = [0, 180], unit = 'deg', source = 'x' }}\n",
            fov(n, 446.8)
        );
    }
    Camera::from_toml(&text)
}

/// True for each pixel that shows the near wall, column by column, top to bottom, image by image.
fn near_columns(camera: &Camera) -> Vec<Vec<Vec<bool>>> {
    let (z_near, z_far) = (1.0, 2.0);
    let mut scene = Scene::default();
    camera.wall(&mut scene, z_near, 0..=EDGE);
    camera.wall(&mut scene, z_far, 0..=COLUMNS - 1);
    let image = |frame| {
        let measured = camera.take(&scene, frame).measured;
        let is_near = |u: usize, v: usize| {
            let z = f64::from(measured[(u, v)]);
            assert!(z > 0.0, "nothing is hidden right of a near thing, yet pixel ({u}, {v}) is missing");
            z < 0.5 * (z_near + z_far)
        };
        (EDGE - 8..=EDGE + 8).map(|u| (0..ROWS).map(|v| is_near(u, v)).collect()).collect()
    };
    (0..IMAGES).map(image).collect()
}

/// Distribution function of a normal deviate.
fn normal_share(t: f64) -> f64 {
    0.5 * math::erfc(-t / std::f64::consts::SQRT_2)
}

/// Probability that two normal deviates with a correlation are both below t, by the integral over the correlation of
/// their density at (t, t) (Sheppard's).
fn both_below(t: f64, correlation: f64) -> f64 {
    const STEPS: usize = 2000;
    let density = |r: f64| math::exp(-t * t / (1.0 + r)) / (std::f64::consts::TAU * (1.0 - r * r).sqrt());
    let h = correlation / STEPS as f64;
    let middle = |i: usize| density((i as f64 + 0.5) * h);
    normal_share(t) * normal_share(t) + (0..STEPS).map(middle).sum::<f64>() * h
}

/// Correlation of the displacement at a lag along an edge: of noise that was averaged over w pixels twice.
fn correlation(w: usize, lag: usize) -> f64 {
    let weights: Vec<f64> = (1..=w).chain((1..w).rev()).map(|x| x as f64).collect();
    let product = |lag: usize| weights.iter().zip(weights.iter().skip(lag)).map(|(a, b)| a * b).sum::<f64>();
    product(lag) / product(0)
}

/// A pixel shows what lies a displacement away: column u is near where u plus the displacement is at most EDGE + 1/2.
/// So the share of near pixels falls over the columns as the normal distribution does, with its middle at the true edge.
#[test]
fn edges_lie_where_the_displacement_puts_them() {
    let camera = slit();
    let (w, sd) = (camera.window(), camera.spec.edge_shift.si());
    let images = near_columns(&camera);
    let n = f64::from(IMAGES) * ROWS as f64;
    // Rows along the edge are alike: the mean of n counts as one of n over the sum of the correlations. (That of a
    // threshold is nearer to 0 than that of the displacement.)
    let alike = 1.0 + 2.0 * (1..2 * w).map(|k| correlation(w, k)).sum::<f64>();
    let threshold = |u: usize| (EDGE as f64 + 0.5 - u as f64) / sd;
    for k in 0..=16 {
        let expected = normal_share(threshold(EDGE - 8 + k));
        let share = images.iter().flat_map(|image| &image[k]).filter(|near| **near).count() as f64 / n;
        // Sums of uniform numbers are not quite normal: a hundredth of their excess kurtosis, -0.05, at most.
        let allowed = 5.0 * (expected * (1.0 - expected) * alike / n).sqrt() + 0.0005;
        assert!((share - expected).abs() < allowed, "column {k}: {share} {expected}");
    }
    // The mean place of the edge is the true one, its spread that of the displacement.
    let places = |image: &Vec<Vec<bool>>| -> Vec<f64> {
        (0..ROWS).map(|v| image.iter().filter(|column| column[v]).count() as f64 - 9.0).collect()
    };
    let places: Vec<f64> = images.iter().flat_map(places).collect();
    let mean = places.iter().sum::<f64>() / n;
    assert!(mean.abs() < 5.0 * sd * (alike / n).sqrt(), "{mean}");

    let k = 8;
    let t = threshold(EDGE);
    for lag in [1, 2, 3, 5, 8, 2 * w] {
        let pairs = images.iter().flat_map(|image| image[k].iter().zip(&image[k][lag..]));
        let both = pairs.filter(|(a, b)| **a && **b).count() as f64 / (n - f64::from(IMAGES) * lag as f64);
        let expected = both_below(t, if lag < 2 * w { correlation(w, lag) } else { 0.0 });
        // Pairs that are farther apart than the windows reach are independent of each other.
        let alike = (2 * (2 * w + lag) + 1) as f64;
        let allowed = 5.0 * (expected * (1.0 - expected) * alike / n).sqrt();
        assert!((both - expected).abs() < allowed, "lag {lag}: {both} {expected}");
    }
}

#[test]
fn a_small_step_becomes_a_ramp_as_wide_as_the_window_and_a_large_one_a_gap() {
    // Without noise of any kind.
    let camera = Camera::from_toml(
        "[d435i]
sunlight = { value = 0, range = [0, 1], unit = '1', source = 'x' }
\
         edge_shift = { value = 0, range = [0, 1], unit = 'px', source = 'x' }
\
         disparity_noise = { low = 0, high = 0, range = [0, 1], unit = 'px', source = 'x' }
",
    );
    let radius = camera.spec.edge_ramp.get() as usize;
    assert_eq!(2 * radius + 1, camera.window());
    let edge = 400;
    for (z_far, has_gap) in [(1.12, false), (1.4, true)] {
        let mut scene = Scene::default();
        camera.wall(&mut scene, 1.0, 0..=edge);
        camera.wall(&mut scene, z_far, 0..=camera.sensor.intrinsics().width - 1);
        let measured = camera.take(&scene, 0).measured;
        let row = |u: usize| f64::from(measured[(u, 200)]);
        // Two standard deviations of a half-filled window are the whole step.
        let step = camera.disparity(1.0) - camera.disparity(z_far);
        assert_eq!(0.5 * step > camera.spec.edge_limit.si(), has_gap);
        assert_eq!(row(edge) == 0.0, has_gap, "step to {z_far} m");
        let ends = [edge - radius, edge + radius + 1].map(row);
        assert!(
            (ends[0] - 1.0).abs() < 1e-3 && (ends[1] - z_far).abs() < 2e-3,
            "step to {z_far} m: {ends:?}"
        );
        if !has_gap {
            // Equal steps of disparity, so that none of depth is much more than its share.
            let most = 1.5 * (z_far - 1.0) / (2 * radius + 1) as f64;
            for u in edge - radius..=edge + radius {
                assert!((0.0..most).contains(&(row(u + 1) - row(u))), "pixel {u}: {} {}", row(u), row(u + 1));
            }
        }
    }
}
