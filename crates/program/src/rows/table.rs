//! Rows as a Markdown table that is also readable on a terminal, followed by notes and limits.

use super::Row;

/// The rows as text.
pub fn markdown(rows: &[Row]) -> String {
    let head = [
        "row",
        "figure",
        "unit",
        "rounds",
        "95 % interval",
        "peer",
        "peer's figure",
        "ratio",
        "target",
        "evidence",
        "",
    ];
    let mut cells = vec![head.map(str::to_owned)];
    cells.extend(rows.iter().map(|row| {
        [
            row.name.clone(),
            number(row.value),
            row.unit.clone(),
            range(row.spread),
            range(row.ci95),
            row.peer.clone().unwrap_or_default(),
            match row.peer_spread.or(row.peer_ci95) {
                Some(ends) => format!("{} ({})", number(row.peer_value), range(Some(ends))),
                None => number(row.peer_value),
            },
            row.ratio.map_or_else(String::new, |ratio| format!("{ratio:.2} x")),
            match (row.target_interval, row.target_ratio) {
                (Some(interval), _) => format!("{} ({})", number(row.target), range(Some(interval))),
                (None, Some(ratio)) => format!(">= {ratio} x"),
                (None, None) => number(row.target),
            },
            row.evidence.as_ref().map_or("", |evidence| evidence.role.name()).to_owned(),
            row.pass.map_or("", |pass| if pass { "pass" } else { "FAIL" }).to_owned(),
        ]
    }));
    let used: Vec<usize> =
        (0..head.len()).filter(|&k| cells[1..].iter().any(|row| !row[k].is_empty())).collect();
    let width = |k: usize| cells.iter().map(|row| row[k].chars().count()).max().unwrap_or(0);
    let mut text = String::new();
    for (index, row) in cells.iter().enumerate() {
        let padded: Vec<String> = used.iter().map(|&k| format!("{:<1$}", row[k], width(k))).collect();
        text += &format!("| {} |\n", padded.join(" | "));
        if index == 0 {
            let rule: Vec<String> = used.iter().map(|&k| "-".repeat(width(k))).collect();
            text += &format!("|-{}-|\n", rule.join("-|-"));
        }
    }
    for row in rows {
        if let Some(note) = &row.note {
            text += &format!("\n{}: {note}.", row.name);
        }
        if let Some(why) = &row.why_missed {
            text += &format!("\n{} is missed: {why}.", row.name);
        }
        if let Some(limit) = &row.limit {
            text += &format!(
                "\n{}: {} operations per substep, {:.1} Gflop/s per core; {:.0} % of the peak of these instructions ({:.1}), {:.0} % of \
                 the peak of the widest vectors ({:.1}). {}.",
                row.name,
                number(Some(limit.operations)),
                1e-9 * limit.achieved,
                1e2 * limit.share,
                1e-9 * limit.peak,
                1e2 * limit.widest_share,
                1e-9 * limit.widest_peak,
                limit.why
            );
        }
    }
    if !text.ends_with('\n') {
        text.push('\n');
    }
    text
}

fn range(spread: Option<[f64; 2]>) -> String {
    spread.map_or_else(String::new, |[low, high]| format!("{} to {}", number(Some(low)), number(Some(high))))
}

/// Four significant digits, thousands apart.
pub fn number(value: Option<f64>) -> String {
    let Some(value) = value else { return String::new() };
    if value.abs() < 1000.0 {
        let mut decimals = 3;
        for bound in [1.0, 10.0, 100.0] {
            decimals -= usize::from(value.abs() >= bound && decimals > 0);
        }
        return format!("{value:.decimals$}");
    }
    let digits = format!("{:.0}", value.abs());
    let groups: Vec<&str> =
        digits.as_bytes().rchunks(3).rev().filter_map(|group| std::str::from_utf8(group).ok()).collect();
    format!("{}{}", if value < 0.0 { "-" } else { "" }, groups.join(","))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rows::{Evidence, Role};

    #[test]
    fn numbers_read_well() {
        for (value, text) in [
            (0.1234, "0.123"),
            (1.234, "1.23"),
            (12.34, "12.3"),
            (123.4, "123"),
            (-1234.5, "-1,234"),
            (1e6, "1,000,000"),
        ] {
            assert_eq!(number(Some(value)), text);
        }
        assert_eq!(number(None), "");
    }

    #[test]
    fn columns_without_entries_are_left_out() {
        let rows = [Row::measured("a", 2.0, "m")];
        assert_eq!(
            markdown(&rows),
            "| row | figure | unit |\n|-----|--------|------|\n| a   | 2.00   | m    |\n"
        );
        let rows = [Row::measured("a", 2.0, "m").beside("b", 4.0).at_least_times(0.6)];
        assert!(markdown(&rows).contains("| 0.50 x | >= 0.6 x | FAIL |"), "{}", markdown(&rows));
        let evidence = Evidence { source: String::new(), tolerance: String::new(), role: Role::Input };
        let fitted = Row { evidence: Some(evidence), ..Row::measured("a", 2.0, "m").within(2.0, [1.0, 3.0]) };
        assert!(markdown(&[fitted]).contains("| 2.00 (1.00 to 3.00) | input    | pass |"));
    }
}
