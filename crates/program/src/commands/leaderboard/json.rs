//! The board in order, as JSON for scripts.

use orchard_leaderboard::{Board, Budget, Entry, ranking};
use orchard_scenario::SceneNames;
use orchard_tasks::seeds::SeedSetName;
use serde::Serialize;

use crate::failure::Failure;

#[derive(Serialize)]
struct ShownBoard<'a> {
    schema_version: u32,
    config_version: &'a str,
    seed_set: SeedSetName,
    scene: &'a SceneNames,
    entries: Vec<RankedEntry<'a>>,
}

#[derive(Serialize)]
struct RankedEntry<'a> {
    /// Place in its class from 1; null over budget.
    place: Option<u32>,
    on_front: bool,
    #[serde(flatten)]
    entry: &'a Entry,
}

/// Returns the board in order, under each entry's own budget or one for all.
///
/// # Errors
/// The board does not encode.
pub fn text(board: &Board, budget: Option<&Budget>) -> Result<String, Failure> {
    let ranked = ranking(&board.entries, budget).into_iter();
    let shown = ShownBoard {
        schema_version: board.schema_version,
        config_version: &board.config_version,
        seed_set: board.seed_set,
        scene: &board.scene,
        entries: ranked
            .map(|r| RankedEntry { place: r.place, on_front: r.on_front, entry: r.entry })
            .collect(),
    };
    serde_json::to_string_pretty(&shown).map_err(|e| Failure::Failed(e.to_string()))
}
