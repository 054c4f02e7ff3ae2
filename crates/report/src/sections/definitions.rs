//! Section with the definitions of the metrics.

use maud::html;
use orchard_tasks::harvest::metrics::METRICS;

use super::Section;
use crate::words::{definition, title, unit};

/// The section.
pub(crate) fn section() -> Section {
    let body = html! {
        p {
            "mean = sum of numerators over sum of denominators, over episodes; n is the sum of denominators. A quarantined world counts as zero \
             harvest. docs/benchmark-v1.md has formulas, edge cases and statistics."
        }
        dl.definitions { @for metric in METRICS {
            div id={ "def-" (metric.name) } {
                dt { (title(metric.name)) " " code { (metric.name) } @if !unit(metric.name).is_empty() { " [" (unit(metric.name)) "]" } }
                dd { (definition(metric.name).unwrap_or("Defined in docs/benchmark-v1.md.")) }
            }
        } }
    };
    Section { id: "definitions", title: "Definitions", body }
}
