//! The board as a Markdown table that is also readable on a terminal.

use orchard_leaderboard::{Board, Budget, Class, Entry, Ranked};
use orchard_tasks::seeds::SeedSetName;

use super::ranking;

/// Columns of the whole table.
const COLUMNS: usize = 17;
/// Hexadecimal digits of a hash that are shown.
const DIGITS: usize = 12;

/// Columns shown on a terminal.
const SHORT: usize = 11;

/// The ranked board for a terminal, under each entry's own budget or one for all.
pub fn short(board: &Board, budget: Option<&Budget>) -> String {
    text(board, budget, SHORT)
}

/// The ranked board with all fields, each entry under its own budget.
pub fn whole(board: &Board) -> String {
    text(board, None, COLUMNS)
}

fn text(board: &Board, budget: Option<&Budget>, columns: usize) -> String {
    let set = match board.seed_set {
        name if name.is_official() => format!("the official seeds `{name}`"),
        SeedSetName::Tuning => "the tuning seeds (practice, not an official score)".to_owned(),
        _ => "custom seeds".to_owned(),
    };
    let mut text = format!("Protocol {}, on {set}. ", board.config_version);
    text += &match budget {
        None => "Each entry is ranked under its own budget".to_owned(),
        Some(budget) => format!("All entries are ranked under one budget per tree, {budget}"),
    };
    text += ": entries within budget first, by completeness, then by damage. Place success is over contact attempts, which the world counts. `*`: on the Pareto front of completeness and damage.\n\n";
    if board.entries.is_empty() {
        return text + "No entry.\n";
    }
    let head = [
        "place",
        "name",
        "controller",
        "completeness",
        "95 %",
        "snapped",
        "dropped",
        "fruit/min",
        "place success",
        "budget per tree",
        "",
        "checked",
        "quarantined",
        "gave up",
        "declared place success",
        "code",
        "records",
    ];
    let ranked = ranking(&board.entries, budget);
    for class in Class::ALL {
        let own: Vec<&Ranked<'_>> = ranked.iter().filter(|r| r.entry.checked.class == class).collect();
        if own.is_empty() {
            continue;
        }
        let mut rows = vec![head.map(str::to_owned)];
        rows.extend(own.into_iter().map(|ranked| row(ranked, budget)));
        text += &format!("**{}**: {}.\n\n{}\n", class.name(), meaning(class), table(&rows, columns));
    }
    text.trim_end().to_owned() + "\n"
}

/// Returns in short the proof that a class gives.
fn meaning(class: Class) -> &'static str {
    match class {
        Class::ReRun => "the controller was run again and gave the same bytes",
        Class::Replayed => {
            "the submitted commands gave the same bytes; that the controller found them blind is not proven"
        }
        Class::Claimed => "only the trees were grown again",
    }
}

fn row(ranked: &Ranked<'_>, budget: Option<&Budget>) -> [String; COLUMNS] {
    let Ranked { place, entry, on_front } = ranked;
    let Entry { completeness_ci95: [low, high], .. } = entry;
    let optional =
        |x: Option<f64>, digits: usize| x.map_or_else(|| "-".to_owned(), |x| format!("{x:.digits$}"));
    [
        place.map_or_else(|| "-".to_owned(), |place| place.to_string()),
        format!("{}{}", entry.name, if *on_front { " *" } else { "" }),
        entry.controller.clone(),
        format!("{:.3}", entry.completeness),
        format!("{} to {}", optional(*low, 3), optional(*high, 3)),
        format!("{:.2}", entry.snapped_per_tree),
        format!("{:.2}", entry.dropped_per_tree),
        optional(entry.throughput_fruit_per_min, 2),
        optional(entry.place_success_per_contact_attempt, 2),
        budget.unwrap_or(&entry.budget).to_string(),
        if place.is_some() { "" } else { "OVER BUDGET" }.to_owned(),
        format!("{} of {}", entry.checked.episodes, entry.episodes),
        entry.quarantined.to_string(),
        entry.gave_up.to_string(),
        optional(entry.place_success_per_attempt, 2),
        entry.code_version.clone(),
        entry.records_sha256.chars().take(DIGITS).collect(),
    ]
}

fn table(rows: &[[String; COLUMNS]], columns: usize) -> String {
    let used: Vec<usize> = (0..columns).filter(|&k| rows[1..].iter().any(|row| !row[k].is_empty())).collect();
    let width = |k: usize| rows.iter().map(|row| row[k].chars().count()).max().unwrap_or(0);
    let mut text = String::new();
    for (index, row) in rows.iter().enumerate() {
        let cells: Vec<String> = used.iter().map(|&k| format!("{:<1$}", row[k], width(k))).collect();
        text += &format!("| {} |\n", cells.join(" | "));
        if index == 0 {
            let rule: Vec<String> = used.iter().map(|&k| "-".repeat(width(k))).collect();
            text += &format!("|-{}-|\n", rule.join("-|-"));
        }
    }
    text
}
