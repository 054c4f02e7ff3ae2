//! Test fixture: a task of small records.

use std::sync::atomic::AtomicBool;

use serde::Serialize;

use crate::check::PlanError;
use crate::fake::{Sum, SumKey};
use crate::store::StoreError;
use crate::task::Task;

/// A task that adds seeds and worlds.
pub struct Sums(pub Vec<SumKey>);

/// Summary of [`Sums`].
#[derive(Debug, PartialEq, Serialize)]
pub struct Total {
    pub total: u64,
}

impl Task for Sums {
    type Record = Sum;
    type Summary = Total;
    const NAME: &'static str = "sums";
    const SUMMARY: &'static str = "sums.json";

    fn check(&self) -> Result<(), PlanError> {
        Ok(())
    }

    fn keys(&self) -> Vec<SumKey> {
        self.0.clone()
    }

    fn compute(
        &self,
        key: &SumKey,
        _: &AtomicBool,
        on_step: &mut dyn FnMut(),
    ) -> Result<Option<Sum>, StoreError> {
        on_step();
        Ok(Some(Sum { sum: key.seed + u64::from(key.world), key: key.clone() }))
    }

    fn steps(&self, _: &Sum) -> u64 {
        1
    }

    fn frame(&self) -> f64 {
        0.0
    }

    fn sum_up(&self, records: &[Sum]) -> Total {
        Total { total: records.iter().map(|record| record.sum).sum() }
    }
}
