//! Rows that a validation must have, each counted once: `configs/measured/demanded.toml`.

use std::collections::BTreeMap;

use orchard_quantity::from_toml;
use serde::{Deserialize, Serialize};

use crate::rows::Row;

/// Demands on a validation, and the rows that meet them.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Demands {
    /// Rows by what they show.
    rows: BTreeMap<String, Vec<String>>,
}

fn read() -> Demands {
    match from_toml("measured/demanded.toml", include_str!("../../../configs/measured/demanded.toml")) {
        Ok(demands) => demands,
        Err(e) => unreachable!("embedded file: {e}"),
    }
}

/// Marks every row that has a measurement behind it as demanded or not.
pub fn mark(rows: &mut [Row]) {
    let demands = read().rows;
    for row in rows.iter_mut().filter(|row| row.evidence.is_some()) {
        row.demanded = Some(demands.values().flatten().any(|name| *name == row.name));
    }
}

/// Numbers of demanded rows and of others that pass; rows that cannot be tested count as not passed.
pub fn summary(rows: &[Row]) -> String {
    let share = |demanded: bool| {
        let all = rows.iter().filter(|row| row.demanded == Some(demanded));
        let passed = all.clone().filter(|row| row.pass == Some(true)).count();
        let n = all.count();
        let percent =
            if n == 0 { String::new() } else { format!(" ({:.0} %)", 100.0 * passed as f64 / n as f64) };
        format!("{passed} of {n}{percent}")
    };
    format!(
        "Of the rows that a validation must have (marked *) {} pass, of the others {}; what cannot be tested counts as not passed.",
        share(true),
        share(false)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rows::{Evidence, Role};

    #[test]
    fn no_row_is_demanded_twice() {
        let names: Vec<String> = read().rows.into_values().flatten().collect();
        let distinct: std::collections::BTreeSet<&String> = names.iter().collect();
        assert_eq!(distinct.len(), names.len());
    }

    #[test]
    fn demanded_rows_are_counted_apart() {
        let evidence = Evidence { source: String::new(), tolerance: String::new(), role: Role::Input };
        let row = |name: &str, value: f64| Row {
            evidence: Some(evidence.clone()),
            ..Row::measured(name, value, "1").within(1.0, [0.9, 1.1])
        };
        let mut rows = vec![
            row("stem.pendulum", 1.0),
            row("stem.slow_pull", 2.0),
            Row { pass: None, ..row("stem.spur_share", f64::NAN) },
            row("another", 1.0),
            Row::measured("stem.naive_success", 1.0, "1"),
        ];
        mark(&mut rows);
        let marks: Vec<Option<bool>> = rows.iter().map(|row| row.demanded).collect();
        assert_eq!(marks, [Some(true), Some(true), Some(true), Some(false), None]);
        let text = summary(&rows);
        assert!(text.contains("1 of 3 (33 %) pass, of the others 1 of 1 (100 %)"), "{text}");
    }
}
