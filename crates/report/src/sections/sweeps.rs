//! Sweeps: figures, and paired tests against the reference of each.

use maud::{Markup, html};
use orchard_tasks::harvest::summary::{Sweep, SweepComparison};
use orchard_tasks::protocol::Protocol;

use super::{Section, missing, side_by_side};
use crate::figure::Figure;
use crate::figures::{Figures, dial};
use crate::results::{Results, ends};
use crate::table::{Cell, table};
use crate::words::{capital, digits, number, reason_of, title};

/// Sweeps of the benchmark, with their dials.
const KNOWN: [(&str, &str); 3] = [
    ("foliage", "Leaves hide fruit: the same trees with increasing foliage."),
    ("fruit", "More fruit per tree: more to pick in the same time, and more obstacles."),
    ("terrain", "Bumpy ground: the robot drives on a height field of this amplitude."),
];

/// Adjusted p-values below this are marked.
const LEVEL: f64 = 0.05;

/// The section.
pub(crate) fn section(results: &Results, figures: &Figures, protocol: &Protocol) -> Section {
    let sweeps = results.harvest.as_ref().map(|harvest| &harvest.sweeps);
    let of = |name: &str| sweeps.and_then(|sweeps| sweeps.get(name));
    let drawn =
        |name: &str| figures.sweeps.iter().find(|(own, _)| own == name).map_or(&[][..], |(_, list)| list);
    let known = |name: &str| KNOWN.iter().any(|(own, _)| *own == name);
    let others: Vec<&String> =
        sweeps.into_iter().flat_map(|s| s.keys()).filter(|name| !known(name)).collect();
    // A benchmark with conditions outside sweeps, that in the field, does not miss these.
    let expects_known = protocol.conditions.is_empty();
    let body = html! {
        p {
            "Every point is the mean of a condition with its 95 % interval, on the same trees. Hollow diamonds are the paper's figures. \
             The table under each sweep compares conditions tree by tree with its reference, in most sweeps the nominal condition."
        }
        @for (name, what) in KNOWN {
            @match of(name) {
                Some(sweep) => (one(name, what, sweep, drawn(name))),
                None => @if expects_known {
                    h3 { (capital(name)) }
                    (missing(&format!("No {name} sweep in this folder."), &format!("cargo xtask bench-v1 --profile full --conditions {name}")))
                },
            }
        }
        @for name in others { @if let Some(sweep) = of(name) { (one(name, "", sweep, drawn(name))) } }
    };
    Section { id: "sweeps", title: "Sweeps", body }
}

fn one(name: &str, what: &str, sweep: &Sweep, figures: &[Figure]) -> Markup {
    html! {
        h3 id={ "sweep-" (name) } { (capital(&dial(sweep))) }
        p { (what) }
        (side_by_side(figures))
        @if !sweep.comparisons.is_empty() { (tests(name, sweep)) }
    }
}

fn tests(name: &str, sweep: &Sweep) -> Markup {
    let rows: Vec<_> = sweep.comparisons.iter().map(comparison).collect();
    let heads = [
        "metric",
        "condition",
        "difference",
        "95 % interval",
        "pairs",
        "p (Wilcoxon)",
        "p (permutation)",
        "r",
        "d_z",
    ];
    html! {
        details open[sweep.comparisons.len() <= 12] {
            summary { "Paired tests against the reference, Holm-adjusted over the sweep" }
            (table(&format!("Paired tests, {name}"), &heads, &rows))
            p.note {
                "difference: condition minus reference, mean over trees. p: two-sided, Holm-adjusted over the whole sweep; * marks p < "
                (LEVEL) ". r: matched-pairs rank-biserial correlation, \u{2212}1 to 1. d_z: mean difference over its standard deviation."
            }
        }
    }
}

fn comparison(c: &SweepComparison) -> Vec<Cell> {
    let test = &c.test;
    let digits = digits(&c.metric);
    let p = |p: Option<f64>| {
        let reason = test.no_test.map(|reason| reason_of(reason, false));
        match p {
            None => Cell::number("-").because(reason),
            Some(p) if p < LEVEL => Cell::main(format!("{}\u{2009}*", p_value(p))),
            Some(p) => Cell::number(p_value(p)),
        }
    };
    let interval = ends(test.ci95).map(|ends| ends.map(|end| plus(end, digits)).join(" to "));
    let figure = |f: &orchard_statistics::Figure, digits: usize| {
        Cell::number(f.value.map_or_else(|| "-".to_owned(), |x| plus(x, digits)))
            .because(f.undefined.map(|reason| reason_of(reason, false)))
    };
    vec![
        Cell::words(title(&c.metric)).because(Some(c.metric.as_str())),
        Cell::words(c.condition.as_str()).because(Some(format!("compared with {}", c.reference))),
        figure(&test.mean, digits),
        Cell::number(interval.unwrap_or_else(|| "-".to_owned()))
            .because(test.no_interval.map(|reason| reason_of(reason, true))),
        Cell::number(test.pairs.to_string())
            .because(Some(format!("{} of them without a difference", test.equal))),
        p(c.holm.wilcoxon),
        p(c.holm.permutation),
        figure(&test.rank_biserial, 2),
        figure(&test.cohens_dz, 2),
    ]
}

/// A difference with its sign.
fn plus(x: f64, digits: usize) -> String {
    let text = number(Some(x), digits);
    let is_zero = text.chars().all(|c| c == '0' || c == '.');
    if x > 0.0 && !is_zero { format!("+{text}") } else { text }
}

fn p_value(p: f64) -> String {
    if p < 0.001 { "< 0.001".to_owned() } else { format!("{p:.3}") }
}

#[cfg(test)]
mod tests_of_words {
    use super::*;

    #[test]
    fn differences_have_a_sign_and_p_values_three_digits() {
        assert_eq!(
            (plus(0.5, 2), plus(-0.5, 2), plus(1e-9, 2)),
            ("+0.50".into(), "\u{2212}0.50".into(), "0.00".into())
        );
        assert_eq!((p_value(0.0004), p_value(0.0456)), ("< 0.001".into(), "0.046".into()));
    }
}
