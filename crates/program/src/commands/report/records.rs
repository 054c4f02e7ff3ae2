//! Checksums of the records behind the summaries of a result folder, and of their command logs.

use std::path::{Component, Path};

use orchard_bench::checksum::checked;
use orchard_report::Results;
use orchard_tasks::harvest::command_log;
use orchard_tasks::harvest::episode::EpisodeRecord;
use rayon::prelude::*;

/// Checks every record that a summary lists and that is there. The error names the file and the problem.
pub fn check(dir: &Path, results: &Results) -> Result<(), String> {
    let harvest = results.harvest.iter().flat_map(|summary| summary.conditions.values());
    let episodes: Vec<&str> = harvest.flat_map(|c| &c.episodes).map(|line| line.file.as_str()).collect();
    let detect = results.detect.iter().flat_map(|summary| &summary.trees).map(|tree| tree.file.as_str());
    let trials = results.components.iter().flat_map(|summary| &summary.trees).map(|tree| tree.file.as_str());
    let others: Vec<&str> = detect.chain(trials).collect();
    others.par_iter().try_for_each(|file| content(dir, file).map(drop))?;
    episodes.par_iter().try_for_each(|file| {
        let Some(content) = content(dir, file)? else { return Ok(()) };
        // Records of other code may have other fields; their checksum is all that can be checked.
        let Ok(record) = serde_json::from_slice::<EpisodeRecord>(&content) else { return Ok(()) };
        command_log::check(dir, &record).map(drop).map_err(|e| e.to_string())
    })
}

/// A record's content, if its file is there; its checksum is right.
fn content(dir: &Path, file: &str) -> Result<Option<Vec<u8>>, String> {
    if !Path::new(file).components().all(|part| matches!(part, Component::Normal(_))) {
        return Err(format!(
            "{}: a summary lists {file:?}, which is no file under the folder",
            dir.display()
        ));
    }
    let path = dir.join(file);
    let bytes = match orchard_input::bytes(&path, orchard_input::RESULT) {
        Ok(bytes) => bytes,
        Err(e) if e.is_missing() => return Ok(None),
        Err(e) => return Err(format!("{}: {e}", path.display())),
    };
    checked(&bytes).map(Some).map_err(|damage| format!("{}: {damage}", path.display()))
}
