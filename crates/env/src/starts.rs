//! Starts of episodes: the world in which each begins, and a pool of worlds in which many begin.

use std::collections::BTreeSet;
use std::sync::OnceLock;

use orchard_policy::SettingError;
use rayon::prelude::*;

use crate::error::EnvError;
use crate::settings::{Pool, WORLDS};

/// Way from the tree of an episode to that of the next one in a pool: the ten thousandth prime, our own choice. A pool is smaller, so it shares no factor with the number of trees, and an environment sees all of them before it sees one again.
const STRIDE: u64 = 104_729;

/// Starts of episodes, of which those of a pool are kept.
pub(crate) struct Starts<T> {
    pool: Option<Pool>,
    /// One a world of the pool.
    kept: Vec<OnceLock<T>>,
}

impl<T: Clone + Send + Sync> Starts<T> {
    /// Makes the starts, none of them kept yet.
    pub fn new(pool: Option<Pool>) -> Result<Self, SettingError> {
        let trees = pool.map_or(0, |pool| pool.trees);
        if pool.is_some() && !(1..=WORLDS).contains(&trees) {
            let problem = format!("there are from 1 to {WORLDS} trees in a pool");
            return Err(SettingError { option: "trees", value: trees.to_string(), problem });
        }
        Ok(Self { pool, kept: (0..trees).map(|_| OnceLock::new()).collect() })
    }

    /// Seed and index of the world of an episode of a seed, in the environment whose first world is `first`.
    pub fn world_of(&self, seed: u64, first: u32, number: u32) -> (u64, u32) {
        let Some(pool) = self.pool else {
            let rounds = number / WORLDS;
            return (seed.wrapping_add(u64::from(rounds)), first + (number % WORLDS) * WORLDS);
        };
        let trees = u64::from(pool.trees);
        let at = seed % trees + u64::from(first) + u64::from(number) * STRIDE;
        (pool.seed, (at % trees) as u32)
    }

    /// The start in a world, which is made unless it is kept.
    pub fn of(&self, world: u32, make: impl FnOnce() -> Result<T, EnvError>) -> Result<T, EnvError> {
        let Some(kept) = self.kept.get(world as usize) else { return make() };
        match kept.get() {
            Some(start) => Ok(start.clone()),
            // Two threads may make the same start; its bits are the same. A lock could wait for itself: a thread that makes a start may begin another one meanwhile.
            None => make().map(|start| kept.get_or_init(|| start).clone()),
        }
    }

    /// Makes those of some worlds of the pool that are not kept yet, each once. One that cannot be made is left to who asks for it.
    pub fn prepare(
        &self,
        worlds: impl Iterator<Item = u32>,
        make: impl Fn(u32) -> Result<T, EnvError> + Sync,
    ) {
        let due: BTreeSet<u32> = worlds
            .filter(|&world| self.kept.get(world as usize).is_some_and(|kept| kept.get().is_none()))
            .collect();
        due.into_par_iter().for_each(|world| drop(self.of(world, || make(world))));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pool_gives_each_environment_all_its_trees_and_no_two_the_same() {
        for trees in [1, 2, 7, 100, 1024, 40_000] {
            let starts = Starts::<()>::new(Some(Pool { trees, seed: 5 })).unwrap();
            let of_episodes: BTreeSet<_> = (0..trees).map(|number| starts.world_of(9, 3, number)).collect();
            let of_envs: BTreeSet<_> = (0..trees).map(|first| starts.world_of(9, first, 77)).collect();
            let all: BTreeSet<_> = (0..trees).map(|world| (5, world)).collect();
            assert!(of_episodes == all && of_envs == all, "{trees}");
        }
    }

    #[test]
    fn a_start_is_made_once() {
        let starts = Starts::new(Some(Pool { trees: 3, seed: 0 })).unwrap();
        let failed = || EnvError::NotStarted { env: 0 };
        starts.prepare([2, 2, 1].into_iter(), |world| if world == 2 { Ok(world) } else { Err(failed()) });
        assert_eq!(starts.of(2, || Ok(7)).unwrap(), 2);
        assert!(starts.of(1, || Err(failed())).is_err());
        assert_eq!((starts.of(1, || Ok(8)).unwrap(), starts.of(1, || Ok(9)).unwrap()), (8, 8));
        // Without a pool nothing is kept.
        let starts = Starts::new(None).unwrap();
        assert_eq!((starts.of(1, || Ok(8)).unwrap(), starts.of(1, || Ok(9)).unwrap()), (8, 9));
    }

    #[test]
    fn a_pool_has_trees() {
        let said = |trees| Starts::<()>::new(Some(Pool { trees, seed: 0 })).err().map(|e| e.to_string());
        assert_eq!(said(0).unwrap(), "trees 0: there are from 1 to 65536 trees in a pool");
        assert!(said(65_537).is_some() && said(65_536).is_none());
    }
}
