//! The detection task's results as text tables. Precision and recall are always shown together.

use orchard_scenario::SceneNames;
use orchard_statistics::Metric;
use orchard_tasks::detect::{
    DensitySummary, DetectPlan, DetectSummary, FoliageFigure, RankedFruit, SitsOn, VariantSummary, variants,
};
use orchard_tasks::protocol::Protocol;
use orchard_tasks::zones::Zone;

use crate::columns::columns;
use crate::headline::number;

/// All tables.
pub fn report(summary: &DetectSummary, plan: &DetectPlan) -> String {
    let rules = &plan.protocol.detect;
    let view = plan.camera.view();
    let mut text = format!(
        "detection: camera {} ({} x {}), detector {}; seeds {:?} x {} trees x {} views; {} trees quarantined\n",
        plan.camera.name(),
        view.width.get(),
        view.height.get(),
        summary.detector,
        summary.seeds,
        plan.trees,
        rules.views.get(),
        summary.quarantined
    );
    text += &format!(
        "recall is over fruit that should be found: at least {:.0} % visible, {} to {} m away, at least {} px\n\n",
        100.0 * rules.found.visible_fraction.si(),
        rules.found.depth.si().0,
        rules.found.depth.si().1,
        rules.found.pixels.get()
    );
    text += &sweep(summary, plan);
    text += &requirements(summary, plan);
    text += &ranking(summary, plan);
    text +=
        "\nrecall of all visible fruit, by visible fraction (fruit in range), and over the views of a tree\n";
    text += &recalls(summary);
    text += "\nfalse positives by the object that they sit on\n";
    text += &false_positives(summary);
    text += "\nprecision / recall by canopy zone\n";
    text += &zones(summary);
    text += &ablation(summary, plan);
    text
}

fn sweep(summary: &DetectSummary, plan: &DetectPlan) -> String {
    let head = [
        "foliage",
        "precision",
        "95 %",
        "paper",
        "recall",
        "95 %",
        "detections",
        "fruit",
        "centre mm",
        "p95",
        "radius mm",
        "bias",
    ];
    let published = plan.protocol.detect.published.get("precision");
    let row = |density: &DensitySummary| {
        let results = &density.results;
        let (precision, recall) = (&results.metrics["precision"], &results.metrics["recall"]);
        let paper = published.into_iter().flatten().find(|at| at.foliage == density.foliage);
        let millimetres = |metres: Option<f64>| number(metres.map(|x| 1e3 * x));
        [
            density.foliage.to_string(),
            number3(precision.mean),
            interval3(precision),
            number(paper.map(|at| at.value)),
            number3(recall.mean),
            interval3(recall),
            precision.n.to_string(),
            recall.n.to_string(),
            millimetres(results.errors["centre_error_median_m"].value),
            millimetres(results.errors["centre_error_p95_m"].value),
            millimetres(results.errors["radius_error_median_m"].value),
            millimetres(results.metrics["radius_bias_m"].mean),
        ]
    };
    table(head, summary.densities.iter().map(row))
}

/// Text of the interval of a mean that has three decimals.
fn interval3(metric: &Metric) -> String {
    ends3(metric.ci95)
}

/// Text of an interval with three decimals.
fn ends3(ci95: [Option<f64>; 2]) -> String {
    match ci95 {
        [Some(low), Some(high)] => format!("{low:.3} .. {high:.3}"),
        _ => "-".to_owned(),
    }
}

/// Average precision, sizes and calibration; then average precision by visible fraction and zone.
fn ranking(summary: &DetectSummary, plan: &DetectPlan) -> String {
    let rules = &plan.protocol.detect;
    let (near, far) = plan.camera.range();
    let tail = if plan.detector.score.on {
        format!("spheres down to a score of {} included", rules.ranking.least_score.si())
    } else {
        "of detections alone, since gates decide: what they refuse is not found".to_owned()
    };
    let mut text = format!(
        "\naverage precision of detections ranked by score, {tail}\nover fruit at least {:.0} % visible with at least {} px, {near} to {far} m away; \
         other visible fruit is neither right nor wrong\n",
        100.0 * rules.found.visible_fraction.si(),
        rules.found.pixels.get(),
    );
    let radii: Vec<String> = rules.ranking.radii.iter().map(|radii| radii.si().to_string()).collect();
    let mut head = vec!["foliage".to_owned()];
    for radii in &radii {
        head.extend([format!("AP {radii} radius"), "95 %".to_owned()]);
    }
    head.extend(["fruit", "diameter mm", "correlation", "Brier", "calibration"].map(str::to_owned));
    let row = |density: &DensitySummary| {
        let ranking = &density.ranking;
        let mut row = vec![density.foliage.to_string()];
        for ap in radii.iter().filter_map(|radii| ranking.ap.get(radii)) {
            row.extend([number3(ap.value), ends3(ap.ci95)]);
        }
        row.push(ranking.ap.values().map(|ap| ap.n).max().unwrap_or(0).to_string());
        row.push(number(density.results.metrics["diameter_error_m"].mean.map(|x| 1e3 * x)));
        row.push(number(density.radius_correlation.value));
        row.extend([number3(ranking.calibration.brier.mean), number3(ranking.calibration.expected_error)]);
        row
    };
    let rows: Vec<Vec<String>> = std::iter::once(head).chain(summary.densities.iter().map(row)).collect();
    text += &columns(&rows, &[0]);
    for radii in &radii {
        text += &format!("\naverage precision within {radii} radius by visible fraction and canopy zone\n");
        text += &parts(summary, radii);
    }
    text
}

/// Average precision within one distance by visible fraction and by zone.
fn parts(summary: &DetectSummary, radii: &str) -> String {
    let Some(first) = summary.densities.first() else { return String::new() };
    let cell = |of: &RankedFruit| number(of.ap.get(radii).copied().flatten());
    let mut head = vec!["foliage".to_owned()];
    head.extend(first.ranking.by_visible_fraction.iter().map(|bin| {
        let [low, high] = bin.visible_fraction.map(|edge| (100.0 * edge).round());
        format!("{low}-{high} %")
    }));
    head.extend(first.ranking.by_zone.keys().map(name));
    let row = |density: &DensitySummary| {
        let mut row = vec![density.foliage.to_string()];
        row.extend(density.ranking.by_visible_fraction.iter().map(|bin| cell(&bin.ranked)));
        row.extend(density.ranking.by_zone.values().map(cell));
        row
    };
    let rows: Vec<Vec<String>> = std::iter::once(head).chain(summary.densities.iter().map(row)).collect();
    columns(&rows, &[0])
}

/// Requirements over the tuning seeds, and whether the results meet them.
fn requirements(summary: &DetectSummary, plan: &DetectPlan) -> String {
    let Protocol { tuning_seeds, full, .. } = &plan.protocol;
    let applies =
        plan.seeds == *tuning_seeds && plan.trees == full.trees.get() && plan.scene == SceneNames::paper();
    if !applies {
        return "requirements over the tuning seeds are not judged: another scenario, other seeds or trees\n"
            .to_owned();
    }
    let mut text = String::new();
    for (name, list) in &plan.protocol.detect.required {
        for FoliageFigure { foliage, value, unit, .. } in list {
            let Some(VariantSummary { metrics, errors, .. }) = summary.at(*foliage).map(|d| &d.results)
            else {
                continue;
            };
            let (sign, measured, met) = match (metrics.get(name), errors.get(name)) {
                (Some(metric), _) => (">=", metric.mean, metric.mean.is_some_and(|x| x >= *value)),
                (None, Some(error)) => ("<=", error.value, error.value.is_some_and(|x| x <= *value)),
                (None, None) => continue,
            };
            let measured = measured.map_or_else(|| "-".to_owned(), |x| format!("{x:.5}"));
            let unit = if unit == "1" { String::new() } else { format!(" {unit}") };
            let verdict = if met { "met" } else { "MISSED" };
            text += &format!(
                "required over the tuning seeds: {name} {sign} {value}{unit} at foliage {foliage}: {measured}, {verdict}\n"
            );
        }
    }
    text
}

fn recalls(summary: &DetectSummary) -> String {
    let mut rows = Vec::new();
    for density in &summary.densities {
        let metric = |name: &str| number(density.results.metrics[name].mean);
        let mut row = vec![("foliage".to_owned(), density.foliage.to_string())];
        row.push(("visible".to_owned(), metric("recall_visible")));
        for bin in &density.recall_by_visible_fraction {
            let [low, high] = bin.visible_fraction.map(|edge| (100.0 * edge).round());
            row.push((format!("{low}-{high} %"), number(bin.recall)));
        }
        for (title, name) in [
            ("some view", "survey_recall"),
            ("of all fruit", "survey_recall_all"),
            ("track precision", "track_precision"),
            ("track recall", "track_recall"),
        ] {
            row.push((title.to_owned(), metric(name)));
        }
        rows.push(row);
    }
    let Some(first) = rows.first() else { return String::new() };
    let head: Vec<String> = first.iter().map(|(title, _)| title.clone()).collect();
    let cells = rows.iter().map(|row| row.iter().map(|(_, cell)| cell.clone()).collect());
    columns(&std::iter::once(head).chain(cells).collect::<Vec<_>>(), &[0])
}

/// Surfaces that false positives can lie on, with the headings of their columns.
const SURFACES: [(SitsOn, &str); 8] = [
    (SitsOn::Wood, "wood"),
    (SitsOn::Leaf, "leaf"),
    (SitsOn::Fruit, "fruit, off"),
    (SitsOn::FruitAgain, "fruit, again"),
    (SitsOn::Ground, "ground"),
    (SitsOn::Scenery, "posts"),
    (SitsOn::Robot, "robot"),
    (SitsOn::Nothing, "nothing"),
];

/// Cells of one row, and of the row of heads.
fn surfaces(results: &VariantSummary) -> [String; 8] {
    SURFACES.map(|(on, _)| results.false_positives.get(&on).copied().unwrap_or(0).to_string())
}

fn false_positives(summary: &DetectSummary) -> String {
    let row = |first: String, images: String, cells: [String; 8]| {
        let mut row = vec![first, images];
        row.extend(cells);
        row
    };
    let mut rows = vec![row("foliage".into(), "images".into(), SURFACES.map(|(_, head)| head.to_owned()))];
    rows.extend(summary.densities.iter().map(|density| {
        let results = &density.results;
        row(density.foliage.to_string(), results.images.to_string(), surfaces(results))
    }));
    columns(&rows, &[0])
}

fn zones(summary: &DetectSummary) -> String {
    let mut head = vec!["zone".to_owned()];
    head.extend(summary.densities.iter().map(|density| format!("foliage {}", density.foliage)));
    let row = |zone: Zone| {
        let mut row = vec![name(&zone)];
        row.extend(summary.densities.iter().map(|density| {
            let cell = density.zones.get(&zone).cloned().unwrap_or_default();
            format!("{} / {}", number(cell.precision), number(cell.recall))
        }));
        row
    };
    let rows: Vec<Vec<String>> = std::iter::once(head).chain(Zone::ALL.map(row)).collect();
    columns(&rows, &[0])
}

fn ablation(summary: &DetectSummary, plan: &DetectPlan) -> String {
    let ablation = &summary.ablation;
    let published = &plan.protocol.detect.ablation.published;
    let images = ablation.variants.values().map(|v| v.images).max().unwrap_or(0);
    let mut text = format!(
        "\ngates switched off: the {images} views of seed {} at foliage {}\n",
        ablation.seed.map_or_else(|| "-".to_owned(), |seed| seed.to_string()),
        ablation.foliage
    );
    let head = [
        "detector",
        "wood",
        "leaf",
        "fruit, off",
        "fruit, again",
        "others",
        "precision",
        "recall",
        "recall, change",
        "paper: wood",
        "precision",
        "recall, change",
    ];
    let recall = |name: &str| ablation.variants.get(name).and_then(|v| v.metrics["recall"].mean);
    let percent = |part: Option<f64>| part.map_or_else(String::new, |x| format!("{:+.0} %", 100.0 * x));
    let mut rows = Vec::new();
    for variant in variants(&plan.detector) {
        let Some(results) = ablation.variants.get(variant.name) else { continue };
        let count = |on: SitsOn| results.false_positives.get(&on).copied().unwrap_or(0);
        let shown = [SitsOn::Wood, SitsOn::Leaf, SitsOn::Fruit, SitsOn::FruitAgain];
        let others = results.false_positives.iter().filter(|(on, _)| !shown.contains(on)).map(|(_, n)| n);
        // Relative change of the recall by the anti-branch gates.
        let without = variant.without_anti_branch.and_then(recall);
        let change = recall(variant.name).zip(without).map(|(with, without)| with / without - 1.0);
        let paper = published.get(variant.name);
        let [wood, leaf, off, again] = shown.map(|on| count(on).to_string());
        rows.push([
            variant.title.to_owned(),
            wood,
            leaf,
            off,
            again,
            others.sum::<u32>().to_string(),
            number3(results.metrics["precision"].mean),
            number3(results.metrics["recall"].mean),
            percent(change),
            paper.map_or_else(String::new, |p| p.wood.to_string()),
            paper.map_or_else(String::new, |p| number(Some(p.precision))),
            percent(paper.map(|p| p.recall_change).filter(|change| *change != 0.0)),
        ]);
    }
    text += &table(head, rows.into_iter());
    text
}

fn table<const N: usize>(head: [&str; N], rows: impl Iterator<Item = [String; N]>) -> String {
    let rows: Vec<[String; N]> = std::iter::once(head.map(str::to_owned)).chain(rows).collect();
    columns(&rows, &[0])
}

/// A number with three decimals, or `-` if there is none.
fn number3(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), |x| format!("{x:.3}"))
}

/// The serialised name of a unit variant, with spaces for underscores.
fn name(value: &impl serde::Serialize) -> String {
    match serde_json::to_value(value) {
        Ok(serde_json::Value::String(name)) => name.replace('_', " "),
        other => unreachable!("a unit variant serialises to its name, not {other:?}"),
    }
}
