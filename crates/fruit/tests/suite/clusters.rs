//! Clusters of fruit on grown trees.

use orchard_fruit::{Fruit, place};
use orchard_spec::{Preset, Spec};
use orchard_treegen::grow;

fn spec(preset: Preset) -> Spec {
    Spec::preset(preset)
}

/// Sizes of the clusters of a tree, from its fruit, which stand together.
fn sizes(fruit: &[Fruit]) -> Vec<usize> {
    fruit.chunk_by(|a, b| a.site == b.site).map(<[Fruit]>::len).collect()
}

/// Every preset but `paper` and what is made of it without stems that bend.
const CLUSTERED: [Preset; 5] = [
    Preset::Calibrated,
    Preset::CalibratedMature,
    Preset::TallSpindle,
    Preset::VTrellis,
    Preset::VerticalUfo,
];

#[test]
fn fruit_of_a_cluster_hang_side_by_side_and_touch_nothing() {
    for preset in CLUSTERED {
        let spec = spec(preset);
        let skeleton = grow(&spec, 1, 0).unwrap();
        let fruit = place(&spec.fruit, &skeleton, 1, 0);
        assert_eq!(fruit, place(&spec.fruit, &skeleton, 1, 0), "{preset:?}: not repeatable");
        let count = spec.fruit.count.get() as usize;
        assert!(fruit.len() <= count && fruit.len() * 100 >= count * 95, "{preset:?}: {}", fruit.len());
        for (i, a) in fruit.iter().enumerate() {
            for b in &fruit[..i] {
                let apart = (a.p_hang_world - b.p_hang_world).norm() - a.radius - b.radius;
                assert!(apart > 0.0, "{preset:?}: overlap by {apart} m");
            }
        }
        // Two neighbours of every cluster are as near as the gap lets them be.
        for cluster in fruit.chunk_by(|a, b| a.site == b.site).filter(|cluster| cluster.len() > 1) {
            let reach = |a: &Fruit, b: &Fruit| (a.p_segment - b.p_segment).norm() / (a.radius + b.radius);
            let pairs =
                cluster.iter().enumerate().flat_map(|(i, a)| cluster[..i].iter().map(move |b| (a, b)));
            let nearest = pairs.map(|(a, b)| reach(a, b)).fold(f64::INFINITY, f64::min);
            let gap = spec.fruit.cluster.as_ref().unwrap().gap.si();
            assert!((nearest - gap).abs() < 1e-9, "{preset:?}: {nearest}");
        }
    }
}

/// Over many trees the sizes are those that the law draws: a site without room is left for a smaller cluster, and the last is cut.
#[test]
fn sizes_of_clusters_follow_their_law() {
    let spec = spec(Preset::Calibrated);
    let law = spec.fruit.cluster.as_ref().unwrap();
    let mut counts = vec![0_usize; law.shares.len()];
    for world in 0..20 {
        let skeleton = grow(&spec, 3, world).unwrap();
        for size in sizes(&place(&spec.fruit, &skeleton, 3, world)) {
            counts[size - 1] += 1;
        }
    }
    let all: usize = counts.iter().sum();
    let (mut seen, mut asked, mut furthest) = (0.0, 0.0, 0.0_f64);
    for (count, share) in counts.iter().zip(&law.shares) {
        seen += *count as f64 / all as f64;
        asked += share.si();
        furthest = furthest.max((seen - asked).abs());
    }
    // The 95 % null of Kolmogorov and Smirnov.
    assert!(furthest < 1.36 / (all as f64).sqrt(), "{counts:?} of {all}: {furthest}");
}

/// More fruit than a tree has room for: it bears what it has room for, as clusters of all sizes or as single fruit.
#[test]
fn a_tree_without_room_bears_fewer() {
    let mut spec = spec(Preset::Calibrated);
    spec.fruit.count = spec.fruit.count.with_value(400).unwrap();
    spec.fruit.spacing = spec.fruit.spacing.with_value(5.0).unwrap();
    let skeleton = grow(&spec, 1, 0).unwrap();
    let fruit = place(&spec.fruit, &skeleton, 1, 0);
    assert!(!fruit.is_empty() && fruit.len() < 400, "{}", fruit.len());
}

#[test]
fn a_law_without_shares_is_refused_by_its_field() {
    let text = "preset = 'x'\nbase = 'calibrated'\n[fruit.cluster]\nbase = 'measured'\nshares = [{ value = 0.0, range = [0.0, 1.0], unit = '1', source = 'x' }]";
    let error = Spec::from_toml("x.toml", text).unwrap_err().to_string();
    assert!(error.starts_with("x.toml: fruit.cluster") && error.contains("above 0"), "{error}");
    let text = "preset = 'x'\nbase = 'calibrated'\n[fruit.cluster]\nbase = 'bunches'";
    let error = Spec::from_toml("x.toml", text).unwrap_err().to_string();
    assert!(error.contains("no cluster 'bunches'; the clusters are: measured"), "{error}");
}
