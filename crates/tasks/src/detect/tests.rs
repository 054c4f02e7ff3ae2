//! Whole fake runs, and metrics of hand-made records in closed form.

use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use orchard_bench::store::Store;
use orchard_bench::task::{NoProgress, Progress, RunError, Session};
use orchard_camera::Label;
use orchard_statistics::Metric;

use super::*;
use crate::detect::fake::{FakeTrees, hit, miss, plan, record, seen};
use crate::fake::progress::{CountingProgress, files};
use crate::zones::Zone;

fn go(folder: &Path, plan: &DetectPlan, threads: usize, progress: &CountingProgress) -> DetectResult {
    let store = Store::open(folder).unwrap();
    run(plan, &FakeTrees::new(), &Session::whole(&store, threads, &AtomicBool::new(false)), progress).unwrap()
}

#[test]
fn runs_repeat_go_on_and_count_what_cannot_be_built() {
    let (one, two) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let progress = CountingProgress::default();
    let result = go(one.path(), &plan(), 1, &progress);
    let whole = files(one.path(), "detect");
    assert_eq!(whole.len(), 7);
    for (tree, key) in result.records.iter().zip(plan().keys()) {
        let file = &whole[&<DetectRecord as orchard_bench::record::Record>::file(&key)];
        assert_eq!(
            &serde_json::from_str::<DetectRecord>(file).unwrap(),
            tree,
            "a file gives back its record"
        );
    }
    // Two trees of the first seed with the ablation, two of the other without.
    let keys = plan().keys();
    let steps: u64 = [0, 1, 3, 4].iter().map(|&i: &usize| plan().steps(&keys[i])).sum();
    assert_eq!(u64::from(progress.steps()), steps);

    // World 2 of each seed is counted and does not affect the other metrics.
    assert_eq!(result.summary.as_ref().unwrap().quarantined, 2);
    assert_eq!(
        result.summary.as_ref().unwrap().trees[2].quarantined.as_deref(),
        Some("no static equilibrium")
    );
    let images: Vec<u32> =
        result.summary.as_ref().unwrap().densities.iter().map(|d| d.results.images).collect();
    assert_eq!(images, [8; 5]);
    assert!(result.summary.as_ref().unwrap().ablation.variants.values().all(|variant| variant.images == 4));
    // The fake apples hang free: without leaves most are found, and nothing else is.
    let bare = &result.summary.as_ref().unwrap().densities[0].results;
    assert_eq!(bare.metrics["precision"].mean, Some(1.0));
    assert!(bare.metrics["recall"].mean.unwrap() > 0.9, "{:?}", bare.metrics["recall"]);
    // Exact depth on balls: a sphere through them is exact to the f32 of a depth.
    assert!(bare.errors["centre_error_p95_m"].value.unwrap() < 1e-4);
    // The detector as it is and the ablation's first variant are the same detector.
    let nominal = result.summary.as_ref().unwrap().at(0.6).unwrap();
    let tree = &result.records[0];
    let at = |foliage| tree.densities.iter().find(|d| d.foliage == foliage).unwrap();
    let detections: Vec<_> = at(0.6).images.iter().map(|image| image.detections.clone()).collect();
    assert_eq!(tree.variants[0].images, detections);
    assert_eq!(nominal.results.images, 8);

    // Two threads: the same bytes. A run continued from a folder with one whole and one damaged file ends with them too.
    fs::create_dir(two.path().join("detect")).unwrap();
    fs::copy(one.path().join("detect/7-001.json"), two.path().join("detect/7-001.json")).unwrap();
    fs::write(two.path().join("detect/8-000.json"), "{").unwrap();
    let progress = CountingProgress::default();
    go(two.path(), &plan(), 2, &progress);
    assert_eq!(progress.counts(), (5, 1));
    assert_eq!(files(two.path(), "detect"), whole);

    // Another detector does not belong into the same folder.
    let mut other = plan();
    other.scene_hash = "another detector".to_owned();
    let store = Store::open(two.path()).unwrap();
    let error =
        run(&other, &FakeTrees::new(), &Session::whole(&store, 1, &AtomicBool::new(false)), &NoProgress)
            .unwrap_err();
    assert!(error.to_string().contains("has config_hash "), "{error}");
}

#[test]
fn what_makes_a_result_is_in_its_key() {
    let hash = plan().config_hash();
    let changes: [fn(&mut DetectPlan); 3] = [
        |p| p.scene_hash = "another camera".to_owned(),
        |p| p.protocol.detect.views = p.protocol.detect.views.with_value(3).unwrap(),
        |p| p.protocol.version.push('x'),
    ];
    for change in changes {
        let mut other = plan();
        change(&mut other);
        assert_ne!(other.config_hash(), hash);
    }
    let keys = plan().keys();
    assert_eq!(keys.iter().map(|k| (k.seed, k.ablation)).collect::<Vec<_>>()[2..4], [(7, true), (8, false)]);
}

#[test]
fn an_interrupted_run_leaves_whole_files_and_no_summary() {
    struct StopAfterOne<'a>(&'a AtomicBool);
    impl Progress<DetectRecord> for StopAfterOne<'_> {
        fn record(&self, _: &DetectRecord, _: bool) {
            self.0.store(true, Ordering::Relaxed);
        }
    }
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("detect.json"), "old").unwrap();
    let store = Store::open(folder.path()).unwrap();
    let stop = AtomicBool::new(false);
    let error =
        run(&plan(), &FakeTrees::new(), &Session::whole(&store, 1, &stop), &StopAfterOne(&stop)).unwrap_err();
    assert!(matches!(error, RunError::Interrupted { done: 1, total: 6, .. }), "{error}");
    assert_eq!(files(folder.path(), "detect").keys().collect::<Vec<_>>(), ["7-000.json"]);
}

#[test]
fn bad_plans_are_refused_before_anything_is_touched() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("detect.json"), "old").unwrap();
    let store = Store::open(folder.path()).unwrap();
    for (plan, message) in [
        (DetectPlan { seeds: Vec::new(), ..plan() }, "no seed given"),
        (DetectPlan { seeds: vec![4, 4], ..plan() }, "seed 4 is given twice"),
        (DetectPlan { trees: 0, ..plan() }, "0 trees: at least 1 tree per seed is needed"),
    ] {
        let error =
            run(&plan, &FakeTrees::new(), &Session::whole(&store, 1, &AtomicBool::new(false)), &NoProgress)
                .unwrap_err();
        assert_eq!(error.to_string(), message);
    }
    assert!(folder.path().join("detect.json").exists());
}

#[test]
fn trees_that_differ_in_more_than_leaves_are_no_pairs() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).unwrap();
    let plan = DetectPlan { seeds: vec![7], trees: 1, ..plan() };
    let trees = FakeTrees { moved: 1e-9, ..FakeTrees::new() };
    let result =
        run(&plan, &trees, &Session::whole(&store, 1, &AtomicBool::new(false)), &NoProgress).unwrap();
    assert_eq!(result.records[0].quarantined.as_deref(), Some("wood, fruit or views differ at foliage 0.3"));
}

/// Changes only the label of the solids: the scores change, the detections do not.
#[test]
fn the_detector_sees_no_label() {
    let plan = DetectPlan { seeds: vec![7], trees: 1, ..plan() };
    let detect = |fruit_label| {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path()).unwrap();
        let trees = FakeTrees { fruit_label, ..FakeTrees::new() };
        run(&plan, &trees, &Session::whole(&store, 1, &AtomicBool::new(false)), &NoProgress)
            .unwrap()
            .records
            .remove(0)
    };
    let (named, unnamed) = (detect(Label::Fruit), detect(Label::Scenery));
    let found = |tree: &DetectRecord| -> Vec<_> {
        let images = tree.densities.iter().flat_map(|density| &density.images);
        let detections = images.flat_map(|image| &image.detections);
        detections.map(|d| (d.p_world, d.radius, d.rms, d.pixels)).collect()
    };
    assert!(!found(&named).is_empty());
    assert_eq!(found(&named), found(&unnamed));
    assert!(unnamed.densities[0].images.iter().all(|image| image.fruit.is_empty()));
    assert!(named.densities[0].images.iter().any(|image| !image.fruit.is_empty()));
}

/// Spheres that only the score refuses are recorded beside the detections; the detections are those of the detector with its own threshold.
#[test]
fn spheres_below_the_threshold_are_recorded() {
    let mut plan = DetectPlan { seeds: vec![7], trees: 1, ..plan() };
    plan.detector = orchard_perception::DetectorConfig::named("scored").unwrap();
    // Exact images of balls leave no doubt: with this threshold what scores less than 1 is refused.
    plan.detector.score.least = plan.detector.score.least.with_value(1.0).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let tree = go(folder.path(), &plan, 1, &CountingProgress::default()).records.remove(0);
    let least = plan.detector.score.least.si();
    let images: Vec<_> = tree.densities.iter().flat_map(|density| &density.images).collect();
    assert!(images.iter().flat_map(|image| &image.detections).all(|d| d.score >= least));
    let below: Vec<f64> =
        images.iter().flat_map(|image| &image.below_threshold).map(|sphere| sphere.score).collect();
    let lowest = plan.protocol.detect.ranking.least_score.si();
    assert!(!below.is_empty() && below.iter().all(|score| (lowest..least).contains(score)), "{below:?}");
    let nominal = tree.densities.iter().find(|density| density.foliage == 0.6).unwrap();
    let detections: Vec<_> = nominal.images.iter().map(|image| image.detections.clone()).collect();
    assert_eq!(tree.variants[0].images, detections);
}

/// A detector that looks at colour gets a picture of each view: without one no tree would have a record.
#[test]
fn a_detector_of_colour_gets_colour() {
    let mut plan = DetectPlan { seeds: vec![7], trees: 1, ..plan() };
    plan.detector = orchard_perception::DetectorConfig::named("learned-colour").unwrap();
    let folder = tempfile::tempdir().unwrap();
    let tree = go(folder.path(), &plan, 1, &CountingProgress::default()).records.remove(0);
    assert_eq!(tree.quarantined, None);
    let images = tree.densities.iter().flat_map(|density| &density.images);
    assert!(images.flat_map(|image| &image.detections).any(|d| d.fruit.is_some()));
}

/// Two trees at foliage 0, worked out by hand, and nothing at the other densities.
fn two_trees(plan: &DetectPlan) -> Vec<DetectRecord> {
    use Zone::{LowerInner, MiddleInner, UpperOuter};
    let image = |fruit, detections| ImageRecord {
        p_world_camera: [1.0, 0.0, 1.0],
        r_world_camera: [0.0, 0.0, 0.0, 1.0],
        fruit,
        detections,
        below_threshold: Vec::new(),
    };
    let track = |fruit, confirmed| TrackRecord { p_world: [0.0; 3], radius: 0.03, hits: 1, confirmed, fruit };
    let keys = plan.keys();
    let mut a = record(&keys[0], &[Some(MiddleInner), Some(UpperOuter), None]);
    a.densities[0].images = vec![
        image(
            // In range and plain; in range and hidden; out of range.
            vec![seen(0, 50, 100, true, true), seen(1, 10, 100, true, false), seen(2, 20, 20, false, false)],
            vec![
                hit(0, 0.002, 0.001, MiddleInner),
                hit(1, 0.004, -0.003, UpperOuter),
                miss(SitsOn::Wood, MiddleInner),
            ],
        ),
        image(vec![seen(0, 40, 100, true, true)], Vec::new()),
    ];
    a.densities[0].tracks = vec![track(Some(0), true), track(Some(1), false), track(None, true)];
    let mut b = record(&keys[1], &[Some(MiddleInner)]);
    let leaf = || miss(SitsOn::Leaf, LowerInner);
    b.densities[0].images = vec![image(vec![seen(0, 80, 100, true, true)], vec![leaf(), leaf()])];
    let c = DetectRecord::never_seen(keys[2].clone(), "no equilibrium".into());
    vec![a, b, c]
}

#[test]
fn closed_forms() {
    let plan = DetectPlan { seeds: vec![7], ..plan() };
    let summary = DetectSummary::of_run(&plan, &two_trees(&plan));
    let bare = &summary.densities[0];
    let expected = [
        ("precision", 2.0 / 5.0, 5),
        ("recall", 1.0 / 3.0, 3),
        ("recall_visible", 2.0 / 5.0, 5),
        ("false_positives_per_view", 1.0, 3),
        ("wood_false_positives_per_view", 1.0 / 3.0, 3),
        ("radius_bias_m", -0.001, 2),
        ("diameter_error_m", 0.004, 2),
        ("survey_recall", 1.0 / 2.0, 2),
        ("survey_recall_all", 2.0 / 4.0, 4),
        ("track_precision", 1.0 / 2.0, 2),
        ("track_recall", 1.0 / 2.0, 2),
    ];
    assert_eq!(expected.len(), METRICS.len());
    for (name, mean, n) in expected {
        let metric = &bare.results.metrics[name];
        // Rounding of a sum of two.
        assert!((metric.mean.unwrap() - mean).abs() < 1e-15 && metric.n == n, "{name}: {metric:?}");
    }
    // Resamples of two trees: A A, A B and B B.
    assert_eq!(bare.results.metrics["precision"].ci95, [Some(0.0), Some(2.0 / 3.0)]);
    let errors = &bare.results.errors;
    let near = |name: &str, value: f64| (errors[name].value.unwrap() - value).abs() < 1e-15;
    assert!(near("centre_error_median_m", 0.003));
    assert!(near("centre_error_p95_m", 0.002 + 0.95 * 0.002));
    assert!(near("radius_error_median_m", 0.002));
    // B B has no error and is left out.
    let [low, high] = errors["centre_error_median_m"].ci95;
    assert_eq!((low, high, errors["centre_error_median_m"].n), (low, low, 2));
    assert_eq!((bare.results.images, bare.results.detections, bare.results.true_positives), (3, 5, 2));
    let false_positives: Vec<_> = bare.results.false_positives.clone().into_iter().collect();
    assert_eq!(false_positives, [(SitsOn::Leaf, 2), (SitsOn::Wood, 1)]);
    let bins: Vec<_> = bare.recall_by_visible_fraction.iter().map(|b| (b.fruit, b.found, b.recall)).collect();
    // 10 %; 50 and 40 %; 80 %. What is out of range is in no bin.
    let some = |fruit, found, recall| (fruit, found, Some(recall));
    assert_eq!(bins, [some(1, 1, 1.0), (0, 0, None), some(2, 1, 0.5), (0, 0, None), some(1, 0, 0.0)]);
    let zone = |zone| {
        let z = &bare.zones[&zone];
        (z.detections, z.true_positives, z.precision, z.expected, z.found, z.recall)
    };
    assert_eq!(zone(Zone::MiddleInner), (2, 1, Some(0.5), 3, 1, Some(1.0 / 3.0)));
    assert_eq!(zone(Zone::UpperOuter), (1, 1, Some(1.0), 0, 0, None));
    assert_eq!(zone(Zone::LowerInner), (2, 0, Some(0.0), 0, 0, None));
    assert_eq!((summary.quarantined, bare.leaves), (1, 6));
}

#[test]
fn nothing_to_measure_is_null() {
    let plan = DetectPlan { seeds: vec![7], ..plan() };
    let summary = DetectSummary::of_run(&plan, &two_trees(&plan));
    let undefined = Some(orchard_statistics::Undefined::NothingToMeasure);
    let nothing = Metric { mean: None, ci95: [None, None], n: 0, undefined };
    // No image was taken there.
    let empty = &summary.densities[1].results;
    assert!(empty.metrics.values().filter(|m| **m == nothing).count() == METRICS.len() - 1, "{empty:?}");
    // There was fruit, but none was found.
    assert_eq!(empty.metrics["survey_recall_all"].mean, Some(0.0));
    for spread in empty.errors.values() {
        assert_eq!((spread.value, spread.ci95, spread.n), (None, [None, None], 0));
    }
    // No tree at all.
    let none = DetectSummary::of_run(&plan, &two_trees(&plan)[2..]);
    assert!(none.densities.iter().all(|d| d.results.metrics.values().all(|m| *m == nothing)));
    assert!(none.ablation.variants.values().all(|v| v.metrics.values().all(|m| *m == nothing)));
}
