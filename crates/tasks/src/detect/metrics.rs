//! The detection task's metrics, each a ratio of sums over trees. `docs/benchmark-v1.md` states the formulas.

use orchard_statistics::MetricDefinition;
use orchard_statistics::Share;

use crate::detect::record::SitsOn;
use crate::detect::tally::{Found, Tally};

/// All metrics of one foliage density or variant.
pub const METRICS: &[MetricDefinition<Tally>] = &[
    MetricDefinition { name: "precision", unit: "1", share: |t| per_n(t.true_positives, t.detections) },
    MetricDefinition { name: "recall", unit: "1", share: |t| found(t.expected) },
    MetricDefinition { name: "recall_visible", unit: "1", share: |t| found(t.visible) },
    MetricDefinition {
        name: "false_positives_per_view",
        unit: "detections",
        share: |t| per_n(t.detections - t.true_positives, t.images),
    },
    MetricDefinition {
        name: "wood_false_positives_per_view",
        unit: "detections",
        share: |t| per_n(t.false_positives_on(SitsOn::Wood), t.images),
    },
    MetricDefinition {
        name: "radius_bias_m",
        unit: "m",
        share: |t| Share {
            numerator: t.radius_errors.iter().sum(),
            denominator: t.radius_errors.len() as f64,
        },
    },
    MetricDefinition { name: "survey_recall", unit: "1", share: |t| found(t.survey) },
    MetricDefinition { name: "survey_recall_all", unit: "1", share: |t| found(t.survey_all) },
    MetricDefinition { name: "track_precision", unit: "1", share: |t| found(t.tracks) },
    MetricDefinition { name: "track_recall", unit: "1", share: |t| found(t.tracked) },
];

fn found(found: Found) -> Share {
    per_n(found.found, found.of)
}

fn per_n(numerator: u32, denominator: u32) -> Share {
    Share::of_counts(numerator as usize, denominator as usize)
}
