//! Section with the definitions of the metrics.

use maud::html;
use orchard_tasks::harvest::metrics::infos;

use super::Section;

/// The section.
pub(crate) fn section() -> Section {
    let body = html! {
        p {
            "mean = sum of numerators over sum of denominators, over episodes, or a quantile over all trees; n is the sum of denominators, or the number of values. A quarantined world counts as zero \
             harvest. docs/benchmark-v1.md has formulas, edge cases and statistics."
        }
        dl.definitions { @for info in infos() {
            div id={ "def-" (info.name) } {
                dt { (info.title) " " code { (info.name) } @if info.unit != "1" { " [" (info.unit) "]" } }
                dd { (info.definition()) }
            }
        } }
    };
    Section { id: "definitions", title: "Definitions", body }
}
