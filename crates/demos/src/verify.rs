//! Reads demonstrations back and simulates every episode again.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use orchard_bench::record::Record;
use orchard_bench::store::{Store, StoreError, Stored};
use orchard_env::TaskEnv;
use orchard_picker::ControllerKind;
use orchard_tasks::plan_file::Backend;
use rayon::prelude::*;

use crate::episode::{self, begin};
use crate::meta::{Meta, MetaError};
use crate::plan::Plan;
use crate::record::{DemoKey, DemoRecord, Demonstration};
use crate::run::read_files;
use crate::steps::{stored_commands, stored_steps};
use crate::take::{Playback, Played};

/// Result of a verification.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Verdict {
    /// Episodes that were simulated again.
    pub episodes: u32,
    /// Episodes that are not as they were written, or that come out otherwise, each with the first problem.
    pub problems: Vec<String>,
}

/// A folder that cannot be verified.
#[derive(Debug, thiserror::Error)]
pub enum VerifyError {
    /// `meta.json` cannot be used.
    #[error(transparent)]
    Meta(#[from] MetaError),
    /// The folder cannot be opened.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The threads cannot be started.
    #[error("cannot start threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// The stop flag was raised.
    #[error("interrupted")]
    Interrupted,
}

/// Reads every episode of a folder and simulates it again: under the stored commands, or by the stored actions where these moved the robot.
/// Observations, images, rewards, ends and the last state must come out with the same bytes. `on_episode` is called after each. Episodes that moved on a graphics device are only read: no processor has their bits.
///
/// # Errors
/// The folder's `meta.json` cannot be used here, or `stop` was raised.
pub fn verify(
    root: &Path,
    controllers: &[Arc<dyn ControllerKind>],
    threads: usize,
    stop: &AtomicBool,
    on_episode: &(dyn Fn() + Sync),
) -> Result<Verdict, VerifyError> {
    let plan = Meta::read(root)?.plan(controllers, &root.display().to_string())?;
    let store = Store::open(root)?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    let keys = plan.keys();
    let one = |key: &DemoKey| {
        let found = again(&plan, &store, key, stop);
        on_episode();
        found.map_err(|problem| format!("{}: {problem}", DemoRecord::path(key)))
    };
    let found: Vec<Result<(), String>> = pool.install(|| keys.par_iter().with_max_len(1).map(one).collect());
    if stop.load(Ordering::Relaxed) {
        return Err(VerifyError::Interrupted);
    }
    let problems = found.into_iter().filter_map(Result::err).collect();
    Ok(Verdict { episodes: keys.len() as u32, problems })
}

/// Simulates an episode again; the error is the first problem.
fn again(plan: &Plan, store: &Store, key: &DemoKey, stop: &AtomicBool) -> Result<(), String> {
    let record = match store.stored::<DemoRecord>(key) {
        Stored::Whole(record) => *record,
        Stored::Missing => return Err("is missing".to_owned()),
        Stored::Other => return Err("is of other demonstrations".to_owned()),
        Stored::Damaged => return Err("is damaged or was edited".to_owned()),
    };
    if plan.backend() != Backend::Cpu {
        return record.demonstration.map_or(Ok(()), |demo| read_files(store.path(), &demo).map(|_| ()));
    }
    let begun = begin(plan, key, None);
    let (mut env, demo) = match (begun, record.demonstration) {
        (Ok(env), Some(demo)) => (env, demo),
        (Err(e), None) if record.never_began == Some(e.to_string()) => return Ok(()),
        (Err(e), _) => return Err(e.to_string()),
        (Ok(_), None) => return Err("has no episode, but its world can be built".to_owned()),
    };
    let [steps, commands] = read_files(store.path(), &demo)?;
    let stored = stored_steps(&steps).map_err(|e| e.to_string())?;
    let played = stored_commands(&commands).map_err(|e| e.to_string())?;
    let played = Played { steps: stored, commands: played };
    let mut playback = Playback::new(plan.via, played, plan.is_driven());
    let mut take = |env: &mut TaskEnv| playback.step(env);
    let mut none = |_: &str, _: &[u8]| Ok(());
    let episode = episode::run(plan, key, &mut env, &mut take, &mut none, stop, &mut || ());
    let Some(episode) = episode.map_err(|e| e.to_string())? else { return Ok(()) };
    for (name, stored, now) in [("steps", &steps, &episode.steps), ("commands", &commands, &episode.commands)]
    {
        if let Some(difference) = stored.difference(now) {
            return Err(format!("{name}: {difference}"));
        }
    }
    let (now, _) = episode.files(key).map_err(|e| e.to_string())?;
    difference(&demo, &now).map_or(Ok(()), Err)
}

/// The first difference of a record from the one that was computed again.
fn difference(stored: &Demonstration, now: &Demonstration) -> Option<String> {
    let parts = [
        (stored.images == now.images, "its images differ"),
        (stored.end_state_sha256 == now.end_state_sha256, "the state at its end differs"),
        (stored == now, "its record differs"),
    ];
    parts.into_iter().find_map(|(same, problem)| (!same).then(|| problem.to_owned()))
}
