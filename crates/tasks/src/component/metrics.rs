//! The component tasks' metrics, each a ratio of sums over trees. `docs/benchmark-v1.md` states the formulas.

use orchard_statistics::MetricDefinition;
use orchard_statistics::Share;

use crate::component::record::{TreeRecord, TrialRecord};
use crate::component::task::Component;

/// All metrics of a component task, the most important first.
pub fn metrics<C: Component>() -> Vec<MetricDefinition<TreeRecord<C>>> {
    let definition = |name, unit, share| MetricDefinition { name, unit, share };
    vec![
        definition("success", "1", |t: &TreeRecord<C>| {
            Share::of_counts(successes(t).count(), t.trials.len())
        }),
        definition("time_s", "s", |t| of_successes(t, |trial| trial.duration_s)),
        definition("path_m", "m", |t| of_successes(t, |trial| trial.path_m)),
        definition("contact_impulse_n_s", "N s", |t| of_sound(t, |trial| trial.contact_impulse_n_s)),
        definition("peak_contact_force_n", "N", |t| of_sound(t, |trial| trial.peak_contact_force_n)),
        definition("peak_moment_ratio", "1", |t| of_sound(t, |trial| trial.peak_moment_ratio)),
        definition("peak_moment_excess", "1", |t| of_sound(t, |trial| trial.peak_moment_excess)),
        definition("moment_excess_s", "s", |t| of_sound(t, |trial| trial.moment_excess_s)),
        definition("branches_snapped_per_trial", "branches", |t| {
            of_all(t, |trial| f64::from(trial.branches_snapped))
        }),
        definition("fruit_knocked_off_per_trial", "fruit", |t| {
            of_all(t, |trial| f64::from(trial.fruit_knocked_off))
        }),
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
