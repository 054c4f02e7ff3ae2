//! Titles and units of the metrics, and their values in words with as many digits as are significant.

use orchard_spec::randomisation::Mode;
use orchard_statistics::{Metric, MetricInfo, Undefined};
use orchard_tasks::component::{ReachAndGrasp, metrics as component_metrics};
use orchard_tasks::detect::METRICS as DETECT;
use orchard_tasks::harvest::metrics::infos;

/// Returns the definition of a metric of the harvest, of detection or of the component tasks.
fn info(name: &str) -> Option<MetricInfo> {
    let detect = DETECT.iter().map(|m| m.info);
    let components = component_metrics::<ReachAndGrasp>().into_iter().map(|m| m.info);
    infos().chain(detect).chain(components).find(|info| info.name == name)
}

/// Returns a metric's title, or its name in words if no task defines it.
pub(crate) fn title(name: &str) -> String {
    info(name).map_or_else(|| capital(&plain(name)), |info| info.title.to_owned())
}

/// Returns a metric's unit; nothing for a ratio.
pub(crate) fn unit(name: &str) -> &'static str {
    info(name).map(|info| info.unit).filter(|unit| *unit != "1").unwrap_or_default()
}

/// Title with its unit in brackets, for a figure.
pub(crate) fn title_with_unit(name: &str) -> String {
    match unit(name) {
        "" => title(name),
        unit => format!("{} [{unit}]", title(name)),
    }
}

/// Digits after the point that a metric is written with.
pub(crate) fn digits(name: &str) -> usize {
    if name.ends_with("_n") {
        1
    } else if name.ends_with("_m") || name == "moment_excess_s" || unit(name).is_empty() {
        3
    } else {
        2
    }
}

/// A number with `digits` digits after the point; a dash if there is none.
pub(crate) fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "-".to_owned(), |x| signed(format!("{x:.digits$}")))
}

/// An interval.
pub(crate) fn interval(ci95: [Option<f64>; 2], digits: usize) -> String {
    match ci95 {
        [Some(low), Some(high)] => {
            format!("{} to {}", signed(format!("{low:.digits$}")), signed(format!("{high:.digits$}")))
        }
        _ => "-".to_owned(),
    }
}

/// A whole number with thin gaps between thousands.
pub(crate) fn grouped(n: u64) -> String {
    let digits = n.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    text
}

/// A minus sign where there is one, and none before zeros.
fn signed(text: String) -> String {
    match text.strip_prefix('-') {
        Some(size) if size.chars().all(|c| c == '0' || c == '.') => size.to_owned(),
        Some(size) => format!("\u{2212}{size}"),
        None => text,
    }
}

/// Returns the reason why a metric has no figure, or no interval.
pub(crate) fn why(metric: &Metric) -> Option<String> {
    metric.undefined.map(|reason| reason_of(reason, metric.mean.is_some()))
}

/// A reason in words.
pub(crate) fn reason_of(reason: Undefined, has_mean: bool) -> String {
    if has_mean { format!("no interval: {reason}") } else { format!("no figure: {reason}") }
}

/// Returns the name of a batch mode: the differences between its worlds.
pub(crate) fn mode(mode: Mode) -> &'static str {
    match mode {
        Mode::Homogeneous => "homogeneous",
        Mode::SharedDimensions => "shared dimensions",
        Mode::DistinctDimensions => "distinct dimensions",
        Mode::DistinctTopology => "distinct topology",
    }
}

/// A name of a file or a state as people write it.
pub(crate) fn plain(name: &str) -> String {
    name.replace(['_', '-'], " ")
}

/// Returns the text with its first letter as a capital.
pub(crate) fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn titles_and_units() {
        assert_eq!(title("fruit_knocked_off_per_trial"), "Fruit knocked off a trial");
        assert_eq!(title("no_metric"), "No metric");
        assert_eq!(title_with_unit("throughput_fruit_per_min"), "Throughput [fruit/min]");
        assert_eq!(title_with_unit("fruit_dropped_per_tree"), "Fruit dropped a tree [fruit]");
        assert_eq!(title_with_unit("success"), "Success");
    }

    #[test]
    fn numbers_keep_their_digits() {
        assert_eq!(number(Some(0.12), 3), "0.120");
        assert_eq!(number(Some(-0.0001), 2), "0.00");
        assert_eq!(number(Some(-0.126), 2), "\u{2212}0.13");
        assert_eq!(number(None, 2), "-");
        assert_eq!(interval([Some(0.1), Some(0.25)], 2), "0.10 to 0.25");
        assert_eq!(interval([Some(0.1), None], 2), "-");
        assert_eq!(grouped(1234567).replace('\u{202f}', " "), "1 234 567");
        assert_eq!(grouped(12), "12");
    }
}
