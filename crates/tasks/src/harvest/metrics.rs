//! Metrics of the harvest, each a ratio of sums over trees. `docs/benchmark-v1.md` shows this table and states the rules of its events.

use orchard_statistics::{MetricDefinition, MetricInfo, Share};

use crate::harvest::episode::EpisodeRecord;

/// All metrics of the harvest.
pub const METRICS: &[MetricDefinition<EpisodeRecord>] = &[
    MetricDefinition {
        info: MetricInfo {
            name: "harvest_completeness",
            title: "Harvest completeness",
            unit: "1",
            numerator: "reachable fruit deposited over reachable fruit",
            denominator: "1",
            note: "The primary metric; a tree without reachable fruit is left out, a quarantined one counts 0",
        },
        share: completeness,
    },
    MetricDefinition {
        info: MetricInfo {
            name: "place_success_per_contact_attempt",
            title: "Place success",
            unit: "1",
            numerator: "contact attempts placed",
            denominator: "contact attempts",
            note: "Different controllers are compared by this one: the world counts the attempts",
        },
        share: |e| Share::of_counts(e.placed_by_contact().count(), e.contact_attempts.len()),
    },
    MetricDefinition {
        info: MetricInfo {
            name: "place_success_per_attempt",
            title: "Place success, declared",
            unit: "1",
            numerator: "declared attempts placed",
            denominator: "declared attempts",
            note: "Controllers declare their attempts by different rules",
        },
        share: |e| Share::of_counts(e.placed().count(), e.attempts.len()),
    },
    MetricDefinition {
        info: MetricInfo {
            name: "grasp_rate",
            title: "Grasp rate",
            unit: "1",
            numerator: "declared attempts with a gripped fruit",
            denominator: "declared attempts",
            note: "",
        },
        share: |e| {
            Share::of_counts(e.attempts.iter().filter(|a| !a.gripped.is_empty()).count(), e.attempts.len())
        },
    },
    MetricDefinition {
        info: MetricInfo {
            name: "detach_rate",
            title: "Detach rate",
            unit: "1",
            numerator: "declared attempts with a detached fruit",
            denominator: "declared attempts",
            note: "",
        },
        share: |e| {
            Share::of_counts(e.attempts.iter().filter(|a| !a.detached.is_empty()).count(), e.attempts.len())
        },
    },
    MetricDefinition {
        info: MetricInfo {
            name: "throughput_fruit_per_min",
            title: "Throughput",
            unit: "fruit/min",
            numerator: "60 x fruit deposited over the episode's simulated seconds",
            denominator: "1",
            note: "",
        },
        share: throughput,
    },
    MetricDefinition {
        info: MetricInfo {
            name: "mean_cycle_time_s",
            title: "Cycle time",
            unit: "s",
            numerator: "duration of placed declared attempts, from the commitment to the fruit at rest",
            denominator: "declared attempts placed",
            note: "",
        },
        share: cycle_time,
    },
    MetricDefinition {
        info: MetricInfo {
            name: "branches_snapped_per_tree",
            title: "Branches snapped a tree",
            unit: "branches",
            numerator: "ruptures of wood",
            denominator: "1",
            note: "Damage always has a value, 0 included",
        },
        share: |e| Share::of_one(e.branches_snapped.len() as f64),
    },
    MetricDefinition {
        info: MetricInfo {
            name: "fruit_dropped_per_tree",
            title: "Fruit dropped a tree",
            unit: "fruit",
            numerator: "fruit off its stem at the end and neither at rest in the bucket nor between the fingers",
            denominator: "1",
            note: "Damage always has a value, 0 included",
        },
        share: |e| Share::of_one(e.dropped().count() as f64),
    },
    MetricDefinition {
        info: MetricInfo {
            name: "fruit_deposited_per_tree",
            title: "Fruit deposited a tree",
            unit: "fruit",
            numerator: "fruit at rest in the bucket at the end",
            denominator: "1",
            note: "",
        },
        share: |e| Share::of_one(e.deposited().count() as f64),
    },
    MetricDefinition {
        info: MetricInfo {
            name: "fruit_knocked_off_per_tree",
            title: "Fruit knocked off a tree",
            unit: "fruit",
            numerator: "fruit that came off its stem without having been held",
            denominator: "1",
            note: "By contact attempts: declared ones have no part in it",
        },
        share: |e| Share::of_one(e.fruit_knocked_off.len() as f64),
    },
    MetricDefinition {
        info: MetricInfo {
            name: "fruit_stem_pulled_per_tree",
            title: "Fruit torn off a tree",
            unit: "fruit",
            numerator: "fruit that came off at a stem tension above `rules.stem_pull`, 28.3 N",
            denominator: "1",
            note: "A quarantined world has none",
        },
        share: |e| Share::of_one(e.stem_pulled().count() as f64),
    },
    MetricDefinition {
        info: MetricInfo {
            name: "spurs_torn_per_tree",
            title: "Spurs torn off a tree",
            unit: "spurs",
            numerator: "fruit that came off with their spurs, which would have borne next year's fruit",
            denominator: "1",
            note: "Always 0 where fruit hang on tethers (preset `paper`); a quarantined world has none",
        },
        share: |e| Share::of_one(e.spurs_torn().count() as f64),
    },
    MetricDefinition {
        info: MetricInfo {
            name: "fruit_bruised_per_tree",
            title: "Fruit bruised a tree",
            unit: "fruit",
            numerator: "deposited fruit that took an impact above `rules.bruise_energy`",
            denominator: "1",
            note: "A quarantined world has none",
        },
        share: |e| Share::of_one(e.bruised().count() as f64),
    },
    MetricDefinition {
        info: MetricInfo {
            name: "reachable_fruit_per_tree",
            title: "Reachable fruit a tree",
            unit: "fruit",
            numerator: "fruit inside the paper's reach sphere from an admissible stand-off at the start",
            denominator: "1",
            note: "",
        },
        share: |e| Share::of_one(f64::from(e.reachable_count)),
    },
    MetricDefinition {
        info: MetricInfo {
            name: "reachable_fruit_by_ik_per_tree",
            title: "Fruit confirmed reachable a tree",
            unit: "fruit",
            numerator: "reachable fruit that inverse kinematics confirms",
            denominator: "1",
            note: "A tree for which it is not computed is left out",
        },
        share: |e| e.reachable_ik_count.map_or_else(Share::default, |count| Share::of_one(f64::from(count))),
    },
    MetricDefinition {
        info: MetricInfo {
            name: "contact_attempts_per_tree",
            title: "Contact attempts a tree",
            unit: "attempts",
            numerator: "contact attempts",
            denominator: "1",
            note: "",
        },
        share: |e| Share::of_one(e.contact_attempts.len() as f64),
    },
    MetricDefinition {
        info: MetricInfo {
            name: "attempts_per_tree",
            title: "Declared attempts a tree",
            unit: "attempts",
            numerator: "commitments to a target, false detections included",
            denominator: "1",
            note: "",
        },
        share: |e| Share::of_one(e.attempts.len() as f64),
    },
    MetricDefinition {
        info: MetricInfo {
            name: "mean_drop_height_m",
            title: "Drop height",
            unit: "m",
            numerator: "height of the fall from the fingers into the bucket",
            denominator: "deposits with a recorded height",
            note: "",
        },
        share: |e| Share::of_values(e.deposits().filter_map(|d| d.drop_height_m)),
    },
    MetricDefinition {
        info: MetricInfo {
            name: "unbruised_per_placement",
            title: "Unbruised placements",
            unit: "1",
            numerator: "deposits of fruit that took no impact above `rules.bruise_energy` since the start",
            denominator: "deposits with recorded impacts",
            note: "",
        },
        share: |e| {
            Share::of_values(e.deposits().filter_map(|d| d.bruised).map(|bruised| f64::from(!bruised)))
        },
    },
    MetricDefinition {
        info: MetricInfo {
            name: "max_stem_pull_n",
            title: "Largest stem pull",
            unit: "N",
            numerator: "largest stem force of the episode",
            denominator: "1",
            note: "A fruit at rest pulls with its weight; a quarantined world is left out, since its forces are invalid",
        },
        share: stem_pull,
    },
    MetricDefinition {
        info: MetricInfo {
            name: "detection_precision",
            title: "Detection precision",
            unit: "1",
            numerator: "detections matched to a fruit, in all images of the picker",
            denominator: "detections",
            note: "",
        },
        share: |e| {
            let hits = e.detection.true_positives;
            Share::of_counts(hits as usize, (hits + e.detection.false_positives) as usize)
        },
    },
    MetricDefinition {
        info: MetricInfo {
            name: "detection_recall_visible",
            title: "Detection recall",
            unit: "1",
            numerator: "visible fruit matched by a detection, summed over images",
            denominator: "visible fruit, summed over images",
            note: "",
        },
        share: |e| Share::of_counts(e.detection.recalled as usize, e.detection.visible as usize),
    },
];

/// One tree's shares of a metric of the harvest.
pub(crate) fn harvest_metric(name: &str) -> Option<&'static MetricDefinition<EpisodeRecord>> {
    METRICS.iter().find(|definition| definition.info.name == name)
}

/// Reachable fruit deposited over reachable fruit; 0 for a quarantined tree, undefined for other trees without reachable
/// fruit.
pub(crate) fn completeness(e: &EpisodeRecord) -> Share {
    if e.quarantined() {
        Share::of_one(0.0)
    } else if e.reachable_count == 0 {
        Share::default()
    } else {
        Share::of_one(e.deposited().filter(|f| f.reachable).count() as f64 / f64::from(e.reachable_count))
    }
}

/// Fruit deposited a simulated minute; an episode without a frame was quarantined and gives 0.
fn throughput(e: &EpisodeRecord) -> Share {
    Share::of_one(if e.frames == 0 { 0.0 } else { 60.0 * e.deposited().count() as f64 / e.duration_s })
}

/// Largest stem force; undefined in a quarantined world, whose forces are invalid.
fn stem_pull(e: &EpisodeRecord) -> Share {
    e.max_stem_pull_n.filter(|_| !e.quarantined()).map_or_else(Share::default, Share::of_one)
}

/// Duration of placed attempts.
fn cycle_time(e: &EpisodeRecord) -> Share {
    Share { numerator: e.placed().filter_map(|a| a.cycle_time).sum(), denominator: e.placed().count() as f64 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    use orchard_statistics::{Metric, Resamples, Undefined, estimate};
    use orchard_world::Release;

    use crate::fake::{attempt, contact_attempt, record};
    use crate::harvest::episode::{
        ContactOutcome, DepositEvent, DetachEvent, DetectionTally, FruitMoment, FruitState, Outcome,
        SnapEvent,
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
        let mut a = record(&[
            (Deposited, true),
            (Deposited, true),
            (Dropped, true),
            (OnTree, true),
            (Deposited, false),
        ]);
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
        };
        a.fruit_deposited = vec![
            deposit(0, Some(0.06), Some(false)),
            deposit(1, Some(0.12), Some(true)),
            deposit(4, None, None),
        ];
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
            ("max_stem_pull_n", 15.0, 2),
            ("detection_precision", 10.0 / 15.0, 15),
            ("detection_recall_visible", 7.0 / 20.0, 20),
        ];
        assert_eq!(metrics.len(), expected.len());
        for (name, mean, n) in expected {
            let m = &metrics[name];
            assert_eq!((m.mean, m.n), (Some(mean), n), "{name}");
            if ["mean_cycle_time_s", "mean_drop_height_m", "unbruised_per_placement"].contains(&name) {
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
}
