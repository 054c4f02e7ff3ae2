//! The component tasks: one skill at a time.

use orchard_bench::store::Store;
use orchard_scenario::Scenario;
use orchard_tasks::component::{
    Component, ComponentPlan, ComponentSummary, Gentle, ReachAndGrasp, TreeRecord, Trials, metrics,
};
use orchard_tasks::plan_file::TreeExtent;

use super::bar::RecordProgress;
use super::task::PresentedTask;
use super::{counts, tell_faults};
use crate::failure::Failure;
use crate::headline::fine_table;

/// The trials of a component task under a controller.
pub struct ComponentJob<C> {
    plan: ComponentPlan,
    task: std::marker::PhantomData<C>,
}

/// Reach and grasp.
pub type Grasping = ComponentJob<ReachAndGrasp>;
/// Gentle interaction.
pub type Pushing = ComponentJob<Gentle>;

impl<C: Component> ComponentJob<C> {
    /// Plans the trials.
    pub fn new(scenario: &Scenario, trees: &TreeExtent) -> Result<Self, Failure> {
        let plan = ComponentPlan::new(scenario.clone(), &trees.profile, trees.seeds.clone(), trees.trees)?;
        plan.check()?;
        Ok(Self { plan, task: std::marker::PhantomData })
    }
}

impl<C: Component> PresentedTask for ComponentJob<C> {
    type Record = TreeRecord<C>;
    type Summary = ComponentSummary;
    type Task<'a> = Trials<'a, C>;

    fn task(&self) -> Trials<'_, C> {
        Trials::of(&self.plan)
    }

    fn steps(&self) -> u64 {
        self.plan.steps::<C>()
    }

    fn shown(record: &TreeRecord<C>) -> RecordProgress {
        let (seed, world) = (record.key.seed, record.key.world);
        let line = match &record.never_built {
            Some(reason) => format!("seed {seed} tree {world}: could not be built: {reason}"),
            None => format!(
                "seed {seed} tree {world}: {} of {} trials successful",
                record.trials.iter().filter(|trial| trial.success()).count(),
                record.trials.len()
            ),
        };
        RecordProgress { steps: record.trials.iter().map(|trial| u64::from(trial.frames)).sum(), line }
    }

    fn report(&self, summary: &ComponentSummary, _: &Store) -> Result<(), Failure> {
        report::<C>(summary, self.plan.trees);
        Ok(())
    }
}

fn report<C: Component>(summary: &ComponentSummary, trees: u32) {
    let (task, controller) = (&summary.run.task, &summary.run.scenario.controller);
    say!("task {task}, controller {controller}; seeds {:?} x {trees} trees", summary.seeds);
    tell_faults(&summary.gave_up);
    let definitions = metrics::<C>();
    let order = definitions.iter().map(|definition| (definition.info.name, definition.info.unit));
    say!("{}", fine_table(order, &summary.metrics).trim_end());
    say!("outcomes of trials: {}", counts(&summary.outcomes));
    say!("failure reasons of attempts: {}", counts(&summary.failures));
}
