//! Verifies a submitted result: its files, its trees, its episodes.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use orchard_bench::checksum::FIELD;
use orchard_bench::digest::{FilesDigest, hex};
use orchard_bench::record::Record;
use orchard_bench::store::{Store, StoreError, Stored, encode};
use orchard_bench::task::{Progress, RunError, Session, Task, run_task};
use orchard_bench::{CODE_VERSION, PlanError, SCHEMA_VERSION, gather};
use orchard_tasks::harvest::command_log::{self, path_of};
use orchard_tasks::harvest::episode::{EpisodeKey, EpisodeRecord};
use orchard_tasks::harvest::observe::NoObservers;
use orchard_tasks::harvest::plan::Plan;
use orchard_tasks::harvest::replays::Replays;
use orchard_tasks::harvest::summary::Summary;
use orchard_tasks::harvest::{Episodes, WorldFactory, census, never_started};
use orchard_tasks::plan_file::Backend;
use orchard_tasks::seeds::SeedSetLabel;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::consistency::contradiction;
use crate::difference::{Difference, first_difference};
use crate::refusal::Refusal;

/// File that identifies a result.
const SUMMARY: &str = "summary.json";

/// Fields of a summary that identify its run.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Head {
    /// Layout version.
    pub schema_version: u32,
    /// Code version.
    pub code_version: String,
    /// Version of protocol and configs.
    pub config_version: String,
    /// SHA-256 of all config texts.
    pub config_hash: String,
    /// Profile.
    pub profile: String,
    /// Controller that harvested.
    pub controller: String,
    /// Backend that moved the worlds.
    #[serde(default)]
    pub backend: Backend,
    /// The set that the seeds belong to.
    pub seed_set: SeedSetLabel,
    /// Seeds.
    pub seeds: Vec<u64>,
}

/// Reads the summary head of a result folder.
///
/// # Errors
/// There is no summary, or the file has another layout or is not a summary.
pub fn head(folder: &Path) -> Result<Head, Refusal> {
    let file = folder.join(SUMMARY);
    let not = |problem: String| Refusal::NotAResult { file: file.display().to_string(), problem };
    let bytes = orchard_input::bytes(&file, orchard_input::RESULT).map_err(|e| not(e.to_string()))?;
    let value: Value = serde_json::from_slice(&bytes).map_err(|e| not(e.to_string()))?;
    let schema = value.get("schema_version").ok_or_else(|| not("it has no schema_version".to_owned()))?;
    version("schema_version", schema, &SCHEMA_VERSION)?;
    serde_json::from_value(value).map_err(|e| not(e.to_string()))
}

/// A result whose files agree with the official plan and with each other.
#[derive(Debug, Clone, PartialEq)]
pub struct Submission {
    folder: PathBuf,
    /// Summary.
    pub summary: Summary,
    /// Records of all episodes, in the order of the plan.
    pub records: Vec<EpisodeRecord>,
    /// SHA-256 over the names and bytes of all record files.
    pub records_sha256: String,
}

impl Submission {
    /// Reads the result in a folder and checks it against the official plan: versions, seeds, completeness, summary, records, and the
    /// SHA-256 of command logs. Nothing is simulated.
    ///
    /// # Errors
    /// The first problem.
    pub fn read(folder: &Path, plan: &Plan) -> Result<Self, Refusal> {
        check_head(&head(folder)?, plan)?;
        let keys = plan.episodes();
        let store = Store::open(folder)?;
        let records = collected(&store, &keys)?;
        let mut digest = FilesDigest::default();
        for record in &records {
            let file = EpisodeRecord::path(&record.key);
            digest.add(&file, &bytes(&file, record)?);
        }
        let summary = Summary::of_run(plan, &records);
        check_summary(folder, &summary)?;
        for record in &records {
            if let Some(problem) = contradiction(record, plan.frame) {
                return Err(Refusal::Contradiction { file: EpisodeRecord::path(&record.key), problem });
            }
            command_log::check(folder, record)?;
        }
        let folder = folder.to_owned();
        Ok(Self { folder, summary, records, records_sha256: hex(&digest.finish()) })
    }

    /// True if there is a command log for every episode whose world was built.
    pub fn has_commands(&self) -> bool {
        let mut ran = self.records.iter().filter(|record| record.frames > 0);
        ran.all(|record| self.folder.join(path_of(&record.key)).is_file())
    }

    /// Worlds that play the submitted commands back.
    pub fn replays<'a, F>(&'a self, factory: &'a F) -> Replays<'a, F> {
        Replays::new(factory, &self.folder)
    }

    /// Grows every tree of the plan and compares fruit, reach and zones with the records.
    ///
    /// # Errors
    /// A record of another tree, threads that cannot be started, or `stop` was raised.
    pub fn check_trees<F: WorldFactory>(
        &self,
        plan: &Plan,
        factory: &F,
        threads: usize,
        stop: &AtomicBool,
        progress: &impl Progress<EpisodeRecord>,
    ) -> Result<(), Refusal> {
        // Repeats differ only in the robot's start pose.
        let first = self.records.iter().filter(|record| record.key.repeat == 0).collect::<Vec<_>>();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
        let found: Vec<Result<(), Refusal>> = pool.install(|| {
            let check = |record: &&EpisodeRecord| {
                if stop.load(Ordering::Relaxed) {
                    return Err(Refusal::Interrupted);
                }
                let tree = tree_of(&record.key, plan, factory);
                progress.record(record, false);
                let of_tree = |other: &&EpisodeRecord| {
                    let [a, b] = [&other.key, &record.key].map(|key| (&key.condition, key.seed, key.world));
                    a == b
                };
                self.records.iter().filter(of_tree).try_for_each(|record| same_tree(record, &tree))
            };
            first.par_iter().with_max_len(1).map(check).collect()
        });
        found.into_iter().collect()
    }

    /// Runs chosen episodes again, by index, and compares every byte of their records. Finished episodes are kept in the session's
    /// folder, so that an interrupted check resumes.
    ///
    /// # Errors
    /// An episode with other bytes, a file that cannot be written, or the session was stopped.
    pub fn repeat<F: WorldFactory>(
        &self,
        plan: &Plan,
        factory: &F,
        chosen: &[usize],
        session: &Session<'_>,
        progress: &impl Progress<EpisodeRecord>,
    ) -> Result<(), Refusal> {
        let submitted: Vec<&EpisodeRecord> = chosen.iter().map(|&index| &self.records[index]).collect();
        let episodes = Episodes::unwatched(plan, factory);
        let task = Repetition { episodes, submitted: &submitted, differs: AtomicBool::new(false) };
        let result = run_task(&task, session, progress);
        let records = match result {
            Ok(result) => result.records,
            // One that differs ends the run; it is found among the stored ones.
            Err(RunError::Interrupted { .. }) if task.differs.load(Ordering::Relaxed) => {
                let stored = |record: &&EpisodeRecord| match session.store.stored(&record.key) {
                    Stored::Whole(again) => Some(*again),
                    _ => None,
                };
                submitted.iter().filter_map(stored).collect()
            }
            Err(RunError::Interrupted { .. }) => return Err(Refusal::Interrupted),
            Err(e) => return Err(Refusal::Run(e)),
        };
        self.compare(&records)
    }

    /// Compares the records of another run, in any part of the matrix, with the submitted ones.
    ///
    /// # Errors
    /// The first record with other bytes.
    pub fn compare(&self, again: &[EpisodeRecord]) -> Result<(), Refusal> {
        for again in again {
            let Some(record) = self.records.iter().find(|record| record.key == again.key) else { continue };
            let file = EpisodeRecord::path(&record.key);
            let (found, own) = (bytes(&file, record)?, bytes(&file, again)?);
            if found != own {
                return Err(Refusal::NotRepeated { file, difference: difference(&found, &own) });
            }
        }
        Ok(())
    }
}

/// Episodes that are run again; the first that differs ends the run.
struct Repetition<'a, F> {
    episodes: Episodes<'a, F, NoObservers>,
    submitted: &'a [&'a EpisodeRecord],
    differs: AtomicBool,
}

/// Summary of episodes that were run again.
#[derive(Serialize)]
struct Repeated {
    episodes: usize,
}

impl<F: WorldFactory> Task for Repetition<'_, F> {
    type Record = EpisodeRecord;
    type Summary = Repeated;
    const NAME: &'static str = "repetition";
    const SUMMARY: &'static str = "repeated.json";

    fn check(&self) -> Result<(), PlanError> {
        self.episodes.check()
    }

    fn keys(&self) -> Vec<EpisodeKey> {
        self.submitted.iter().map(|record| record.key.clone()).collect()
    }

    fn compute(
        &self,
        key: &EpisodeKey,
        stop: &AtomicBool,
        on_step: &mut dyn FnMut(),
    ) -> Result<Option<EpisodeRecord>, StoreError> {
        if self.differs.load(Ordering::Relaxed) {
            return Ok(None);
        }
        let again = self.episodes.compute(key, stop, on_step)?;
        let submitted = self.submitted.iter().find(|record| record.key == *key);
        if again.as_ref().zip(submitted).is_some_and(|(again, submitted)| again != *submitted) {
            self.differs.store(true, Ordering::Relaxed);
        }
        Ok(again)
    }

    fn steps(&self, record: &EpisodeRecord) -> u64 {
        self.episodes.steps(record)
    }

    fn frame(&self) -> f64 {
        self.episodes.frame()
    }

    fn sum_up(&self, records: &[EpisodeRecord]) -> Repeated {
        Repeated { episodes: records.len() }
    }
}

/// The record of a tree before its first frame.
fn tree_of<F: WorldFactory>(key: &EpisodeKey, plan: &Plan, factory: &F) -> EpisodeRecord {
    match factory.build(key) {
        Ok((world, _)) => census(key.clone(), &world, &plan.protocol, plan.frame),
        Err(reason) => never_started(key.clone(), reason),
    }
}

/// Checks that a record is of a tree: its fruit, their reach, its zones.
fn same_tree(record: &EpisodeRecord, tree: &EpisodeRecord) -> Result<(), Refusal> {
    let mut own = record.clone();
    own.fruit_total = tree.fruit_total;
    own.reachable_count = tree.reachable_count;
    own.reachable.clone_from(&tree.reachable);
    own.reachable_ik_count = tree.reachable_ik_count;
    own.zone_frame.clone_from(&tree.zone_frame);
    own.zone_census.clone_from(&tree.zone_census);
    own.fruit.clone_from(&tree.fruit);
    for (fruit, submitted) in own.fruit.iter_mut().zip(&record.fruit) {
        fruit.final_state = submitted.final_state;
    }
    // A world that cannot be built has no episode, and no other world may claim that.
    if tree.fruit_total == 0 || record.fruit_total == 0 {
        own.outcome = tree.outcome.clone();
    }
    if own == *record {
        return Ok(());
    }
    let file = EpisodeRecord::path(&record.key);
    let difference = difference(&bytes(&file, record)?, &bytes(&file, &own)?);
    Err(Refusal::OtherTree { file, difference })
}

/// Versions, seeds, controller and profile are those of the plan.
fn check_head(head: &Head, plan: &Plan) -> Result<(), Refusal> {
    version("code_version", &head.code_version, &CODE_VERSION)?;
    version("config_version", &head.config_version, &plan.protocol.version)?;
    version("config_hash", &head.config_hash, &plan.config_hash)?;
    if head.seed_set != plan.seed_set || head.seeds != plan.seeds {
        let own = named(&plan.seed_set);
        let mut found = named(&head.seed_set);
        if found == own {
            found = format!("{found} with seeds {:?}", head.seeds);
        }
        return Err(Refusal::Seeds { found, own });
    }
    for (what, found, own) in [
        ("controller", &head.controller, &plan.scenario.controller),
        ("profile", &head.profile, &plan.profile),
        // A graphics device moves in f32: nobody could run its episodes again to the bit.
        ("backend", &head.backend.name().to_owned(), &plan.backend.name().to_owned()),
    ] {
        if found != own {
            return Err(Refusal::Plan { what, found: found.clone(), own: own.clone() });
        }
    }
    Ok(())
}

fn version(what: &'static str, found: &impl Serialize, own: &impl Serialize) -> Result<(), Refusal> {
    let text =
        |value: Result<Value, serde_json::Error>| value.map_or_else(|e| e.to_string(), |v| v.to_string());
    let (found, own) = (text(serde_json::to_value(found)), text(serde_json::to_value(own)));
    if found == own { Ok(()) } else { Err(Refusal::Version { file: SUMMARY.to_owned(), what, found, own }) }
}

/// A seed set in words.
fn named(label: &SeedSetLabel) -> String {
    let name = label.name.name();
    if label.whole { name.to_owned() } else { format!("{name} (in part)") }
}

/// All records of the matrix, and no other.
fn collected(store: &Store, keys: &[EpisodeKey]) -> Result<Vec<EpisodeRecord>, Refusal> {
    let records = gather::<EpisodeRecord>(keys, &[store])?;
    let own: BTreeSet<String> = keys.iter().map(EpisodeRecord::path).collect();
    match store.files(EpisodeRecord::FOLDER).into_iter().find(|file| !own.contains(file)) {
        Some(file) => Err(Refusal::Surplus { file }),
        None => Ok(records),
    }
}

/// The file of the summary is, byte by byte, what the records give.
fn check_summary(folder: &Path, summary: &Summary) -> Result<(), Refusal> {
    let file = folder.join(SUMMARY);
    let found = orchard_input::bytes(&file, orchard_input::RESULT)
        .map_err(|e| Refusal::NotAResult { file: file.display().to_string(), problem: e.to_string() })?;
    let own = bytes(SUMMARY, summary)?;
    if found == own { Ok(()) } else { Err(Refusal::Summary { difference: difference(&found, &own) }) }
}

fn bytes(file: &str, value: &impl Serialize) -> Result<Vec<u8>, Refusal> {
    encode(value).map_err(|e| Refusal::NotAResult { file: file.to_owned(), problem: e.to_string() })
}

/// The first field in which two JSON files differ; where there is none, their texts do.
fn difference(found: &[u8], own: &[u8]) -> Difference {
    // The checksums differ with any other field.
    let value = |bytes| {
        let mut value = serde_json::from_slice::<Value>(bytes).unwrap_or_default();
        if let Some(fields) = value.as_object_mut() {
            fields.remove(FIELD);
        }
        value
    };
    first_difference(&value(found), &value(own)).unwrap_or_else(|| Difference {
        field: String::new(),
        found: "written in another way".to_owned(),
        expected: "as this code writes it".to_owned(),
    })
}
