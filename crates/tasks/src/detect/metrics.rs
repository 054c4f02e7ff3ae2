//! Metrics of the detection task, each a ratio of sums over trees. `docs/benchmark-v1.md` shows this table.

use orchard_statistics::{MetricDefinition, MetricInfo, Share};

use crate::detect::record::SitsOn;
use crate::detect::tally::{Found, Tally};

/// All metrics of one foliage density or variant.
pub const METRICS: &[MetricDefinition<Tally>] = &[
    MetricDefinition {
        info: MetricInfo {
            name: "precision",
            title: "Precision",
            unit: "1",
            numerator: "true positives",
            denominator: "detections",
            note: "",
        },
        share: |t| per_n(t.true_positives, t.detections),
    },
    MetricDefinition {
        info: MetricInfo {
            name: "recall",
            title: "Recall",
            unit: "1",
            numerator: "fruit that should be found and is matched, summed over images",
            denominator: "fruit that should be found",
            note: "",
        },
        share: |t| found(t.expected),
    },
    MetricDefinition {
        info: MetricInfo {
            name: "recall_visible",
            title: "Recall, all visible",
            unit: "1",
            numerator: "fruit that shows a pixel and is matched",
            denominator: "fruit that shows a pixel, at any range",
            note: "",
        },
        share: |t| found(t.visible),
    },
    MetricDefinition {
        info: MetricInfo {
            name: "false_positives_per_view",
            title: "False positives a view",
            unit: "detections",
            numerator: "detections that are not matched",
            denominator: "images",
            note: "",
        },
        share: |t| per_n(t.detections - t.true_positives, t.images),
    },
    MetricDefinition {
        info: MetricInfo {
            name: "wood_false_positives_per_view",
            title: "False positives on wood a view",
            unit: "detections",
            numerator: "detections that are not matched and sit on wood",
            denominator: "images",
            note: "",
        },
        share: |t| per_n(t.false_positives_on(SitsOn::Wood), t.images),
    },
    MetricDefinition {
        info: MetricInfo {
            name: "radius_bias_m",
            title: "Radius bias",
            unit: "m",
            numerator: "detected radius less the fruit's, summed over true positives",
            denominator: "true positives",
            note: "",
        },
        share: |t| Share {
            numerator: t.radius_errors.iter().sum(),
            denominator: t.radius_errors.len() as f64,
        },
    },
    MetricDefinition {
        info: MetricInfo {
            name: "diameter_error_m",
            title: "Diameter error, absolute",
            unit: "m",
            numerator: "distance between the detected diameter and the fruit's, summed over true positives",
            denominator: "true positives",
            note: "",
        },
        share: |t| Share::of_values(t.radius_errors.iter().map(|error| 2.0 * error.abs())),
    },
    MetricDefinition {
        info: MetricInfo {
            name: "survey_recall",
            title: "Recall over views",
            unit: "1",
            numerator: "fruit that should be found in some view of the tree and is matched in some view",
            denominator: "fruit that should be found in some view",
            note: "",
        },
        share: |t| found(t.survey),
    },
    MetricDefinition {
        info: MetricInfo {
            name: "survey_recall_all",
            title: "Recall over views, all fruit",
            unit: "1",
            numerator: "fruit matched in some view",
            denominator: "fruit of the tree",
            note: "",
        },
        share: |t| found(t.survey_all),
    },
    MetricDefinition {
        info: MetricInfo {
            name: "track_precision",
            title: "Precision of tracks",
            unit: "1",
            numerator: "confirmed tracks matched to a fruit",
            denominator: "confirmed tracks",
            note: "",
        },
        share: |t| found(t.tracks),
    },
    MetricDefinition {
        info: MetricInfo {
            name: "track_recall",
            title: "Recall of tracks",
            unit: "1",
            numerator: "fruit that should be found in some view and has a confirmed track",
            denominator: "fruit that should be found in some view",
            note: "",
        },
        share: |t| found(t.tracked),
    },
];

fn found(found: Found) -> Share {
    per_n(found.found, found.of)
}

fn per_n(numerator: u32, denominator: u32) -> Share {
    Share::of_counts(numerator as usize, denominator as usize)
}
