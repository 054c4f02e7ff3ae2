//! Runs every tree of a plan, in parallel, into a result folder.

use std::marker::PhantomData;
use std::sync::atomic::AtomicBool;

use orchard_bench::PlanError;
use orchard_bench::store::StoreError;
use orchard_bench::task::{Progress, RunError, Session, Task, TaskResult, run_task};

use crate::component::plan::{ComponentKey, ComponentPlan};
use crate::component::record::TreeRecord;
use crate::component::summary::ComponentSummary;
use crate::component::task::Component;
use crate::component::trial::run_trial;
use crate::harvest::adapter::Simulated;
use crate::stage::{Processor, Stage};

/// A finished run.
pub type ComponentResult<C> = TaskResult<TreeRecord<C>, ComponentSummary>;

/// Runs a session's part of a plan: writes a record per tree, `compute.json`, and for a whole run the summary.
///
/// # Errors
/// The plan is invalid, the folder holds records of another plan, a file cannot be written, or `stop` was raised.
pub fn run<C: Component>(
    plan: &ComponentPlan,
    session: &Session<'_>,
    progress: &impl Progress<TreeRecord<C>>,
) -> Result<ComponentResult<C>, RunError> {
    run_task(&Trials::of(plan, &Processor), session, progress)
}

/// A component task: the trials of every tree of a plan.
pub struct Trials<'a, C, S> {
    plan: &'a ComponentPlan,
    stage: &'a S,
    task: PhantomData<C>,
}

impl<'a, C: Component, S: Stage> Trials<'a, C, S> {
    /// Builds the task of a plan, with worlds that a stage computes.
    pub fn of(plan: &'a ComponentPlan, stage: &'a S) -> Self {
        Self { plan, stage, task: PhantomData }
    }
}

impl<C: Component, S: Stage> Task for Trials<'_, C, S> {
    type Record = TreeRecord<C>;
    type Summary = ComponentSummary;
    const NAME: &'static str = C::NAME;
    const SUMMARY: &'static str = C::SUMMARY;

    fn check(&self) -> Result<(), PlanError> {
        self.plan.check()
    }

    fn keys(&self) -> Vec<ComponentKey> {
        self.plan.keys(C::NAME)
    }

    fn compute(
        &self,
        key: &ComponentKey,
        stop: &AtomicBool,
        on_step: &mut dyn FnMut(),
    ) -> Result<Option<TreeRecord<C>>, StoreError> {
        let ComponentPlan { scenario, protocol, .. } = self.plan;
        let mut record =
            TreeRecord { key: key.clone(), never_built: None, trials: Vec::new(), task: PhantomData };
        let place = self.stage.take(C::NAME);
        let world = match scenario.world(key.seed, key.world, 0) {
            Ok(world) => world,
            Err(e) => {
                record.never_built = Some(e.to_string());
                return Ok(Some(record));
            }
        };
        let targets = C::targets(&world, &protocol.component, key.seed);
        // A stage that has failed moves no world; what comes of it is not kept.
        let Ok(mut simulated) = self.stage.enter(place, world) else { return Ok(None) };
        for target in targets {
            simulated.world_mut().reset();
            if self.stage.renew(&mut simulated).is_err() {
                return Ok(None);
            }
            let Some(mut controller) = scenario.controller_with_goal(&C::goal(&target)) else {
                unreachable!("the plan was checked")
            };
            match run_trial::<C>(&mut simulated, &mut *controller, &target, protocol, stop, on_step) {
                Some(trial) if self.stage.failed().is_none() => record.trials.push(trial),
                _ => return Ok(None),
            }
        }
        Ok(Some(record))
    }

    fn steps(&self, record: &TreeRecord<C>) -> u64 {
        let frame = self.frame();
        record.trials.iter().map(|trial| (trial.duration_s / frame).round() as u64).sum()
    }

    fn frame(&self) -> f64 {
        self.plan.scenario.spec().sim.frame()
    }

    fn at_once(&self, threads: usize) -> usize {
        self.stage.at_once(threads)
    }

    fn sum_up(&self, records: &[TreeRecord<C>]) -> ComponentSummary {
        ComponentSummary::of_run(self.plan, records)
    }
}
