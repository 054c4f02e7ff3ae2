//! The page of the validation report: what is validated, what is grounded, what is missed, what is unknown.

use super::demanded;
use crate::rows::{Role, Row, number};

/// A part of the page: its title, what it means, and which rows it has.
struct Part {
    title: &'static str,
    meaning: &'static str,
    has: fn(&Row) -> bool,
}

const PARTS: [Part; 4] = [
    Part {
        title: "Validated",
        meaning: "Figures that follow from others and meet their measurements.",
        has: |row| is(row, Role::Prediction) && row.pass == Some(true),
    },
    Part {
        title: "Grounded",
        meaning: "Figures that a config holds or was fitted to. That they come out shows that the parts fit together; it is no evidence.",
        has: |row| is(row, Role::Input) && row.pass == Some(true),
    },
    Part {
        title: "Missed",
        meaning: "Figures outside their intervals, predictions and inputs.",
        has: |row| row.pass == Some(false),
    },
    Part {
        title: "Not testable",
        meaning: "Measurements without a counterpart in the simulator.",
        has: |row| row.pass.is_none() && row.evidence.is_some(),
    },
];

fn is(row: &Row, role: Role) -> bool {
    row.evidence.as_ref().is_some_and(|evidence| evidence.role == role)
}

/// The page as Markdown.
pub fn markdown(rows: &[Row]) -> String {
    let judged: Vec<&Row> = rows.iter().filter(|row| row.evidence.is_some()).collect();
    let share = |role| {
        let all = judged.iter().filter(|row| is(row, role));
        let passed = all.clone().filter(|row| row.pass == Some(true)).count();
        format!("{passed} of {}", all.count())
    };
    let mut text = format!(
        "# Validation\n\nThis page holds the simulator against measurements of trees, wood and picks and against closed forms. \
         `orchard validate all --json FILE --page docs/validation.md` writes it.\n\n\
         {} Of the predictions {} lie within their intervals, of the inputs {}. Sources are keys of \
         [references.bib](references.bib); [conventions.md](conventions.md#sources-of-constants) counts whose choice the rest of the configuration is.\n",
        demanded::summary(rows),
        share(Role::Prediction),
        share(Role::Input)
    );
    for part in PARTS {
        let rows: Vec<&&Row> = judged.iter().filter(|row| (part.has)(row)).collect();
        text += &format!("\n## {} ({})\n\n{}\n", part.title, rows.len(), part.meaning);
        if !rows.is_empty() {
            text += "\n| row | simulated | measured | interval | unit | source | the interval is | remarks |\n|---|---|---|---|---|---|---|---|\n";
        }
        for row in rows {
            text += &line(row);
        }
    }
    text
}

fn line(row: &Row) -> String {
    let (source, tolerance) =
        row.evidence.as_ref().map_or(("", ""), |evidence| (&evidence.source, &evidence.tolerance));
    let interval = row.target_interval.map(|ends| ends.map(|end| number(Some(end))).join(" to "));
    let remarks: Vec<&str> = [&row.note, &row.why_missed].into_iter().flatten().map(String::as_str).collect();
    let cells = [
        &format!("`{}`{}", row.name, if row.demanded == Some(true) { " *" } else { "" }),
        &number(row.value),
        &number(row.target),
        &interval.unwrap_or_default(),
        &row.unit,
        source,
        tolerance,
        &remarks.join("; "),
    ];
    // A bar would end the cell.
    format!("| {} |\n", cells.map(|cell| cell.replace('|', "\\|")).join(" | "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rows::Evidence;

    #[test]
    fn every_judged_row_stands_in_one_part() {
        let row = |name: &str, value: f64, role| Row {
            evidence: Some(Evidence { source: "oak".into(), tolerance: "10 %".into(), role }),
            ..Row::measured(name, value, "m").within(1.0, [0.9, 1.1])
        };
        let untestable = Row { pass: None, ..row("d", f64::NAN, Role::Prediction) };
        let rows = [
            row("a", 1.0, Role::Prediction),
            row("b", 1.0, Role::Input),
            row("c", 2.0, Role::Prediction),
            untestable,
            Row::measured("e", 1.0, "m"),
        ];
        let page = markdown(&rows);
        for (title, name) in [
            ("Validated (1)", "`a`"),
            ("Grounded (1)", "`b`"),
            ("Missed (1)", "`c`"),
            ("Not testable (1)", "`d`"),
        ] {
            let part = page.split("\n## ").find(|part| part.starts_with(title)).unwrap();
            assert!(part.contains(name), "{part}");
        }
        assert!(page.contains("Of the predictions 1 of 3") && !page.contains("`e`"), "{page}");
    }
}
