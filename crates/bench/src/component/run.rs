//! Runs every tree of a plan, in parallel, into a result folder.

use std::marker::PhantomData;
use std::sync::atomic::AtomicBool;

use orchard_world::World;

use super::summary::ComponentSummary;
use super::trial::run_trial;
use super::{Component, ComponentKey, ComponentPlan, TreeRecord};
use crate::store::{Store, StoreError};
use crate::task::{Progress, RunError, Task, run_task};

/// A finished run.
#[derive(Debug, Clone, PartialEq)]
pub struct ComponentResult<C: Component> {
    /// What was written beside the folder of records.
    pub summary: ComponentSummary,
    /// The records, in the order of [`ComponentPlan::keys`].
    pub trees: Vec<TreeRecord<C>>,
}

/// Runs a plan on `threads` threads and writes a record a tree and the summary.
///
/// # Errors
/// The plan is unusable, the folder holds another one's records, a file cannot be written, or `stop` was raised.
pub fn run<C: Component>(
    plan: &ComponentPlan,
    store: &Store,
    threads: usize,
    stop: &AtomicBool,
    progress: &impl Progress<TreeRecord<C>>,
) -> Result<ComponentResult<C>, RunError> {
    plan.check()?;
    let task = Trials { plan, task: PhantomData::<C> };
    let done = run_task(&task, store, threads, stop, progress)?;
    let trees: Vec<TreeRecord<C>> = done.into_iter().map(|(record, _)| record).collect();
    let summary = ComponentSummary::of_run(plan, &trees);
    store.write(C::SUMMARY, &summary)?;
    Ok(ComponentResult { summary, trees })
}

struct Trials<'a, C> {
    plan: &'a ComponentPlan,
    task: PhantomData<C>,
}

impl<C: Component> Task for Trials<'_, C> {
    type Record = TreeRecord<C>;
    const RESULTS: &'static [&'static str] = &[C::SUMMARY];

    fn keys(&self) -> Vec<ComponentKey> {
        self.plan.keys(C::NAME)
    }

    fn compute(
        &self,
        key: &ComponentKey,
        stop: &AtomicBool,
        on_step: &mut dyn FnMut(),
    ) -> Result<Option<TreeRecord<C>>, StoreError> {
        let ComponentPlan { spec, robot, detector, controller, protocol, .. } = self.plan;
        let mut record =
            TreeRecord { key: key.clone(), never_built: None, trials: Vec::new(), task: PhantomData };
        let mut world = match World::new(spec.clone(), robot.clone(), key.seed, key.world) {
            Ok(world) => world,
            Err(e) => {
                record.never_built = Some(e.to_string());
                return Ok(Some(record));
            }
        };
        for target in C::targets(&world, &protocol.component, key.seed) {
            world.reset();
            let mut controller = controller.with_goal(&C::goal(&target), robot, detector.clone());
            match run_trial::<C>(&mut world, &mut *controller, &target, protocol, stop, on_step) {
                Some(trial) => record.trials.push(trial),
                None => return Ok(None),
            }
        }
        Ok(Some(record))
    }
}
