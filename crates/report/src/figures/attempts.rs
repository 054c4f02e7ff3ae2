//! Figures of attempts: outcomes with failure reasons, and time by state.

use std::collections::BTreeMap;

use orchard_tasks::harvest::summary::{ConditionSummary, StateSummary};
use plotters::style::RGBColor;

use crate::bars::{Bar, Key, bars};
use crate::figure::{Figure, FigureError, colour};
use crate::words::plain;

/// States of an attempt in the order of a harvest cycle; others follow in the order of their names.
const CYCLE: [&str; 5] = ["align", "reach", "grasp", "pull", "deposit"];
/// Colour of the time between attempts.
const BETWEEN: RGBColor = RGBColor(0xB4, 0xBC, 0xC4);

/// All attempts of a condition.
pub(crate) fn attempts_of(results: &ConditionSummary) -> u32 {
    results.episodes.iter().map(|episode| episode.attempts).sum()
}

/// Reasons with their counts, the most frequent first.
pub(crate) fn ranked(failures: &BTreeMap<String, u32>) -> Vec<(&str, u32)> {
    let mut ranked: Vec<(&str, u32)> = failures.iter().map(|(reason, n)| (reason.as_str(), *n)).collect();
    ranked.sort_by(|a, b| b.1.cmp(&a.1).then(a.0.cmp(b.0)));
    ranked
}

/// Draws the outcomes of attempts: placed, or the failure reason.
pub(crate) fn endings(condition: &str, results: &ConditionSummary) -> Result<Figure, FigureError> {
    let attempts = attempts_of(results);
    let failed: u32 = results.failures.values().sum();
    let placed = ("placed", attempts.saturating_sub(failed), colour::GREEN);
    let failures = ranked(&results.failures).into_iter().map(|(reason, n)| (reason, n, colour::VERMILION));
    let all: Vec<(&str, u32, RGBColor)> = std::iter::once(placed).chain(failures).collect();
    let share = |n: u32| 100.0 * f64::from(n) / f64::from(attempts.max(1));
    let list: Vec<Bar> = all
        .iter()
        .map(|(name, n, colour)| Bar {
            name: plain(name),
            parts: vec![(f64::from(*n), *colour)],
            ci95: None,
            label: format!("{n} ({:.0} %)", share(*n)),
        })
        .collect();
    let texts: Vec<String> = list.iter().map(|bar| format!("{} {}", bar.name, bar.label)).collect();
    let description = format!("{attempts} attempts under {condition}: {}.", texts.join("; "));
    bars("failures", &format!("Outcomes of {attempts} attempts"), &description, &list, &[])
}

/// Names of the states of a condition in their order.
pub(crate) fn states_of(states: &BTreeMap<String, StateSummary>) -> Vec<&str> {
    let known = CYCLE.into_iter().filter(|name| states.contains_key(*name));
    let others = states.keys().map(String::as_str).filter(|name| !CYCLE.contains(name));
    known.chain(others).collect()
}

/// Seconds of an average attempt in a state: over all attempts, or over the placed ones.
pub(crate) fn seconds_in(state: &StateSummary, attempts: u32, placed_only: bool) -> f64 {
    let (n, mean) =
        if placed_only { (state.placed, state.mean_placed_s) } else { (state.attempts, state.mean_s) };
    mean.map_or(0.0, |mean| mean * f64::from(n) / f64::from(attempts.max(1)))
}

/// Draws the time of an attempt by controller state.
pub(crate) fn times(condition: &str, results: &ConditionSummary) -> Result<Figure, FigureError> {
    let names = states_of(&results.states);
    let attempts = attempts_of(results);
    let placed = attempts.saturating_sub(results.failures.values().sum());
    let colour_of = |i: usize| colour::SERIES[i % colour::SERIES.len()];
    let bar = |name: &str, n: u32, placed_only: bool| {
        let mut parts: Vec<(f64, RGBColor)> = names
            .iter()
            .enumerate()
            .map(|(i, state)| (seconds_in(&results.states[*state], n, placed_only), colour_of(i)))
            .collect();
        if !placed_only {
            parts.extend(results.between_attempts_s.map(|gap| (gap, BETWEEN)));
        }
        let total: f64 = parts.iter().map(|(size, _)| size).sum();
        Bar { name: name.to_owned(), parts, ci95: None, label: format!("{total:.1} s") }
    };
    let mut list = vec![bar("all attempts", attempts, false)];
    if placed > 0 {
        list.push(bar("placed", placed, true));
    }
    let mut keys: Vec<Key> = names.iter().enumerate().map(|(i, name)| (plain(name), colour_of(i))).collect();
    keys.extend(results.between_attempts_s.map(|_| ("until the next attempt".to_owned(), BETWEEN)));
    let texts: Vec<String> = list
        .iter()
        .map(|bar| {
            let parts: Vec<String> =
                keys.iter().zip(&bar.parts).map(|((name, _), (s, _))| format!("{name} {s:.1} s")).collect();
            format!("{}: {}", bar.name, parts.join(", "))
        })
        .collect();
    let description = format!("Mean time of an attempt by state, under {condition}. {}.", texts.join(". "));
    bars("states", "Time of an attempt by state", &description, &list, &keys)
}
