//! Prints precision and recall of the detector on hand-made orchard scenes, and the number of candidates by gate.

#[path = "../tests/suite/common/mod.rs"]
mod common;
#[path = "../tests/suite/common/score.rs"]
mod score;

use orchard_geometry::Intrinsics;
use orchard_perception::DetectorConfig;
use score::{Score, add_image, vantages};

fn main() {
    let k = Intrinsics::from_vertical_fov(192, 144, 75_f64.to_radians());
    let config = DetectorConfig::paper();
    for leaves in [0, 100, 350, 700] {
        for refine in [false, true] {
            let mut config = config.clone();
            config.fit.refine = refine;
            let mut score = Score::default();
            for seed in 0..4 {
                let scene = common::orchard(seed, leaves, 40);
                for x in vantages(12) {
                    add_image(&mut score, &scene, &k, &x, &config, |_| {});
                }
            }
            println!(
                "{leaves} leaves, refine {refine}: precision {:.3}, recall {:.3}, {score:?}",
                score.precision(),
                score.recall()
            );
        }
    }
}
