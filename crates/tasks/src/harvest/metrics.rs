//! Metrics of the harvest: ratios of sums over trees, and quantiles over their fruit. `docs/benchmark-v1.md` shows this table and states the rules of its events.

use orchard_statistics::{MetricDefinition, MetricInfo, QuantileDefinition, Share};

use crate::harvest::episode::{DepositEvent, EpisodeRecord};

/// Metrics of the harvest that are ratios.
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
            name: "bruise_free_share",
            title: "Free of bruises",
            unit: "1",
            numerator: "deposits of fruit that took no impact above `rules.bruise_energy` and, where the preset has a law of bruises, no bruise by impact or squeeze above `rules.bruise_volume`",
            denominator: "deposits with recorded impacts",
            note: "Without that law, as in preset `paper`, squeezes leave no bruise and it is `unbruised_per_placement`",
        },
        share: |e| {
            let free = |d: &DepositEvent| Some(!d.bruised? && d.over_bruise_volume != Some(true));
            Share::of_values(e.deposits().filter_map(free).map(f64::from))
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

/// Metrics of the harvest that are quantiles.
pub const QUANTILES: &[QuantileDefinition<EpisodeRecord>] = &[
    QuantileDefinition {
        info: MetricInfo {
            name: "detach_tension_p95_n",
            title: "Tension at detachment, 95th percentile",
            unit: "N",
            numerator: "95th percentile of the stem tensions at which held fruit came off",
            denominator: "all trees together",
            note: "Hand picking: 28.3 N (`rules.stem_pull`); a quarantined world has none",
        },
        level: 0.95,
        values: EpisodeRecord::detach_tensions,
    },
    QuantileDefinition {
        info: MetricInfo {
            name: "detach_tension_max_n",
            title: "Tension at detachment, largest",
            unit: "N",
            numerator: "largest stem tension at which a held fruit came off",
            denominator: "all trees together",
            note: "The interval of a maximum ends at it; a quarantined world has none",
        },
        level: 1.0,
        values: EpisodeRecord::detach_tensions,
    },
    QuantileDefinition {
        info: MetricInfo {
            name: "detach_of_strength_p05",
            title: "Tension of strength, 5th percentile",
            unit: "1",
            numerator: "5th percentile of the stem tensions at which held fruit came off, each as a share of its stem's strength in a straight pull",
            denominator: "all trees together",
            note: "1 is a straight pull, less a bend or a twist; a quarantined world has none",
        },
        level: 0.05,
        values: EpisodeRecord::detach_shares,
    },
    QuantileDefinition {
        info: MetricInfo {
            name: "detach_of_strength_p95",
            title: "Tension of strength, 95th percentile",
            unit: "1",
            numerator: "95th percentile of the stem tensions at which held fruit came off, each as a share of its stem's strength in a straight pull",
            denominator: "all trees together",
            note: "Above 1 where the pull rises faster than the stem gives way; a quarantined world has none",
        },
        level: 0.95,
        values: EpisodeRecord::detach_shares,
    },
];

/// All metrics of the harvest in words.
pub fn infos() -> impl Iterator<Item = MetricInfo> {
    METRICS.iter().map(|metric| metric.info).chain(QUANTILES.iter().map(|metric| metric.info))
}

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
#[path = "metrics_tests.rs"]
mod tests;
