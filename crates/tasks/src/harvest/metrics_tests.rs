use super::*;
use std::collections::BTreeMap;

use orchard_statistics::{Metric, Resamples, Undefined, estimate, estimate_quantiles};
use orchard_world::Release;

use crate::fake::{attempt, contact_attempt, record};
use crate::harvest::episode::{
    ContactOutcome, DepositEvent, DetachEvent, DetectionTally, FruitMoment, FruitState, Outcome, SnapEvent,
};
use crate::protocol::Protocol;

fn metrics(episodes: &[EpisodeRecord]) -> BTreeMap<String, Metric> {
    let groups = vec![(0..episodes.len()).collect::<Vec<_>>()];
    estimate(METRICS, episodes, &Resamples::draw(&groups, &Protocol::paper().bootstrap))
}

/// Two trees, worked out by hand.
fn two_trees() -> Vec<EpisodeRecord> {
    use FruitState::{Deposited, Dropped, Held, Loose, OnTree};
    // Tree A: 4 reachable (2 deposited, 1 dropped), 1 unreachable (deposited); 30 s; 3 attempts, 2 placed.
    let mut a =
        record(&[(Deposited, true), (Deposited, true), (Dropped, true), (OnTree, true), (Deposited, false)]);
    (a.frames, a.duration_s) = (1800, 30.0);
    a.attempts = vec![attempt(Some(6.0), 1, 1), attempt(Some(9.0), 2, 1), attempt(None, 1, 0)];
    // All three fruit in the bucket by contact attempts, and the one on the ground; tree B touched one fruit.
    a.contact_attempts = [(0, true), (1, true), (4, true), (2, false)]
        .map(|(fruit, placed)| {
            contact_attempt(fruit, if placed { ContactOutcome::Placed } else { ContactOutcome::Dropped })
        })
        .into();
    a.branches_snapped = vec![SnapEvent { segment: 9, frame: 4, time: 0.1, at_union: false }];
    a.detection =
        DetectionTally { images: 2, true_positives: 9, false_positives: 1, visible: 12, recalled: 6 };
    a.max_stem_pull_n = Some(20.0);
    a.fruit_knocked_off = vec![FruitMoment { fruit: 2, frame: 4, time: 0.1 }];
    let detached = |fruit, stem_pulled| DetachEvent {
        fruit,
        frame: 8,
        time: 0.2,
        tension_n: Some(if stem_pulled { 30.0 } else { 20.0 }),
        stem_pulled,
        release: Some(if stem_pulled { Release::Spur } else { Release::Bend }),
        strength_n: None,
    };
    a.fruit_detached = vec![detached(0, false), detached(1, true)];
    a.reachable_ik_count = Some(3);
    // Of three deposits one is without figures.
    let deposit = |fruit, drop_height_m, bruised| DepositEvent {
        fruit,
        frame: 9,
        time: 0.2,
        drop_height_m,
        impact_energy_j: None,
        bruise_energy_j: None,
        bruised,
        bruise_volume_m3: None,
        // The hand squeezed it.
        over_bruise_volume: (fruit == 0).then_some(true),
    };
    a.fruit_deposited =
        vec![deposit(0, Some(0.06), Some(false)), deposit(1, Some(0.12), Some(true)), deposit(4, None, None)];
    // Tree B: 2 reachable (none deposited), one loose and one in the hand at the end; 60 s; 5 attempts.
    let mut b = record(&[(Loose, true), (Held, true)]);
    (b.frames, b.duration_s) = (3600, 60.0);
    b.contact_attempts = vec![contact_attempt(1, ContactOutcome::RunEnded)];
    b.attempts = (0..5).map(|i| attempt(None, u32::from(i == 0), 0)).collect();
    b.detection =
        DetectionTally { images: 1, true_positives: 1, false_positives: 4, visible: 8, recalled: 1 };
    b.max_stem_pull_n = Some(10.0);
    b.reachable_ik_count = Some(2);
    vec![a, b]
}

#[test]
fn closed_forms() {
    let metrics = metrics(&two_trees());
    let expected = [
        ("harvest_completeness", (2.0 / 4.0 + 0.0) / 2.0, 2),
        ("place_success_per_contact_attempt", 3.0 / 5.0, 5),
        ("place_success_per_attempt", 2.0 / 8.0, 8),
        ("grasp_rate", 4.0 / 8.0, 8),
        ("detach_rate", 2.0 / 8.0, 8),
        ("throughput_fruit_per_min", (6.0 + 0.0) / 2.0, 2),
        ("mean_cycle_time_s", 7.5, 2),
        ("branches_snapped_per_tree", 0.5, 2),
        ("fruit_dropped_per_tree", 1.0, 2),
        ("fruit_deposited_per_tree", 1.5, 2),
        ("fruit_knocked_off_per_tree", 0.5, 2),
        ("fruit_stem_pulled_per_tree", 0.5, 2),
        ("spurs_torn_per_tree", 0.5, 2),
        ("fruit_bruised_per_tree", 0.5, 2),
        ("reachable_fruit_per_tree", 3.0, 2),
        ("reachable_fruit_by_ik_per_tree", 2.5, 2),
        ("contact_attempts_per_tree", 2.5, 2),
        ("attempts_per_tree", 4.0, 2),
        ("mean_drop_height_m", 0.09, 2),
        ("unbruised_per_placement", 0.5, 2),
        ("bruise_free_share", 0.0, 2),
        ("max_stem_pull_n", 15.0, 2),
        ("detection_precision", 10.0 / 15.0, 15),
        ("detection_recall_visible", 7.0 / 20.0, 20),
    ];
    assert_eq!(metrics.len(), expected.len());
    for (name, mean, n) in expected {
        let m = &metrics[name];
        assert_eq!((m.mean, m.n), (Some(mean), n), "{name}");
        if ["mean_cycle_time_s", "mean_drop_height_m", "unbruised_per_placement", "bruise_free_share"]
            .contains(&name)
        {
            // Only tree A placed anything.
            assert_eq!((m.ci95, m.undefined), ([None, None], Some(Undefined::OneTree)));
            continue;
        }
        let [Some(low), Some(high)] = m.ci95 else { panic!("{name} has no interval") };
        assert!(low <= mean && mean <= high, "{name}: {low} {mean} {high}");
    }
    // Resamples of two trees give A A, A B or B B: the interval spans the two trees' own values.
    assert_eq!(metrics["max_stem_pull_n"].ci95, [Some(10.0), Some(20.0)]);
    assert_eq!(metrics["detection_precision"].ci95, [Some(0.2), Some(0.9)]);
}

#[test]
fn tensions_at_detachment_are_pooled_without_fruit_that_were_knocked_off() {
    let mut trees = two_trees();
    let detached = |fruit, tension| DetachEvent {
        fruit,
        frame: 8,
        time: 0.2,
        tension_n: Some(tension),
        stem_pulled: false,
        release: None,
        strength_n: Some(40.0),
    };
    // Fruit 2 of the first tree was knocked off.
    trees[0].fruit_detached = vec![detached(0, 20.0), detached(1, 10.0), detached(2, 99.0)];
    trees[1].fruit_detached = vec![detached(0, 30.0)];
    let quantiles = |trees: &[EpisodeRecord]| {
        let found = estimate_quantiles(
            QUANTILES,
            trees,
            &Resamples::draw(&[vec![0, 1]], &Protocol::paper().bootstrap),
        );
        let of_strength =
            [&found["detach_of_strength_p05"], &found["detach_of_strength_p95"]].map(|m| m.mean);
        let tensions = [&found["detach_tension_p95_n"], &found["detach_tension_max_n"]];
        (tensions.map(|m| (m.mean, m.ci95, m.n)), of_strength)
    };
    // Of 10, 20, 30 the 95th percentile is at rank 1.9. Resamples are A A, A B or B B.
    let (tensions, of_strength) = quantiles(&trees);
    assert_eq!(
        tensions,
        [(Some(29.0), [Some(20.0), Some(30.0)], 3), (Some(30.0), [Some(20.0), Some(30.0)], 3)]
    );
    // Of stems that bear 40 N each: ranks 0.1 and 1.9.
    assert_eq!(of_strength, [Some(11.0 / 40.0), Some(29.0 / 40.0)]);
    trees[1].outcome = Outcome::Quarantined { reason: "not finite".into() };
    assert_eq!(quantiles(&trees).0[1], (Some(20.0), [Some(20.0), Some(20.0)], 2));
    trees[0].fruit_detached.clear();
    assert_eq!(quantiles(&trees).0[0], (None, [None, None], 0));
}

/// A controller that declares no attempt has no declared place success, and one by contact.
#[test]
fn a_controller_that_declares_no_attempt_is_scored() {
    let mut episodes = two_trees();
    episodes.iter_mut().for_each(|episode| episode.attempts.clear());
    let metrics = metrics(&episodes);
    assert_eq!(metrics["place_success_per_attempt"].mean, None);
    let by_contact = &metrics["place_success_per_contact_attempt"];
    assert_eq!((by_contact.mean, by_contact.n), (Some(0.6), 5));
}

#[test]
fn nothing_to_measure_is_null() {
    let metrics = metrics(&[record(&[(FruitState::OnTree, false)])]);
    for name in
        ["harvest_completeness", "place_success_per_attempt", "mean_cycle_time_s", "detection_precision"]
    {
        let undefined = Some(Undefined::NothingToMeasure);
        assert_eq!(metrics[name], Metric { mean: None, ci95: [None, None], n: 0, undefined }, "{name}");
    }
    assert_eq!(metrics["fruit_dropped_per_tree"].mean, Some(0.0));
    let json = serde_json::to_string(&metrics["grasp_rate"]).unwrap();
    assert_eq!(json, r#"{"mean":null,"ci95":[null,null],"n":0,"undefined":"nothing_to_measure"}"#);
}

#[test]
fn a_quarantined_world_counts_as_zero_harvest() {
    let mut episodes = two_trees();
    episodes[0].outcome = Outcome::Quarantined { reason: "not finite".into() };
    let metrics = metrics(&episodes);
    for name in ["harvest_completeness", "throughput_fruit_per_min", "fruit_deposited_per_tree"] {
        assert_eq!((metrics[name].mean, metrics[name].n), (Some(0.0), 2), "{name}");
    }
    // Its attempts still count, none of them placed; its damage counts.
    assert_eq!(
        (metrics["place_success_per_attempt"].mean, metrics["place_success_per_attempt"].n),
        (Some(0.0), 8)
    );
    let by_contact = &metrics["place_success_per_contact_attempt"];
    assert_eq!((by_contact.mean, by_contact.n), (Some(0.0), 5));
    assert_eq!(metrics["branches_snapped_per_tree"].mean, Some(0.5));
    // The forces of a quarantined world are invalid.
    assert_eq!((metrics["max_stem_pull_n"].mean, metrics["max_stem_pull_n"].n), (Some(10.0), 1));
    // Even if it broke before the census.
    let mut unborn = record(&[]);
    unborn.outcome = Outcome::Quarantined { reason: "no equilibrium".into() };
    assert_eq!(completeness(&unborn), Share { numerator: 0.0, denominator: 1.0 });
}
