//! The detector on rendered orchard scenes. It sees the depth image and nothing else; the truth only scores it.

mod common;
#[path = "common/score.rs"]
mod score;

use orchard_camera::Frame;
use orchard_geometry::Intrinsics;
use orchard_perception::DetectorConfig;
use orchard_spec::{Purpose, Stream};
use score::{Score, add_image, vantages};

fn score_scenes(config: &DetectorConfig, leaves: usize, disturb: impl Fn(&mut Frame, &mut Stream)) -> Score {
    let k = Intrinsics::from_vertical_fov(192, 144, 75_f64.to_radians());
    let mut score = Score::default();
    let mut rng = Stream::new(3, 0, Purpose::SensorNoise);
    for seed in 0..3 {
        let scene = common::orchard(seed, leaves, 40);
        for x in vantages(8) {
            add_image(&mut score, &scene, &k, &x, config, |frame| disturb(frame, &mut rng));
        }
    }
    assert!(score.visible > 200, "{score:?}");
    score
}

#[test]
fn nominal_scenes() {
    let score = score_scenes(&DetectorConfig::paper(), 350, |_, _| {});
    assert!(score.precision() >= 0.95 && score.recall() >= 0.80, "{score:?}");
}

#[test]
fn foliage_costs_recall() {
    let recall = |leaves| score_scenes(&DetectorConfig::paper(), leaves, |_, _| {}).recall();
    let (bare, dense) = (recall(0), recall(900));
    assert!(bare >= 0.9 && dense >= 0.6 && dense < bare, "{bare} {dense}");
}

/// Depth noise of the band that the config states (three sigma).
#[test]
fn noise_as_wide_as_the_band_is_survived() {
    let config = DetectorConfig::paper();
    let sigma = config.fit.band.si() / 3.0;
    let score = score_scenes(&config, 350, |frame, rng| {
        for z in frame.depth.pixels_mut() {
            if *z > 0.0 {
                *z += rng.normal(0.0, sigma) as f32;
            }
        }
    });
    assert!(score.precision() >= 0.9 && score.recall() >= 0.6, "{score:?}");
}

/// Stereo noise as it is stated for a D435i, sigma_z = z^2 s / (f B), correlated over 3 x 3 pixels: the detector that knows of it
/// stands it, the one for an exact camera does not.
#[test]
fn stereo_noise_needs_the_band_that_grows_with_depth() {
    let k = Intrinsics { width: 848, height: 480, fx: 446.8, fy: 446.8, cx: 423.5, cy: 239.5 };
    let per_square_metre = 0.08 / (446.8 * 0.05);
    let score = |config: &DetectorConfig| {
        let mut rng = Stream::new(3, 0, Purpose::SensorNoise);
        let mut score = Score::default();
        let scene = common::orchard(1, 350, 40);
        for x in vantages(4) {
            add_image(&mut score, &scene, &k, &x, config, |frame| {
                let white: Vec<f64> = (0..k.width * k.height).map(|_| rng.normal(0.0, 1.0)).collect();
                for v in 1..k.height - 1 {
                    for u in 1..k.width - 1 {
                        let z = f64::from(frame.depth[(u, v)]);
                        let window = (v - 1..v + 2).flat_map(|v| white[v * k.width + u - 1..][..3].iter());
                        // Nine variances of one.
                        let correlated = window.sum::<f64>() / 3.0;
                        frame.depth[(u, v)] = (z + z * z * per_square_metre * correlated) as f32;
                    }
                }
            });
        }
        score
    };
    let (knows, exact) = (score(&DetectorConfig::d435i()), score(&DetectorConfig::paper()));
    assert!(knows.precision() >= 0.9 && knows.recall() >= 0.6, "{knows:?}");
    assert!(exact.recall() < 0.5 * knows.recall(), "{exact:?}");
}
