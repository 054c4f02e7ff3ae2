use super::*;
use crate::detect::fake::{hit, plan, record, seen};
use crate::detect::record::ScoredSphere;
use crate::zones::Zone;

/// A tree with fruit of radius 0.04 at x = 0, 1, 2 and 3, and one image: fruit 0 and 1 count, 2 shows too little, 3 no pixel.
fn tree(plan: &DetectPlan, spheres: &[(f64, f64)]) -> DetectRecord {
    let zones = [Zone::LowerInner, Zone::LowerOuter, Zone::LowerInner, Zone::LowerInner].map(Some);
    let mut tree = record(&plan.keys()[0], &zones);
    for (fruit, x) in tree.fruit.iter_mut().zip([0.0, 1.0, 2.0, 3.0]) {
        (fruit.p_world, fruit.radius) = ([x, 0.0, 0.0], 0.04);
    }
    let (above, below): (Vec<_>, Vec<_>) = spheres.iter().partition(|(_, score)| *score >= 0.4);
    tree.densities[0].images = vec![ImageRecord {
        p_world_camera: [1.0, 0.0, 1.0],
        r_world_camera: [0.0, 0.0, 0.0, 1.0],
        fruit: vec![
            seen(0, 50, 100, true, true),
            seen(1, 90, 100, true, true),
            seen(2, 30, 100, true, false),
        ],
        detections: above
            .iter()
            .map(|&&(x, score)| {
                let hit = hit(0, 0.0, 0.0, Zone::LowerInner);
                crate::detect::record::DetectionRecord { p_world: [x, 0.0, 0.0], score, ..hit }
            })
            .collect(),
        below_threshold: below
            .iter()
            .map(|&&(x, score)| ScoredSphere { p_world: [x, 0.0, 0.0], radius: 0.03, score })
            .collect(),
    }];
    tree
}

fn summary(spheres: &[(f64, f64)]) -> RankingSummary {
    let plan = plan();
    let tree = tree(&plan, spheres);
    let resamples = Resamples::draw(&[vec![0]], &plan.protocol.bootstrap);
    ranked(&plan, &[(&tree, Some(&tree.densities[0]))], &resamples)
}

/// Spheres at (x, score): what is right, wrong, neither.
#[test]
fn verdicts_by_hand() {
    let spheres = [
        (0.01, 0.9), // a quarter of a radius from fruit 0: right
        (0.0, 0.8),  // fruit 0 again: wrong, though it is nearer
        (1.03, 0.7), // three quarters of a radius from fruit 1: right within 1, wrong within 0.5
        (2.03, 0.6), // fruit 2 does not count: neither
        (3.0, 0.5),  // fruit 3 shows no pixel: wrong
        (1.0, 0.2),  // fruit 1: wrong within 1, since it is found; right within 0.5
        (5.0, 0.1),  // nothing there: wrong
    ];
    let summary = summary(&spheres);
    let ap = |radii: &str| (summary.ap[radii].value.unwrap(), summary.ap[radii].n);
    // Within 1: right, wrong, right, wrong, wrong, wrong. Within 0.5: right, wrong, wrong, wrong, right, wrong.
    assert_eq!(ap("1"), ((1.0 + 2.0 / 3.0) / 2.0, 2));
    assert_eq!(ap("0.5"), ((1.0 + 2.0 / 5.0) / 2.0, 2));
    assert_eq!(summary.ap["1"].ci95, [None, None], "one tree has no interval");
    let curve = &summary.curves["1"];
    assert_eq!((curve[0].recall, curve[0].precision, curve[0].score), (0.5, 1.0, 0.9));
    let last = curve.last().unwrap();
    assert_eq!((last.recall, last.precision, last.score), (1.0, 2.0 / 6.0, 0.1));

    // Fruit 0 shows half, fruit 1 nine tenths; wrong spheres count in each bin, those on other fruit in none.
    let bins = &summary.by_visible_fraction;
    assert_eq!(bins.iter().map(|bin| bin.ranked.fruit).collect::<Vec<_>>(), [0, 1, 1, 0, 1]);
    assert_eq!(bins[0].ranked.ap["1"], None);
    assert_eq!(bins[2].ranked.ap["1"], Some(1.0));
    assert_eq!(bins[4].ranked.ap["1"], Some(1.0));
    assert_eq!(bins[4].ranked.ap["0.5"], Some(1.0 / 3.0), "behind 1.03 and the fruit without a pixel");
    // Fruit 2, whose share is below that which counts, has a bin of its own.
    assert_eq!(bins[1].ranked.ap["1"], Some(1.0));
    // Without a zone frame no wrong sphere has a zone.
    assert_eq!(summary.by_zone[&Zone::LowerOuter].fruit, 1);
    assert_eq!(summary.by_zone[&Zone::LowerOuter].ap["1"], Some(1.0));
    assert_eq!(summary.by_zone[&Zone::UpperOuter].ap["1"], None);

    let calibration = &summary.calibration;
    let squares: [f64; 6] = [0.1 * 0.1, 0.8 * 0.8, 0.3 * 0.3, 0.25, 0.2 * 0.2, 0.1 * 0.1];
    assert!((calibration.brier.mean.unwrap() - squares.iter().sum::<f64>() / 6.0).abs() < 1e-15);
    assert_eq!(calibration.bins.iter().map(|bin| bin.n).sum::<u32>(), 6);
}

#[test]
fn nothing_found_is_zero_and_nothing_to_find_is_null() {
    assert_eq!(summary(&[]).ap["1"].value, Some(0.0));
    assert_eq!(summary(&[]).calibration.brier.mean, None);
    assert!(summary(&[]).curves["1"].is_empty());
    let plan = plan();
    let tree = tree(&plan, &[(0.0, 0.9)]);
    let resamples = Resamples::draw(&[vec![0]], &plan.protocol.bootstrap);
    let none = ranked(&plan, &[(&tree, None)], &resamples);
    assert_eq!((none.ap["1"].value, none.ap["1"].n), (None, 0));
}

/// Fruit counts within the camera's range, which is wider than the detector's.
#[test]
fn the_range_is_the_cameras() {
    let plan = plan();
    assert_eq!(plan.camera.range(), (0.3, 3.0));
    let resamples = Resamples::draw(&[vec![0]], &plan.protocol.bootstrap);
    for (depth, counting) in [(0.29, 1), (1.0, 2), (2.9, 2), (3.1, 1)] {
        let mut tree = tree(&plan, &[(0.0, 0.9)]);
        tree.densities[0].images[0].fruit[0].depth = depth;
        let summary = ranked(&plan, &[(&tree, Some(&tree.densities[0]))], &resamples);
        assert_eq!(summary.ap["1"].n, counting, "{depth}");
    }
}
