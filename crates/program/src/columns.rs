//! Tables in plain text.

use comfy_table::{Cell, CellAlignment, ContentArrangement, Table, presets};

use crate::output::Escaped;

/// Lays out rows as columns two spaces apart. The columns in `left` are aligned left, the others right. All rows have as many cells as
/// the first. Control characters are escaped.
pub fn columns<R: AsRef<[String]>>(rows: &[R], left: &[usize]) -> String {
    let mut table = Table::new();
    table.load_preset(presets::NOTHING).set_content_arrangement(ContentArrangement::Disabled);
    for row in rows {
        let cell = |(column, text): (usize, &String)| {
            let side = if left.contains(&column) { CellAlignment::Left } else { CellAlignment::Right };
            Cell::new(Escaped(text)).set_alignment(side)
        };
        table.add_row(row.as_ref().iter().enumerate().map(cell));
    }
    let last = table.column_count().saturating_sub(1);
    for (i, column) in table.column_iter_mut().enumerate() {
        column.set_padding((0, if i == last { 0 } else { 2 }));
    }
    table.lines().map(|line| line.trim_end().to_owned() + "\n").collect()
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
