//! The summary of a component task.

use std::collections::BTreeMap;

use orchard_bench::record::Record;
use orchard_statistics::Resamples;
use orchard_statistics::{Metric, estimate};
use serde::{Deserialize, Serialize};

use crate::component::metrics::metrics;
use crate::component::plan::{ComponentPlan, ComponentRun};
use crate::component::record::{TreeRecord, TrialOutcome};
use crate::component::task::Component;
use crate::seeds::SeedSetLabel;

/// A whole run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ComponentSummary {
    /// The run.
    #[serde(flatten)]
    pub run: ComponentRun,
    /// Version of the protocol's config.
    pub config_version: String,
    /// Profile.
    pub profile: String,
    /// Seed set of the trees.
    pub seed_set: SeedSetLabel,
    /// Seeds, in order.
    pub seeds: Vec<u64>,
    /// One entry per tree.
    pub trees: Vec<TreeLine>,
    /// Number of trials by outcome.
    pub outcomes: BTreeMap<String, u32>,
    /// Number of failed attempts by reason.
    pub failures: BTreeMap<String, u32>,
    /// Number of trials in which the controller gave up, by reason; left out where it never did.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub gave_up: BTreeMap<String, u32>,
    /// Estimates by name.
    pub metrics: BTreeMap<String, Metric>,
}

/// Summary of a tree.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TreeLine {
    /// File under the result folder.
    pub file: String,
    /// Seed.
    pub seed: u64,
    /// World index.
    pub world: u32,
    /// Reason why it could not be built, if so.
    pub never_built: Option<String>,
    /// Trials; fewer than planned if the tree has too few targets.
    pub trials: u32,
    /// Of these, with success.
    pub successes: u32,
}

impl ComponentSummary {
    /// Sums up the trees of a plan, given in the order of [`ComponentPlan::keys`].
    pub fn of_run<C: Component>(plan: &ComponentPlan, trees: &[TreeRecord<C>]) -> Self {
        let of_seed = |seed: &u64| (0..trees.len()).filter(|&i| trees[i].key.seed == *seed).collect();
        let groups: Vec<Vec<usize>> = plan.seeds.iter().map(of_seed).collect();
        let resamples = Resamples::draw(&groups, &plan.protocol.bootstrap);
        let (mut outcomes, mut failures, mut gave_up) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
        for trial in trees.iter().flat_map(|tree| &tree.trials) {
            *outcomes.entry(status(&trial.ended).to_owned()).or_insert(0) += 1;
            for failure in &trial.failures {
                *failures.entry(failure.clone()).or_insert(0) += 1;
            }
            if let Some(told) = &trial.gave_up {
                *gave_up.entry(told.fault.clone()).or_insert(0) += 1;
            }
        }
        Self {
            run: plan.run_of(C::NAME),
            config_version: plan.protocol.version.clone(),
            profile: plan.profile.clone(),
            seed_set: plan.protocol.label(&plan.seeds, plan.trees),
            seeds: plan.seeds.clone(),
            trees: trees.iter().map(line).collect(),
            outcomes,
            failures,
            gave_up,
            metrics: estimate(&metrics::<C>(), trees, &resamples),
        }
    }
}

fn line<C: Component>(tree: &TreeRecord<C>) -> TreeLine {
    TreeLine {
        file: TreeRecord::<C>::path(&tree.key),
        seed: tree.key.seed,
        world: tree.key.world,
        never_built: tree.never_built.clone(),
        trials: tree.trials.len() as u32,
        successes: tree.trials.iter().filter(|trial| trial.success()).count() as u32,
    }
}

fn status(ended: &TrialOutcome) -> &'static str {
    match ended {
        TrialOutcome::Success => "success",
        TrialOutcome::TimeOver => "time_over",
        TrialOutcome::Stalled => "stalled",
        TrialOutcome::Quarantined { .. } => "quarantined",
    }
}
