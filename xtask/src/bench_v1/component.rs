//! The component tasks: one skill at a time.

use std::sync::atomic::AtomicBool;

use orchard_bench::OtherPlan;
use orchard_bench::component::{
    Component, ComponentPlan, ComponentResult, Gentle, ReachAndGrasp, TreeRecord, metrics, run as run_plan,
};
use orchard_bench::store::Store;
use orchard_spec::Spec;

use super::bar::{Bar, Shown};
use super::{Args, Scope, counts, ended};
use crate::failure::Failure;
use crate::headline::fine_table;

/// What the command line asks for.
pub struct Asked<C> {
    plan: ComponentPlan,
    task: std::marker::PhantomData<C>,
}

/// Reach and grasp.
pub type Grasping = Asked<ReachAndGrasp>;
/// Gentle interaction.
pub type Pushing = Asked<Gentle>;

impl<C: Component> Asked<C> {
    /// Reads the command line.
    pub fn read(args: &Args, scope: &Scope) -> Result<Self, Failure> {
        let plan =
            ComponentPlan::paper(args.controller()?, args.profile.name(), scope.seeds.clone(), scope.trees);
        plan.check().map_err(|e| Failure::BadInput(e.to_string()))?;
        Ok(Self { plan, task: std::marker::PhantomData })
    }

    /// Whether the folder takes it.
    pub fn check(&self, store: &Store) -> Result<(), OtherPlan> {
        store.check_plan::<TreeRecord<C>>(&self.plan.keys(C::NAME))
    }

    /// Runs it and reports.
    pub fn run(&self, scope: &Scope, store: &Store, stop: &AtomicBool) -> Result<(), Failure> {
        let bar = Bar::new(self.plan.keys(C::NAME).len(), self.plan.steps::<C>(), shown::<C>);
        let result = run_plan::<C>(&self.plan, store, scope.threads, stop, &bar);
        bar.clear();
        report(&ended(result)?, &self.plan);
        say!("results: {}", scope.out.join(C::SUMMARY).display());
        Ok(())
    }
}

fn shown<C: Component>(record: &TreeRecord<C>) -> Shown {
    let (seed, world) = (record.key.seed, record.key.world);
    let line = match &record.never_built {
        Some(reason) => format!("seed {seed} tree {world}: never built: {reason}"),
        None => format!(
            "seed {seed} tree {world}: {} of {} trials met",
            record.trials.iter().filter(|trial| trial.success()).count(),
            record.trials.len()
        ),
    };
    let frame = Spec::paper().sim.frame();
    let frames = record.trials.iter().map(|trial| (trial.duration_s / frame).round() as u64).sum();
    Shown { steps: frames, line }
}

fn report<C: Component>(result: &ComponentResult<C>, plan: &ComponentPlan) {
    let summary = &result.summary;
    say!(
        "task {}, controller {}; seeds {:?} x {} trees",
        summary.run.task,
        summary.run.controller,
        summary.seeds,
        plan.trees
    );
    let definitions = metrics::<C>();
    let order = definitions.iter().map(|definition| (definition.name, definition.unit));
    say!("{}", fine_table(order, &summary.metrics).trim_end());
    say!("trials ended: {}", counts(&summary.outcomes));
    say!("attempts given up: {}", counts(&summary.failures));
}
