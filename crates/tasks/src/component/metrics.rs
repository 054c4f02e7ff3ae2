//! Metrics of the component tasks, each a ratio of sums over trees. `docs/benchmark-v1.md` shows this table and states the loads' formulas.

use orchard_statistics::{MetricDefinition, MetricInfo, Share};

use crate::component::record::{TreeRecord, TrialRecord};
use crate::component::task::Component;

/// Returns all metrics of a component task, the most important first.
pub fn metrics<C: Component>() -> Vec<MetricDefinition<TreeRecord<C>>> {
    vec![
        MetricDefinition {
            info: MetricInfo {
                name: "success",
                title: "Success",
                unit: "1",
                numerator: "trials with success",
                denominator: "trials",
                note: "",
            },
            share: |t: &TreeRecord<C>| Share::of_counts(successes(t).count(), t.trials.len()),
        },
        MetricDefinition {
            info: MetricInfo {
                name: "time_s",
                title: "Time",
                unit: "s",
                numerator: "simulated duration of trials with success",
                denominator: "trials with success",
                note: "",
            },
            share: |t| of_successes(t, |trial| trial.duration_s),
        },
        MetricDefinition {
            info: MetricInfo {
                name: "path_m",
                title: "Path of the hand",
                unit: "m",
                numerator: "path length in the world of the point between the pads, the base's motion included, in trials with success",
                denominator: "trials with success",
                note: "",
            },
            share: |t| of_successes(t, |trial| trial.path_m),
        },
        MetricDefinition {
            info: MetricInfo {
                name: "contact_impulse_n_s",
                title: "Contact impulse",
                unit: "N s",
                numerator: "force of the robot on live wood, summed over time",
                denominator: "trials that were not quarantined",
                note: "",
            },
            share: |t| of_sound(t, |trial| trial.contact_impulse_n_s),
        },
        MetricDefinition {
            info: MetricInfo {
                name: "peak_contact_force_n",
                title: "Peak contact force",
                unit: "N",
                numerator: "largest sum of contact forces of the robot on live wood at one moment",
                denominator: "trials that were not quarantined",
                note: "",
            },
            share: |t| of_sound(t, |trial| trial.peak_contact_force_n),
        },
        MetricDefinition {
            info: MetricInfo {
                name: "peak_moment_ratio",
                title: "Peak moment ratio",
                unit: "1",
                numerator: "largest bending moment of a joint over its rupture moment",
                denominator: "trials that were not quarantined",
                note: "",
            },
            share: |t| of_sound(t, |trial| trial.peak_moment_ratio),
        },
        MetricDefinition {
            info: MetricInfo {
                name: "peak_moment_excess",
                title: "Peak moment excess",
                unit: "1",
                numerator: "largest rise of a joint's moment ratio over its value at the start",
                denominator: "trials that were not quarantined",
                note: "",
            },
            share: |t| of_sound(t, |trial| trial.peak_moment_excess),
        },
        MetricDefinition {
            info: MetricInfo {
                name: "moment_excess_s",
                title: "Moment excess",
                unit: "s",
                numerator: "rise of the moment ratio over its value at the start, summed over time",
                denominator: "trials that were not quarantined",
                note: "",
            },
            share: |t| of_sound(t, |trial| trial.moment_excess_s),
        },
        MetricDefinition {
            info: MetricInfo {
                name: "branches_snapped_per_trial",
                title: "Branches snapped a trial",
                unit: "branches",
                numerator: "ruptures of wood",
                denominator: "trials",
                note: "",
            },
            share: |t| of_all(t, |trial| f64::from(trial.branches_snapped)),
        },
        MetricDefinition {
            info: MetricInfo {
                name: "fruit_knocked_off_per_trial",
                title: "Fruit knocked off a trial",
                unit: "fruit",
                numerator: "fruit that came off its stem, the named one left out",
                denominator: "trials",
                note: "",
            },
            share: |t| of_all(t, |trial| f64::from(trial.fruit_knocked_off)),
        },
    ]
}

fn successes<C: Component>(tree: &TreeRecord<C>) -> impl Iterator<Item = &TrialRecord<C::Target>> {
    tree.trials.iter().filter(|trial| trial.success())
}

fn share<'a, T: 'a>(
    trials: impl Iterator<Item = &'a TrialRecord<T>>,
    of: fn(&TrialRecord<T>) -> f64,
) -> Share {
    trials.fold(Share::default(), |sum, trial| Share {
        numerator: sum.numerator + of(trial),
        denominator: sum.denominator + 1.0,
    })
}

fn of_all<C: Component>(tree: &TreeRecord<C>, of: fn(&TrialRecord<C::Target>) -> f64) -> Share {
    share(tree.trials.iter(), of)
}

fn of_sound<C: Component>(tree: &TreeRecord<C>, of: fn(&TrialRecord<C::Target>) -> f64) -> Share {
    share(tree.trials.iter().filter(|trial| trial.sound()), of)
}

fn of_successes<C: Component>(tree: &TreeRecord<C>, of: fn(&TrialRecord<C::Target>) -> f64) -> Share {
    share(successes(tree), of)
}
