//! Titles and definitions of the metrics, and their values in words with as many digits as are significant.

use orchard_spec::randomisation::Mode;
use orchard_statistics::Metric;
use orchard_statistics::Undefined;
use orchard_tasks::component::{ReachAndGrasp, metrics as component_metrics};
use orchard_tasks::harvest::metrics::METRICS;

/// Titles and definitions by name; `docs/benchmark-v1.md` has the whole of them.
const WORDS: [(&str, &str, &str); 35] = [
    (
        "harvest_completeness",
        "Harvest completeness",
        "Reachable fruit in the bucket at the end over reachable fruit at the start; mean over trees. The primary metric.",
    ),
    (
        "place_success_per_attempt",
        "Place success",
        "Attempts whose fruit came to rest in the bucket over all attempts.",
    ),
    ("grasp_rate", "Grasp rate", "Attempts in which both fingers pressed on one fruit over all attempts."),
    ("detach_rate", "Detach rate", "Attempts in which a gripped fruit came off its stem over all attempts."),
    ("throughput_fruit_per_min", "Throughput", "60 x fruit deposited over the episode's simulated seconds."),
    (
        "mean_cycle_time_s",
        "Cycle time",
        "Duration of placed attempts, from the commitment to the fruit at rest.",
    ),
    (
        "branches_snapped_per_tree",
        "Branches snapped",
        "Ruptures of wood, a tree. Damage: always present, also when 0.",
    ),
    (
        "fruit_dropped_per_tree",
        "Fruit dropped",
        "Fruit off its stem at the end and neither at rest in the bucket nor between the fingers, a tree.",
    ),
    ("fruit_deposited_per_tree", "Fruit deposited", "Fruit at rest in the bucket at the end, a tree."),
    (
        "fruit_knocked_off_per_tree",
        "Fruit knocked off",
        "Fruit that came off its stem without having been held, a tree.",
    ),
    ("attempts_per_tree", "Attempts", "Commitments to a target, false detections included, a tree."),
    ("mean_drop_height_m", "Drop height", "Height of the fall from the fingers into the bucket."),
    (
        "unbruised_per_placement",
        "Unbruised placements",
        "Deposited fruit that took no impact above the bruise energy over deposited fruit.",
    ),
    ("max_stem_pull_n", "Largest stem pull", "Largest stem force of an episode; mean over trees."),
    (
        "detection_precision",
        "Detection precision",
        "Detections matched to a fruit over all detections, in all images of the picker.",
    ),
    (
        "detection_recall_visible",
        "Detection recall",
        "Visible fruit matched by a detection over visible fruit, image by image.",
    ),
    (
        "fruit_bruised_per_tree",
        "Fruit bruised",
        "Deposited fruit that took an impact above the bruise energy, a tree.",
    ),
    (
        "fruit_stem_pulled_per_tree",
        "Fruit torn off",
        "Fruit that came off its stem under a pull above the limit at its end, a tree.",
    ),
    (
        "reachable_fruit_per_tree",
        "Reachable fruit",
        "Fruit inside the reach sphere from an admissible stand-off at the start, a tree.",
    ),
    (
        "reachable_fruit_by_ik_per_tree",
        "Reachable, confirmed",
        "Of these, confirmed by inverse kinematics, a tree.",
    ),
    ("precision", "Precision", "Detections matched to a fruit over all detections in single images."),
    ("recall", "Recall", "Fruit that ought to be found (visible enough, large enough, in range) and was."),
    ("recall_visible", "Recall, all visible", "Fruit that shows a pixel and was found."),
    (
        "false_positives_per_view",
        "False positives a view",
        "Detections that are matched to no fruit, an image.",
    ),
    ("wood_false_positives_per_view", "On wood, a view", "Of these, on wood."),
    ("radius_bias_m", "Radius bias", "Mean error of the radius."),
    ("survey_recall", "Recall over views", "Fruit found in at least one view in which it ought to be."),
    ("success", "Success", "Trials that met what was asked for over trials."),
    ("time_s", "Time", "Simulated time of successful trials."),
    ("path_m", "Path of the hand", "Way of the point between the finger pads in successful trials."),
    ("contact_impulse_n_s", "Contact impulse", "Force of the robot on live wood, summed over time."),
    (
        "peak_contact_force_n",
        "Peak contact force",
        "Largest sum of contact forces on live wood at one moment.",
    ),
    ("peak_moment_ratio", "Peak moment ratio", "Largest bending moment of a joint over its rupture moment."),
    ("peak_moment_excess", "Peak moment excess", "Largest rise of that ratio over its value at the start."),
    ("moment_excess_s", "Moment excess", "That rise, summed over time."),
];

/// Returns a metric's title, or its name in words if it has none.
pub(crate) fn title(name: &str) -> String {
    let known = WORDS.iter().find(|(own, ..)| *own == name);
    known.map_or_else(|| capital(&name.replace('_', " ")), |(_, title, _)| (*title).to_owned())
}

/// Returns the definition of a metric, if this page has one.
pub(crate) fn definition(name: &str) -> Option<&'static str> {
    WORDS.iter().find(|(own, ..)| *own == name).map(|(.., definition)| *definition)
}

/// A harvest metric's unit, as people write it: nothing for a ratio.
pub(crate) fn unit(name: &str) -> String {
    let of_harvest = METRICS.iter().find(|m| m.name == name).map(|m| m.unit);
    let of_trials =
        || component_metrics::<ReachAndGrasp>().into_iter().find(|m| m.name == name).map(|m| m.unit);
    let unit = of_harvest.or_else(of_trials).unwrap_or("1");
    if name.ends_with("_per_tree") {
        return "per tree".to_owned();
    }
    if name.ends_with("_per_trial") {
        return "per trial".to_owned();
    }
    if unit == "1" { String::new() } else { unit.to_owned() }
}

/// Title with its unit in brackets, for a figure.
pub(crate) fn title_with_unit(name: &str) -> String {
    match &*unit(name) {
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
    fn every_metric_of_the_benchmark_has_words() {
        for metric in METRICS {
            assert!(definition(metric.name).is_some(), "{}", metric.name);
        }
        for metric in component_metrics::<ReachAndGrasp>() {
            assert!(
                definition(metric.name).is_some() || metric.name.ends_with("_per_trial"),
                "{}",
                metric.name
            );
        }
        assert_eq!(title("fruit_knocked_off_per_trial"), "Fruit knocked off per trial");
        assert_eq!(title_with_unit("throughput_fruit_per_min"), "Throughput [fruit/min]");
        assert_eq!(title_with_unit("fruit_dropped_per_tree"), "Fruit dropped [per tree]");
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
