//! Tables, which scroll horizontally if they are too wide.

use maud::{Markup, html};

/// A cell.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Cell {
    /// Text of the cell.
    pub text: String,
    /// Tooltip: the reason for an empty cell, or an explanation.
    pub title: Option<String>,
    /// Style of the cell.
    pub kind: Kind,
}

/// Style of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Text, aligned left.
    Words,
    /// Number, aligned right, in digits of one width.
    Number,
    /// Main number of a row, aligned right, in bold.
    Main,
    /// Favourable verdict.
    Good,
    /// Unfavourable verdict.
    Bad,
}

impl Cell {
    /// Text.
    pub fn words(text: impl Into<String>) -> Self {
        Self { text: text.into(), title: None, kind: Kind::Words }
    }

    /// A number as text.
    pub fn number(text: impl Into<String>) -> Self {
        Self { text: text.into(), title: None, kind: Kind::Number }
    }

    /// Main number of a row.
    pub fn main(text: impl Into<String>) -> Self {
        Self { text: text.into(), title: None, kind: Kind::Main }
    }

    /// A verdict.
    pub fn verdict(text: impl Into<String>, good: bool) -> Self {
        Self { text: text.into(), title: None, kind: if good { Kind::Good } else { Kind::Bad } }
    }

    /// Adds a reason or an explanation as the cell's title.
    pub fn because(mut self, title: Option<impl Into<String>>) -> Self {
        self.title = title.map(Into::into);
        self
    }
}

/// A table with heads and a caption. The first cell of a row is its heading.
pub(crate) fn table(caption: &str, heads: &[&str], rows: &[Vec<Cell>]) -> Markup {
    let kind_of = |column: usize| rows.first().and_then(|row| row.get(column)).map(|cell| cell.kind);
    html! {
        div.scroll tabindex="0" role="region" aria-label=(caption) {
            table {
                caption { (caption) }
                thead { tr {
                    @for (i, head) in heads.iter().enumerate() {
                        th scope="col" class=(if kind_of(i).is_none_or(|kind| kind == Kind::Words) { "w" } else { "n" }) { (head) }
                    }
                } }
                tbody { @for row in rows { tr {
                    @for (i, cell) in row.iter().enumerate() { (one(cell, i == 0)) }
                } } }
            }
        }
    }
}

fn one(cell: &Cell, names_row: bool) -> Markup {
    let class = match cell.kind {
        Kind::Words => "w",
        Kind::Number => "n",
        Kind::Main => "n m",
        Kind::Good => "w good",
        Kind::Bad => "w bad",
    };
    let content = html! {
        @match &cell.title {
            Some(title) => span title=(title) { (cell.text) },
            None => (cell.text),
        }
    };
    html! {
        @if names_row { th scope="row" class=(class) { (content) } } @else { td class=(class) { (content) } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_escaped_and_reasons_are_told() {
        let row = vec![Cell::words("a<b"), Cell::number("-").because(Some("no \"figure\""))];
        let html = table("some", &["name", "value"], &[row]).into_string();
        assert!(html.contains("a&lt;b") && html.contains("title=\"no &quot;figure&quot;\""), "{html}");
        assert!(html.contains("<th scope=\"col\" class=\"n\">value"), "{html}");
    }
}
