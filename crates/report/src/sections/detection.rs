//! Section on the detection task.

use std::collections::BTreeMap;

use maud::{Markup, html};
use orchard_tasks::detect::{DensitySummary, DetectSummary, SitsOn, VariantSummary};
use orchard_tasks::protocol::Protocol;

use super::{Section, beside, missing};
use crate::figures::Figures;
use crate::results::Results;
use crate::table::{Cell, table};
use crate::words::{grouped, interval, number, plain, why};

/// The section.
pub(crate) fn section(results: &Results, figures: &Figures, protocol: &Protocol) -> Section {
    let body = match &results.detect {
        None => {
            missing("No detection task in this folder.", "cargo xtask bench-v1 --profile full --tasks detect")
        }
        Some(summary) => html! {
            (beside(&html! { p {
                "Single depth images of resting trees, camera " (summary.camera.name()) ", detector " (summary.detector)
                ". A detection is correct if its centre is within one fruit radius of a fruit's centre, matched one to one. Recall is over fruit \
                 that should be found: at least " (number(Some(100.0 * protocol.detect.found.visible_fraction.si()), 0)) " % visible, in range and large enough."
            } }, &figures.detect))
            (densities(summary, protocol))
            (ablation(summary))
        },
    };
    Section { id: "detection", title: "Detection task", body }
}

fn densities(summary: &DetectSummary, protocol: &Protocol) -> Markup {
    let published = protocol.detect.published.get("precision");
    let row = |density: &DensitySummary| {
        let results = &density.results;
        let metric = |name: &str| {
            let found = results.metrics.get(name);
            [
                Cell::main(number(found.and_then(|m| m.mean), 3)).because(found.and_then(why)),
                Cell::number(found.map_or_else(|| "-".to_owned(), |m| interval(m.ci95, 3)))
                    .because(found.and_then(why)),
            ]
        };
        let error = |name: &str| {
            let found = results.errors.get(name).and_then(|e| e.value);
            Cell::number(number(found.map(|metres| 1e3 * metres), 2))
        };
        let paper = published.into_iter().flatten().find(|at| at.foliage == density.foliage);
        let [precision, precision_ci] = metric("precision");
        let [recall, recall_ci] = metric("recall");
        vec![
            Cell::number(density.foliage.to_string()),
            precision,
            precision_ci,
            Cell::number(number(paper.map(|at| at.value), 2)),
            recall,
            recall_ci,
            Cell::number(grouped(results.detections.into())),
            error("centre_error_median_m"),
            error("centre_error_p95_m"),
        ]
    };
    let rows: Vec<_> = summary.densities.iter().map(row).collect();
    let heads = [
        "foliage",
        "precision",
        "95 % interval",
        "paper",
        "recall",
        "95 % interval",
        "detections",
        "centre error [mm]",
        "p95 [mm]",
    ];
    table("Precision and recall by foliage density", &heads, &rows)
}

fn ablation(summary: &DetectSummary) -> Markup {
    let on = |counts: &BTreeMap<SitsOn, u32>, wanted: SitsOn| counts.get(&wanted).copied().unwrap_or(0);
    let row = |(name, v): (&String, &VariantSummary)| {
        let false_positives: u32 = v.false_positives.values().sum();
        let metric = |name: &str| number(v.metrics.get(name).and_then(|m| m.mean), 3);
        vec![
            Cell::words(plain(name)),
            Cell::main(metric("precision")),
            Cell::main(metric("recall")),
            Cell::number(false_positives.to_string()),
            Cell::number(on(&v.false_positives, SitsOn::Wood).to_string()),
            Cell::number(on(&v.false_positives, SitsOn::Leaf).to_string()),
        ]
    };
    let rows: Vec<_> = summary.ablation.variants.iter().map(row).collect();
    let heads = ["variant", "precision", "recall", "false positives", "on wood", "on leaves"];
    html! { @if rows.iter().any(|row| row[1].text != "-") {
        details {
            summary { "Gate ablation: the detector with single gates switched off, foliage " (summary.ablation.foliage) }
            (table("Gate ablation", &heads, &rows))
        }
    } }
}
