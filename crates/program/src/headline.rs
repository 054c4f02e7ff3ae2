//! The harvest's results as text tables: metrics beside the paper's, requirements, failures, times.

use std::collections::BTreeSet;

use orchard_report::{ConditionRequirements, JudgedRequirement, judge_requirements};
use orchard_statistics::Component;
use orchard_statistics::Metric;
use orchard_tasks::harvest::matrix::{EXHAUSTION, MatrixSweep, NOMINAL, SweepPoint};
use orchard_tasks::harvest::metrics::{METRICS, QUANTILES, infos};
use orchard_tasks::harvest::plan::Plan;
use orchard_tasks::harvest::summary::{ConditionSummary, Summary};

use crate::columns::columns;

/// States of an attempt in the order of a harvest cycle; others follow in the order of their names.
const CYCLE: [&str; 5] = ["align", "reach", "grasp", "pull", "deposit"];

/// All tables.
pub fn report(summary: &Summary, plan: &Plan) -> String {
    let mut text = format!("controller {}\n", summary.controller);
    text += &table(summary, plan);
    text += &singles(summary, plan);
    text += &sweeps(summary, plan);
    text += &variance(summary, plan);
    text += &requirements(summary, plan);
    text += "\nfailed declared attempts by reason\n";
    text += &failures(summary, plan);
    text += "\ncontact attempts, which the world counts, by outcome\n";
    text += &contact_outcomes(summary, plan);
    text += "\nseconds in each state of an attempt: mean over the attempts that entered it (over the placed ones)\n";
    text += &states(summary, plan);
    text
}

/// The conditions of a run in its order, with their results.
fn conditions<'a>(summary: &'a Summary, plan: &'a Plan) -> Vec<(&'a str, &'a ConditionSummary)> {
    let of = |name: &'a String| summary.conditions.get(name).map(|results| (name.as_str(), results));
    plan.conditions.iter().filter_map(|condition| of(&condition.name)).collect()
}

/// Conditions with all their metrics; the others are listed in the tables of their sweeps, or in that of single conditions.
fn principal<'a>(summary: &'a Summary, plan: &'a Plan) -> Vec<(&'a str, &'a ConditionSummary)> {
    let all = conditions(summary, plan);
    let main: Vec<_> = all.iter().copied().filter(|(name, _)| [NOMINAL, EXHAUSTION].contains(name)).collect();
    if main.is_empty() { all } else { main }
}

/// Conditions outside sweeps, one a line, with the tested metrics and the tensions at detachment.
fn singles(summary: &Summary, plan: &Plan) -> String {
    let of_sweep = |name: &str| {
        plan.sweeps
            .iter()
            .any(|sweep| sweep.reference != name && sweep.points.iter().any(|p| p.condition == name))
    };
    let shown: Vec<_> = conditions(summary, plan).into_iter().filter(|(name, _)| !of_sweep(name)).collect();
    if shown.iter().all(|(name, _)| [NOMINAL, EXHAUSTION].contains(name)) {
        return String::new();
    }
    let names: Vec<&str> = plan
        .protocol
        .tested
        .iter()
        .map(String::as_str)
        .chain(QUANTILES.iter().filter(|q| q.info.unit == "N").map(|q| q.info.name))
        .collect();
    let mut rows = vec![row("condition", names.iter().map(|name| (*name).to_owned()))];
    rows.extend(shown.iter().map(|(condition, of)| {
        row(condition, names.iter().map(|name| number(of.metrics.get(*name).and_then(|found| found.mean))))
    }));
    format!("\nconditions outside sweeps: means\n{}\n", columns(&rows, &[0]))
}

/// Every sweep's conditions side by side.
fn sweeps(summary: &Summary, plan: &Plan) -> String {
    let mut text = String::new();
    for MatrixSweep { name, reference, .. } in &plan.sweeps {
        let Some(sweep) = summary.sweeps.get(name) else { continue };
        text += &format!(
            "\nsweep {} [{}]: means, and in brackets p against {}\n",
            sweep.dial, sweep.unit, reference
        );
        let values = sweep.points.iter().map(|point| point.value.to_string());
        let mut rows = vec![row("metric", values)];
        for name in &plan.protocol.tested {
            let cell = |point: &SweepPoint| {
                let of = summary.conditions.get(&point.condition).and_then(|of| of.metrics.get(name));
                let mean = number(of.and_then(|metric| metric.mean));
                let beside =
                    sweep.comparisons.iter().find(|c| c.metric == *name && c.condition == point.condition);
                match beside.and_then(|comparison| comparison.holm.permutation) {
                    Some(p) => format!("{mean} ({p:.3})"),
                    None => mean,
                }
            };
            rows.push(row(name, sweep.points.iter().map(cell)));
        }
        text += &columns(&rows, &[0]);
        text.push('\n');
    }
    if !text.is_empty() {
        text += "p: paired permutation test over trees, Holm-adjusted within its sweep\n";
    }
    text
}

/// The metrics in the order of their definition: for each condition mean, interval and n, then the paper's nominal figure.
fn table(summary: &Summary, plan: &Plan) -> String {
    let conditions = principal(summary, plan);
    let mut head = vec!["metric".to_owned()];
    for (name, _) in &conditions {
        head.extend([(*name).to_owned(), "95 % interval".to_owned(), "n".to_owned()]);
    }
    head.extend(["paper".to_owned(), "unit".to_owned()]);
    let unit_column = head.len() - 1;
    let mut rows = vec![head];
    for info in infos() {
        let mut row = vec![info.name.to_owned()];
        for (_, results) in &conditions {
            row.extend(match results.metrics.get(info.name) {
                Some(metric) => [number(metric.mean), interval(metric), metric.n.to_string()],
                None => ["-", "-", "-"].map(str::to_owned),
            });
        }
        let paper = plan.protocol.published.get(info.name);
        row.extend([number(paper.map(|p| p.value)), info.unit.to_owned()]);
        rows.push(row);
    }
    columns(&rows, &[0, unit_column])
}

/// Table of the standard deviations between seeds, trees and repeats, where trees are repeated.
fn variance(summary: &Summary, plan: &Plan) -> String {
    let mut text = String::new();
    for (name, results) in conditions(summary, plan) {
        let Some(variance) = &results.variance else { continue };
        text += &format!(
            "\n{name}: standard deviations between seeds, between the trees of a seed, between the repeats of a tree\n"
        );
        let mut rows = vec![["metric", "seeds", "trees", "repeats", "episodes", "unit"].map(str::to_owned)];
        for definition in METRICS {
            let Some(of) = variance.get(definition.info.name) else { continue };
            let deviation = |component: &Component| {
                component
                    .variance
                    .map_or_else(|| "-".to_owned(), |variance| format!("{:.3}", variance.sqrt()))
            };
            let [seeds, trees, repeats] =
                [&of.between_seeds, &of.between_trees, &of.within_tree].map(deviation);
            let unit = definition.info.unit.to_owned();
            rows.push([definition.info.name.to_owned(), seeds, trees, repeats, of.n.to_string(), unit]);
        }
        text += &columns(&rows, &[0, 5]);
        text.push('\n');
    }
    text
}

/// Requirements on the controller over the tuning seeds, each with the measured mean and `met` or `MISSED`.
fn requirements(summary: &Summary, plan: &Plan) -> String {
    let mut text = String::new();
    for ConditionRequirements { condition, judged } in judge_requirements(summary, &plan.protocol) {
        let Some(judged) = judged else {
            text += &format!(
                "requirements over the tuning seeds are not judged ({condition}): another scenario, other seeds, trees, repeats or time\n"
            );
            continue;
        };
        for figure in judged {
            let JudgedRequirement { metric, requirement, mean } = figure;
            let unit = if requirement.unit == "1" { String::new() } else { format!(" {}", requirement.unit) };
            text += &format!(
                "required over the tuning seeds, {condition}: {metric} {}{unit}: {}, {}\n",
                requirement.bound(),
                mean.map_or_else(|| "-".to_owned(), |mean| format!("{mean:.3}")),
                if figure.is_met() { "met" } else { "MISSED" }
            );
        }
    }
    text
}

fn failures(summary: &Summary, plan: &Plan) -> String {
    let conditions = conditions(summary, plan);
    let reasons: BTreeSet<&String> = conditions.iter().flat_map(|(_, c)| c.failures.keys()).collect();
    let count = |reason: &String| -> Vec<String> {
        conditions.iter().map(|(_, c)| c.failures.get(reason).unwrap_or(&0).to_string()).collect()
    };
    let attempts = |(_, c): &(&str, &ConditionSummary)| {
        let attempts: u32 = c.episodes.iter().map(|episode| episode.attempts).sum();
        attempts.to_string()
    };
    let mut rows = vec![row("reason", conditions.iter().map(|(name, _)| (*name).to_owned()))];
    rows.extend(reasons.into_iter().map(|reason| row(reason, count(reason).into_iter())));
    rows.push(row("of all attempts", conditions.iter().map(attempts)));
    columns(&rows, &[0])
}

fn contact_outcomes(summary: &Summary, plan: &Plan) -> String {
    let conditions = conditions(summary, plan);
    let outcomes: BTreeSet<&String> =
        conditions.iter().flat_map(|(_, c)| c.contact_outcomes.keys()).collect();
    let count = |c: &ConditionSummary, name: &String| c.contact_outcomes.get(name).unwrap_or(&0).to_string();
    let mut rows = vec![row("outcome", conditions.iter().map(|(name, _)| (*name).to_owned()))];
    rows.extend(outcomes.into_iter().map(|name| row(name, conditions.iter().map(|(_, c)| count(c, name)))));
    let all = |c: &ConditionSummary| c.contact_outcomes.values().sum::<u32>().to_string();
    rows.push(row("all contact attempts", conditions.iter().map(|(_, c)| all(c))));
    columns(&rows, &[0])
}

fn states(summary: &Summary, plan: &Plan) -> String {
    let conditions = principal(summary, plan);
    let names: BTreeSet<&str> =
        conditions.iter().flat_map(|(_, c)| c.states.keys().map(String::as_str)).collect();
    let known = CYCLE.iter().copied().filter(|name| names.contains(name));
    let others = names.iter().copied().filter(|name| !CYCLE.contains(name));
    let cell = |state: &str, c: &ConditionSummary| {
        c.states
            .get(state)
            .map_or_else(|| "-".to_owned(), |s| format!("{} ({})", number(s.mean_s), number(s.mean_placed_s)))
    };
    let mut rows = vec![row("state", conditions.iter().map(|(name, _)| (*name).to_owned()))];
    for state in known.chain(others) {
        rows.push(row(state, conditions.iter().map(|(_, c)| cell(state, c))));
    }
    rows.push(row("between attempts", conditions.iter().map(|(_, c)| number(c.between_attempts_s))));
    columns(&rows, &[0])
}

fn row(first: &str, cells: impl Iterator<Item = String>) -> Vec<String> {
    std::iter::once(first.to_owned()).chain(cells).collect()
}

/// A number with two decimals, or `-` if there is none.
pub fn number(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), |x| format!("{x:.2}"))
}

/// Rows of the named metrics, in the given order, with units and three decimals: loads are often small.
pub fn fine_table<'a>(
    order: impl Iterator<Item = (&'a str, &'a str)>,
    metrics: &std::collections::BTreeMap<String, Metric>,
) -> String {
    let mut rows = vec![["metric", "mean", "95 % interval", "n", "unit"].map(str::to_owned)];
    for (name, unit) in order {
        let Some(metric) = metrics.get(name) else { continue };
        let cells = [
            metric.mean.map(|x| format!("{x:.3}")),
            match metric.ci95 {
                [Some(low), Some(high)] => Some(format!("{low:.3} .. {high:.3}")),
                _ => None,
            },
        ];
        let [mean, ci95] = cells.map(|cell| cell.unwrap_or_else(|| "-".to_owned()));
        rows.push([name.to_owned(), mean, ci95, metric.n.to_string(), unit.to_owned()]);
    }
    columns(&rows, &[0, 4])
}

/// Text of an interval.
pub fn interval(metric: &Metric) -> String {
    match metric.ci95 {
        [Some(low), Some(high)] => format!("{low:.2} .. {high:.2}"),
        _ => "-".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use orchard_scenario::Scenario;
    use orchard_tasks::harvest::matrix::EXHAUSTION;
    use orchard_tasks::harvest::{Extent, Harvest};
    use orchard_tasks::protocol::Protocol;

    fn plan(conditions: &[&str], seeds: Vec<u64>, trees: u32, repeats: u32) -> Plan {
        let conditions = conditions.iter().map(|name| (*name).to_owned()).collect();
        let extent = Extent { profile: "full".into(), conditions, seeds, trees, repeats, horizon_s: 75.0 };
        Harvest::new(Scenario::of(&[]).unwrap()).unwrap().plan_of(extent).unwrap()
    }

    #[test]
    fn sweeps_stand_in_tables_of_their_own() {
        let plan = plan(&["fruit"], vec![5], 1, 1);
        let text = report(&Summary::of_run(&plan, &[]), &plan);
        let head = text.lines().find(|line| line.starts_with("metric")).unwrap();
        assert!(head.contains("nominal") && !head.contains("fruit-20"), "{head}");
        let sweep = text.split("sweep fruit [fruit]").nth(1).unwrap();
        let head: Vec<&str> = sweep.lines().nth(1).unwrap().split_whitespace().collect();
        assert_eq!(head, ["metric", "20", "40", "60"]);
        assert!(sweep.contains("fruit_dropped_per_tree"));
    }

    /// The report of a run without episodes, on some seeds.
    fn text_of(seeds: Vec<u64>, trees: u32) -> String {
        let plan = plan(&[NOMINAL, EXHAUSTION], seeds, trees, 1);
        report(&Summary::of_run(&plan, &[]), &plan)
    }

    #[test]
    fn requirements_are_judged_on_the_tuning_seeds_only() {
        let seeds = Protocol::paper().tuning_seeds;
        let text = text_of(seeds.clone(), 6);
        // Nothing was measured: nothing is met.
        assert!(
            text.contains("required over the tuning seeds, nominal: harvest_completeness >= 0.12: -, MISSED"),
            "{text}"
        );
        assert!(text.contains("fruit_dropped_per_tree <= 6 fruit: -, MISSED"), "{text}");
        for text in [text_of(vec![5], 6), text_of(seeds, 5)] {
            assert!(text.contains("not judged (nominal)") && !text.contains("MISSED"), "{text}");
        }
    }

    /// Two trees of one seed, two episodes each: 1, 3 and 5, 7 have the variance 2 within and (16 - 2) / 2 between.
    #[test]
    fn repeats_tell_their_spread() {
        use orchard_statistics::{Design, variance_components};
        let plan = plan(&[NOMINAL], vec![5], 2, 2);
        let mut summary = Summary::of_run(&plan, &[]);
        assert!(!report(&summary, &plan).contains("standard deviations"));
        let design = Design::of([(5, 0), (5, 0), (5, 1), (5, 1)]);
        let components = variance_components(&design, &[1.0, 3.0, 5.0, 7.0].map(Some));
        if let Some(nominal) = summary.conditions.get_mut("nominal") {
            nominal.variance = Some([("attempts_per_tree".to_owned(), components)].into());
        }
        let text = report(&summary, &plan);
        let after = text.split("standard deviations").nth(1).unwrap();
        let line = after.lines().find(|line| line.starts_with("attempts_per_tree")).unwrap();
        assert_eq!(
            line.split_whitespace().collect::<Vec<_>>(),
            ["attempts_per_tree", "-", "2.646", "1.414", "4", "attempts"]
        );
    }

    #[test]
    fn conditions_stand_side_by_side() {
        let text = text_of(vec![5], 1);
        let head = text.lines().find(|line| line.starts_with("metric")).unwrap();
        assert!(head.contains("nominal") && head.contains("exhaustion") && head.contains("paper"), "{head}");
        assert!(text.contains("of all attempts") && text.contains("between attempts"));
        assert!(text.contains("all contact attempts"));
    }
}
