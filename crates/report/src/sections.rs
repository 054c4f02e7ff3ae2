//! The parts of the page, from top to bottom.

pub(crate) mod canopy;
pub(crate) mod components;
pub(crate) mod conditions;
pub(crate) mod cost;
pub(crate) mod definitions;
pub(crate) mod detection;
pub(crate) mod head;
pub(crate) mod headline;
pub(crate) mod pictures;
pub(crate) mod sweeps;

use maud::{Markup, PreEscaped, html};

use crate::figure::Figure;

/// A part of the page.
pub(crate) struct Section {
    /// Anchor of the section.
    pub id: &'static str,
    /// Title of the section.
    pub title: &'static str,
    /// Content, or the reason for its absence.
    pub body: Markup,
}

/// Figures side by side if the page is wide enough.
pub(crate) fn side_by_side(figures: &[Figure]) -> Markup {
    html! {
        div.figures { @for figure in figures {
            figure id=(figure.stem) { (PreEscaped(&figure.svg)) }
        } }
    }
}

/// Figures with their text beside the first, if the page is wide enough for three.
pub(crate) fn beside(prose: &Markup, figures: &[Figure]) -> Markup {
    html! {
        div.figures {
            div.prose { (prose) }
            @for figure in figures { figure id=(figure.stem) { (PreEscaped(&figure.svg)) } }
        }
    }
}

/// Placeholder of a section without data, with the command that makes the data.
pub(crate) fn missing(what: &str, command: &str) -> Markup {
    html! { p.missing { (what) " " code { (command) } " makes this section." } }
}
