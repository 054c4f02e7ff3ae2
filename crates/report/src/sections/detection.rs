//! Section on the detection task.

use std::collections::BTreeMap;

use maud::{Markup, html};
use orchard_tasks::detect::{DensitySummary, DetectSummary, RankedBin, RankedFruit, SitsOn, VariantSummary};
use orchard_tasks::protocol::Protocol;
use orchard_tasks::zones::Zone;

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
            (ranking(summary))
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

/// Average precision, size errors and calibration, then average precision by visible fraction and by zone.
fn ranking(summary: &DetectSummary) -> Markup {
    let keys: Vec<&String> =
        summary.densities.first().into_iter().flat_map(|d| d.ranking.ap.keys()).collect();
    let average = |radii: &String| format!("average precision, {radii} radius");
    let mut heads = vec!["foliage".to_owned()];
    for radii in &keys {
        heads.extend([average(radii), "95 % interval".to_owned()]);
    }
    heads.extend(
        ["fruit", "diameter error [mm]", "radius correlation", "Brier score", "calibration error"]
            .map(str::to_owned),
    );
    let row = |density: &DensitySummary| {
        let (ranking, metrics) = (&density.ranking, &density.results.metrics);
        let mut row = vec![Cell::number(density.foliage.to_string())];
        for radii in &keys {
            let ap = ranking.ap.get(*radii);
            row.push(Cell::main(number(ap.and_then(|ap| ap.value), 3)));
            row.push(Cell::number(ap.map_or_else(|| "-".to_owned(), |ap| interval(ap.ci95, 3))));
        }
        let millimetres = metrics.get("diameter_error_m").and_then(|m| m.mean).map(|x| 1e3 * x);
        row.push(Cell::number(grouped(ranking.ap.values().map(|ap| ap.n).max().unwrap_or(0))));
        row.extend(
            [
                number(millimetres, 1),
                number(density.radius_correlation.value, 2),
                number(ranking.calibration.brier.mean, 3),
                number(ranking.calibration.expected_error, 3),
            ]
            .map(Cell::number),
        );
        row
    };
    let rows: Vec<_> = summary.densities.iter().map(row).collect();
    let heads: Vec<&str> = heads.iter().map(String::as_str).collect();
    html! {
        p { "Average precision ranks all spheres by their score, those below the detector's threshold included. It is over fruit in the camera's range. Fruit that shows less is neither right nor wrong." }
        (table("Average precision, sizes and calibration by foliage density", &heads, &rows))
        @for radii in keys {
            details {
                summary { "Average precision within " (radii) " radius by visible fraction and by canopy zone" }
                (parts(summary, radii))
            }
        }
    }
}

/// A zone as people write it.
fn zone_name(zone: &Zone) -> String {
    let name = serde_json::to_value(zone).ok();
    plain(name.as_ref().and_then(serde_json::Value::as_str).unwrap_or_default())
}

/// Average precision within one distance by visible fraction and by zone.
fn parts(summary: &DetectSummary, radii: &str) -> Markup {
    let cell = |of: &RankedFruit| Cell::main(number(of.ap.get(radii).copied().flatten(), 3));
    let Some(first) = summary.densities.first() else { return html! {} };
    let percent = |bin: &RankedBin| {
        let [low, high] = bin.visible_fraction.map(|edge| number(Some(100.0 * edge), 0));
        format!("{low} to {high} % visible")
    };
    let mut heads = vec!["foliage".to_owned()];
    heads.extend(first.ranking.by_visible_fraction.iter().map(percent));
    heads.extend(first.ranking.by_zone.keys().map(zone_name));
    let row = |density: &DensitySummary| {
        let mut row = vec![Cell::number(density.foliage.to_string())];
        row.extend(density.ranking.by_visible_fraction.iter().map(|bin| cell(&bin.ranked)));
        row.extend(density.ranking.by_zone.values().map(cell));
        row
    };
    let rows: Vec<_> = summary.densities.iter().map(row).collect();
    let heads: Vec<&str> = heads.iter().map(String::as_str).collect();
    table("Average precision by visible fraction and by zone", &heads, &rows)
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
