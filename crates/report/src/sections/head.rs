//! The top of the page: warnings, and the facts of the run.

use maud::{Markup, html};
use orchard_bench::compute::Machine;
use orchard_tasks::harvest::summary::{ConditionSummary, Summary};
use orchard_tasks::protocol::Protocol;
use orchard_tasks::seeds::{SeedSetLabel, SeedSetName};

use crate::results::{Results, conditions};
use crate::table::{Cell, table};

/// Returns the warnings that precede the first figure.
pub(crate) fn warnings(results: &Results, protocol: &Protocol) -> Vec<Markup> {
    let mut warnings = Vec::new();
    let quarantined = results.harvest.as_ref().map_or(0, |harvest| harvest.quarantined);
    if quarantined > 0 {
        warnings.push(html! {
            strong { (worlds(quarantined)) " quarantined." }
            " Their state became implausible, so they count as zero harvest; their attempts, ruptures and drops count. The means \
             below are not those of a valid run."
        });
    }
    let unseen = results.detect.as_ref().map_or(0, |detect| detect.quarantined);
    if unseen > 0 {
        warnings.push(html! {
            strong { (worlds(unseen)) " quarantined in the detection task" } " and not in its figures."
        });
    }
    for component in &results.components {
        let trials = component.outcomes.get("quarantined").copied().unwrap_or(0);
        let trees = component.trees.iter().filter(|tree| tree.never_built.is_some()).count();
        if trials > 0 || trees > 0 {
            warnings.push(html! {
                strong { (component.run.task) ": " (trials) " trials quarantined, " (trees) " trees could not be built." }
            });
        }
    }
    let of_harvest = results.harvest.iter().map(|harvest| ("harvest", &harvest.gave_up));
    let of_components = results.components.iter().map(|task| (&*task.run.task, &task.gave_up));
    for (task, reasons) in of_harvest.chain(of_components).filter(|(_, reasons)| !reasons.is_empty()) {
        let reasons = reasons.iter().map(|(reason, n)| format!("{reason} {n}")).collect::<Vec<_>>();
        warnings.push(html! {
            strong { (task) ": the controller gave up." }
            " It held the robot still for the rest of these episodes, which count: " (reasons.join(", ")) "."
        });
    }
    for (label, tasks) in seed_sets(results) {
        warnings.extend(of_seeds(&label, &tasks));
    }
    if let Some(harvest) = &results.harvest {
        warnings.extend(of_time(harvest, protocol));
    }
    if code_versions(results).len() > 1 {
        warnings.push(html! {
            strong { "Results of several code versions." }
            " The tasks of this folder were run by different code versions and may be inconsistent: " (code_versions(results).join(", ")) "."
        });
    }
    warnings
}

fn worlds(n: u32) -> String {
    if n == 1 { "1 world was".to_owned() } else { format!("{n} worlds were") }
}

/// Seed sets with the tasks that were run on them.
fn seed_sets(results: &Results) -> Vec<(SeedSetLabel, Vec<String>)> {
    let harvest = results.harvest.iter().map(|h| (h.seed_set.clone(), "harvest".to_owned()));
    let detect = results.detect.iter().map(|d| (d.seed_set.clone(), "detect".to_owned()));
    let components = results.components.iter().map(|c| (c.seed_set.clone(), c.run.task.clone()));
    let mut sets: Vec<(SeedSetLabel, Vec<String>)> = Vec::new();
    for (label, task) in harvest.chain(detect).chain(components) {
        match sets.iter_mut().find(|(own, _)| *own == label) {
            Some((_, tasks)) => tasks.push(task),
            None => sets.push((label, vec![task])),
        }
    }
    sets
}

fn of_seeds(label: &SeedSetLabel, tasks: &[String]) -> Option<Markup> {
    let tasks = tasks.join(", ");
    Some(match (label.name, label.whole) {
        (SeedSetName::V1 | SeedSetName::FieldV1, true) => return None,
        (SeedSetName::V1 | SeedSetName::FieldV1, false) => html! {
            strong { "Part of the official seeds (" (tasks) ")." } " A score needs all seeds and trees of the set."
        },
        (SeedSetName::Tuning, whole) => html! {
            strong { @if whole { "Tuning seeds" } @else { "Some of the tuning seeds" } " (" (tasks) ")." }
            " They are for tuning: no figure on this page is an official score."
        },
        (SeedSetName::Custom, _) => html! {
            strong { "Custom seeds (" (tasks) ")." } " No figure on this page is an official score."
        },
    })
}

/// An official seed set with another time or fewer repeats is no official result either.
fn of_time(harvest: &Summary, protocol: &Protocol) -> Option<Markup> {
    let official = harvest.seed_set.name.is_official();
    let nominal = &harvest.conditions.get("nominal")?.params;
    let as_asked = nominal.horizon_s == protocol.full.horizon.si()
        && nominal.repeats == protocol.official_set().repeats.get();
    (official && !as_asked).then(|| {
        html! {
            strong { "Not the official time or repeats." }
            " The official nominal episode is " (protocol.full.horizon.si()) " s, " (protocol.official_set().repeats.get()) " times a tree."
        }
    })
}

fn code_versions(results: &Results) -> Vec<String> {
    let mut versions: Vec<String> = results.harvest.iter().map(|h| h.code_version.clone()).collect();
    versions.extend(results.detect.iter().map(|d| d.code_version.clone()));
    versions.extend(results.components.iter().map(|c| c.run.code_version.clone()));
    versions.sort();
    versions.dedup();
    versions
}

/// Returns the title of the page.
pub(crate) fn title(results: &Results) -> String {
    match &results.harvest {
        Some(harvest) => format!("OrchardBench v1: {}", harvest.controller),
        None => "OrchardBench v1".to_owned(),
    }
}

/// One line under the title.
pub(crate) fn subtitle(results: &Results) -> String {
    let Some(harvest) = &results.harvest else { return "A report without a harvest".to_owned() };
    let episodes: usize = harvest.conditions.values().map(|c| c.episodes.len()).sum();
    let conditions = harvest.conditions.len();
    let s = |n: usize| if n == 1 { "" } else { "s" };
    format!(
        "{} profile, {} seed{}, {conditions} condition{}, {episodes} episode{}",
        harvest.profile,
        harvest.seeds.len(),
        s(harvest.seeds.len()),
        s(conditions),
        s(episodes)
    )
}

/// Table of the run: controller, seeds, scenario, profile, versions and machine.
pub(crate) fn facts(results: &Results) -> Markup {
    let mut facts: Vec<(&str, Markup)> = Vec::new();
    if let Some(summary) = &results.harvest {
        facts.push(("Controller", html! { (summary.controller) }));
        facts.push(("Seeds", html! { (seed_set(&summary.seed_set)) ": " (list(&summary.seeds)) }));
        let parts = summary.scenario.names.scene.list().map(|(part, name)| format!("{part} {name}"));
        facts.push(("Scenario", html! { (parts.join(", ")) " " code.hash { (summary.scenario.hash) } }));
        facts.push(("Profile", html! { (summary.profile) }));
        facts.push(("Config", html! { (summary.config_version) ", " code.hash { (summary.config_hash) } }));
        facts.push(("Schema", html! { (summary.schema_version) }));
    } else {
        let others = results.detect.iter().map(|d| ("detect", &d.seed_set, &d.seeds));
        let others = others.chain(results.components.iter().map(|c| (&*c.run.task, &c.seed_set, &c.seeds)));
        for (task, set, seeds) in others {
            facts.push(("Seeds", html! { (task) ", " (seed_set(set)) ": " (list(seeds)) }));
        }
    }
    facts.push(("Code", html! { code.hash { (code_versions(results).join(", ")) } }));
    let machine = results.compute.as_ref().and_then(|compute| compute.tasks.values().next());
    let machine = machine.map(|cost| (&cost.machine, cost.threads));
    let machine =
        machine.or_else(|| results.scaling.first().map(|scaling| (&scaling.machine, scaling.threads)));
    if let Some((machine, threads)) = machine {
        facts.push(("Machine", html! { (machine_line(machine)) "; " (threads) " threads" }));
    }
    html! {
        dl.facts { @for (name, value) in &facts { div { dt { (name) } dd { (value) } } } }
        @if let Some(summary) = &results.harvest { (condition_table(summary)) }
    }
}

fn machine_line(machine: &Machine) -> String {
    let cpu = machine.cpu.as_deref().unwrap_or("unnamed processor");
    format!("{cpu}, {} logical processors, {} {}", machine.logical_cpus, machine.os, machine.arch)
}

fn seed_set(label: &SeedSetLabel) -> String {
    let official = if label.name.is_official() { " (official)" } else { "" };
    let name = label.name;
    let part = if label.whole || label.name == SeedSetName::Custom { "" } else { ", incomplete set" };
    format!("{name}{official}{part}")
}

fn list(seeds: &[u64]) -> String {
    seeds.iter().map(u64::to_string).collect::<Vec<_>>().join(", ")
}

/// Table of the conditions, with the outcomes of their episodes.
fn condition_table(summary: &Summary) -> Markup {
    let row = |(name, c): (&str, &ConditionSummary)| {
        let p = &c.params;
        let outcomes: Vec<String> =
            c.outcomes.iter().map(|(name, n)| format!("{n} {}", name.replace('_', " "))).collect();
        vec![
            Cell::words(name),
            Cell::number(p.dials.fruit_count.to_string()),
            Cell::number(p.dials.foliage_density.to_string()),
            Cell::number(p.dials.terrain_amplitude_m.to_string()),
            Cell::number(p.trees.to_string()),
            Cell::number(p.repeats.to_string()),
            Cell::number(p.horizon_s.to_string()),
            Cell::words(outcomes.join(", ")),
        ]
    };
    let rows: Vec<_> = conditions(summary).into_iter().map(row).collect();
    let heads = [
        "condition",
        "fruit",
        "foliage",
        "terrain [m]",
        "trees per seed",
        "repeats",
        "time limit [s]",
        "outcomes of episodes",
    ];
    html! {
        details open[rows.len() <= 4] {
            summary { "Conditions" }
            (table("Conditions of the harvest", &heads, &rows))
        }
    }
}
