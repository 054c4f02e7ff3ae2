//! Tables in plain text.

/// Rows of as many cells as the first in columns two spaces apart, those of `left` aligned to the left and the others to the
/// right.
pub fn columns<R: AsRef<[String]>>(rows: &[R], left: &[usize]) -> String {
    let count = rows.first().map_or(0, |row| row.as_ref().len());
    let length = |row: &R, column: usize| row.as_ref().get(column).map_or(0, |cell| cell.chars().count());
    let widths: Vec<usize> =
        (0..count).map(|column| rows.iter().map(|row| length(row, column)).max().unwrap_or(0)).collect();
    let mut text = String::new();
    for row in rows {
        let cell = |(column, (cell, &width)): (usize, (&String, &usize))| {
            if left.contains(&column) { format!("{cell:<width$}") } else { format!("{cell:>width$}") }
        };
        let cells: Vec<String> = row.as_ref().iter().zip(&widths).enumerate().map(cell).collect();
        text += cells.join("  ").trim_end();
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_stand_in_columns() {
        let rows = [["a", "1", "m"], ["bcd", "10.5", ""]].map(|row| row.map(str::to_owned));
        assert_eq!(columns(&rows, &[0, 2]), "a       1  m\nbcd  10.5\n");
    }
}
