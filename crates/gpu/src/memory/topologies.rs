//! Schedules of many worlds.

use std::collections::BTreeMap;
use std::sync::Arc;

use orchard_batch::{Plant, TreeWorld};
use rayon::prelude::*;

use crate::BatchError;
use crate::laws::Laws;
use crate::schedule::{Schedule, ScheduleError, parts};

/// Schedule of each world under the laws of the batch. The parts of a topology are computed once, and worlds with fruit on the same links share a schedule.
///
/// # Errors
/// A world has no schedule.
pub(super) fn schedules(given: &[TreeWorld], laws: Laws) -> Result<Vec<Arc<Schedule>>, BatchError> {
    let plants: Vec<&Plant> = given.iter().map(|world| &**world.plant()).collect();
    let (firsts, topology_of) = distinct(plants.iter().map(|plant| &plant.tree.parent));
    let parts_of = each(&firsts, |index| parts(&plants[index].tree.parent, laws.team()))?;
    let bearers = plants.iter().map(|plant| plant.fruit.fruit.iter().map(|fruit| fruit.segment));
    let (firsts, kind_of) =
        distinct(topology_of.iter().zip(bearers).map(|(topology, on)| (*topology, on.collect::<Vec<_>>())));
    let schedules = each(&firsts, |index| {
        let plant = plants[index];
        let mut fruit_of = vec![Vec::new(); plant.tree.len()];
        plant.fruit.fruit.iter().enumerate().for_each(|(i, fruit)| fruit_of[fruit.segment].push(i));
        Schedule::new(&plant.tree.parent, &parts_of[topology_of[index]], &fruit_of).map(Arc::new)
    })?;
    Ok(kind_of.into_iter().map(|kind| schedules[kind].clone()).collect())
}

/// Computes a value for each of some worlds in parallel; the first failure is the error.
fn each<T: Send>(
    worlds: &[usize],
    of: impl Fn(usize) -> Result<T, ScheduleError> + Sync,
) -> Result<Vec<T>, BatchError> {
    let all: Vec<Result<T, BatchError>> = worlds
        .par_iter()
        .map(|&world| of(world).map_err(|why| BatchError::Schedule { world, why }))
        .collect();
    all.into_iter().collect()
}

/// Indices of the first occurrence of each distinct key, and for each key the index of its first occurrence among them.
fn distinct<K: Ord>(keys: impl Iterator<Item = K>) -> (Vec<usize>, Vec<usize>) {
    let (mut known, mut firsts) = (BTreeMap::new(), Vec::new());
    let of_each = keys.enumerate().map(|(index, key)| {
        *known.entry(key).or_insert_with(|| {
            firsts.push(index);
            firsts.len() - 1
        })
    });
    let of_each = of_each.collect();
    (firsts, of_each)
}
