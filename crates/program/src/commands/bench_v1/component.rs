//! The component tasks: one skill at a time.

use std::marker::PhantomData;
use std::sync::Arc;

use orchard_bench::store::Store;
use orchard_scenario::Scenario;
use orchard_tasks::component::{Component, ComponentPlan, ComponentSummary, TreeRecord, Trials, metrics};
use orchard_tasks::plan_file::{Backend, TreeExtent};
use orchard_tasks::stage::{Processor, Stage};

use super::bar::RecordProgress;
use super::task::{AnyTask, PresentedTask, lost_device};
use super::way::Way;
use super::{counts, tell_faults};
use crate::failure::Failure;
use crate::headline::fine_table;

/// The trials of a component task under a controller, with worlds that a stage computes.
struct ComponentJob<C, S> {
    plan: ComponentPlan,
    stage: Arc<S>,
    /// Says where frames were computed.
    say_where: fn(&S),
    task: PhantomData<C>,
}

/// Plans the trials of a task; `way` is none if they are not run.
pub fn trials<C: Component>(
    scenario: &Scenario,
    trees: &TreeExtent,
    backend: Backend,
    way: Option<Way>,
) -> Result<Box<dyn AnyTask>, Failure> {
    let plan = ComponentPlan::new(scenario.clone(), &trees.profile, trees.seeds.clone(), trees.trees)?;
    let plan = ComponentPlan { backend, ..plan };
    plan.check()?;
    match way {
        Some(way) if backend == Backend::Gpu => on_device(plan, way, PhantomData::<C>),
        _ => Ok(Box::new(ComponentJob::<C, _> {
            plan,
            stage: Arc::new(Processor),
            say_where: |_| (),
            task: PhantomData,
        })),
    }
}

#[cfg(feature = "gpu")]
fn on_device<C: Component>(
    plan: ComponentPlan,
    way: Way,
    task: PhantomData<C>,
) -> Result<Box<dyn AnyTask>, Failure> {
    use super::together::{LANES, open_berths, say_where};

    let episodes = plan.keys(C::NAME).len();
    let share = orchard_lockstep::Share { condition: C::NAME, scenario: &plan.scenario, episodes };
    let lanes = way.lanes.unwrap_or(LANES).min(episodes);
    let stage = open_berths(C::NAME, &[share], lanes, way.threads)?;
    Ok(Box::new(ComponentJob { plan, stage, say_where: |berths| say_where(berths), task }))
}

#[cfg(not(feature = "gpu"))]
fn on_device<C: Component>(_: ComponentPlan, _: Way, _: PhantomData<C>) -> Result<Box<dyn AnyTask>, Failure> {
    Err(Failure::BadInput("--backend gpu: this program was built without the feature `gpu`".to_owned()))
}

impl<C: Component, S: Stage> PresentedTask for ComponentJob<C, S> {
    type Record = TreeRecord<C>;
    type Summary = ComponentSummary;
    type Task<'a>
        = Trials<'a, C, S>
    where
        S: 'a;

    fn task(&self) -> Trials<'_, C, S> {
        Trials::of(&self.plan, &*self.stage)
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
        (self.say_where)(&self.stage);
        Ok(())
    }

    fn failed(&self) -> Option<String> {
        self.stage.failed().map(|why| lost_device(&why))
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
