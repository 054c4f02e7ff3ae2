//! Verifies a submitted result.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use orchard_bench::digest::{FilesDigest, hex};
use orchard_bench::gather;
use orchard_bench::record::Record;
use orchard_bench::store::{Store, encode};
use orchard_bench::task::{Progress, Task};
use orchard_bench::{CODE_VERSION, SCHEMA_VERSION};
use orchard_tasks::harvest::episode::{EpisodeKey, EpisodeRecord};
use orchard_tasks::harvest::observe::NoObservers;
use orchard_tasks::harvest::plan::Plan;
use orchard_tasks::harvest::summary::Summary;
use orchard_tasks::harvest::{Episodes, WorldFactory};
use orchard_tasks::seeds::{SeedSetLabel, SeedSetName};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::consistency::contradiction;
use crate::difference::{Difference, first_difference};
use crate::refusal::Refusal;
use crate::sample::drawn;

/// File of the summary in a result folder.
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
    /// The set that the seeds belong to.
    pub seed_set: SeedSetLabel,
    /// Seeds.
    pub seeds: Vec<u64>,
}

/// A result that was verified.
#[derive(Debug, Clone, PartialEq)]
pub struct Verified {
    /// Summary.
    pub summary: Summary,
    /// SHA-256 over the names and bytes of all record files.
    pub records_sha256: String,
    /// Episodes that were run again and had the same bytes.
    pub sample: Vec<String>,
}

/// Reads the summary head of a result folder.
///
/// # Errors
/// The summary is missing, has another layout, or cannot be parsed.
pub fn head(folder: &Path) -> Result<Head, Refusal> {
    let file = folder.join(SUMMARY);
    let not = |problem: String| Refusal::NotAResult { file: file.display().to_string(), problem };
    let bytes = fs::read(&file).map_err(|e| not(e.to_string()))?;
    let value: Value = serde_json::from_slice(&bytes).map_err(|e| not(e.to_string()))?;
    let schema = value.get("schema_version").ok_or_else(|| not("it has no schema_version".to_owned()))?;
    version("schema_version", schema, &SCHEMA_VERSION)?;
    serde_json::from_value(value).map_err(|e| not(e.to_string()))
}

/// Verifies the result in a folder against the official plan: versions, seeds, completeness, summary, records, and `sample`
/// episodes that are run again on `threads` threads.
///
/// # Errors
/// The first failed check.
pub fn verify<F: WorldFactory>(
    folder: &Path,
    plan: &Plan,
    factory: &F,
    sample: usize,
    threads: usize,
    stop: &AtomicBool,
    progress: &impl Progress<EpisodeRecord>,
) -> Result<Verified, Refusal> {
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
    }
    let hash = digest.finish();
    let sample: Vec<&EpisodeRecord> =
        drawn(&hash, records.len(), sample).into_iter().map(|index| &records[index]).collect();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    let task = Episodes::unwatched(plan, factory);
    pool.install(|| {
        sample.par_iter().with_max_len(1).try_for_each(|record| repeat(&task, record, stop, progress))
    })?;
    let sample = sample.iter().map(|record| EpisodeRecord::path(&record.key)).collect();
    Ok(Verified { summary, records_sha256: hex(&hash), sample })
}

/// Checks that versions, seeds, controller and profile equal those of the plan.
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
    let name = match label.name {
        SeedSetName::Tuning => "tuning",
        SeedSetName::V1 => "v1",
        SeedSetName::Custom => "custom",
    };
    if label.whole { name.to_owned() } else { format!("{name} (in part)") }
}

/// Checks that the folder holds all records of the matrix and no others.
fn collected(store: &Store, keys: &[EpisodeKey]) -> Result<Vec<EpisodeRecord>, Refusal> {
    let records = gather::<EpisodeRecord>(keys, &[store])?;
    let own: BTreeSet<String> = keys.iter().map(EpisodeRecord::path).collect();
    match store.files(EpisodeRecord::FOLDER).into_iter().find(|file| !own.contains(file)) {
        Some(file) => Err(Refusal::Surplus { file }),
        None => Ok(records),
    }
}

/// Checks that the summary file equals, byte by byte, the summary of the records.
fn check_summary(folder: &Path, summary: &Summary) -> Result<(), Refusal> {
    let file = folder.join(SUMMARY);
    let found = fs::read(&file)
        .map_err(|e| Refusal::NotAResult { file: file.display().to_string(), problem: e.to_string() })?;
    let own = bytes(SUMMARY, summary)?;
    if found == own { Ok(()) } else { Err(Refusal::Summary { difference: difference(&found, &own) }) }
}

/// Runs an episode again and compares bytes.
fn repeat<F: WorldFactory>(
    task: &Episodes<'_, F, NoObservers>,
    record: &EpisodeRecord,
    stop: &AtomicBool,
    progress: &impl Progress<EpisodeRecord>,
) -> Result<(), Refusal> {
    let file = EpisodeRecord::path(&record.key);
    let again = task.compute(&record.key, stop, &mut || progress.step());
    let again = again.map_err(|e| Refusal::NotAResult { file: file.clone(), problem: e.to_string() })?;
    let Some(again) = again else { return Err(Refusal::Interrupted) };
    let (found, own) = (bytes(&file, record)?, bytes(&file, &again)?);
    if found != own {
        return Err(Refusal::NotRepeated { file, difference: difference(&found, &own) });
    }
    progress.record(&again, false);
    Ok(())
}

fn bytes(file: &str, value: &impl Serialize) -> Result<Vec<u8>, Refusal> {
    encode(value).map_err(|e| Refusal::NotAResult { file: file.to_owned(), problem: e.to_string() })
}

/// The first field in which two JSON files differ; if there is none, the difference is in the formatting.
fn difference(found: &[u8], own: &[u8]) -> Difference {
    let value = |bytes| serde_json::from_slice::<Value>(bytes).unwrap_or_default();
    first_difference(&value(found), &value(own)).unwrap_or_else(|| Difference {
        field: String::new(),
        found: "formatted differently".to_owned(),
        expected: "as this code writes it".to_owned(),
    })
}
