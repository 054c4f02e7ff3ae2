//! The board's file.

use orchard_bench::SCHEMA_VERSION;
use orchard_scenario::{Scenario, SceneNames};
use orchard_tasks::seeds::SeedSetName;
use serde::{Deserialize, Serialize};

use crate::entry::Entry;
use crate::rank::ranking;

/// A leaderboard: entries for one seed set and one version of the configs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Board {
    /// Layout version.
    pub schema_version: u32,
    /// Version of protocol and configs.
    pub config_version: String,
    /// The seed set of all entries.
    pub seed_set: SeedSetName,
    /// Names of the scene of all entries.
    pub scene: SceneNames,
    /// [`orchard_scenario::Scenario::scene_hash`].
    pub scene_hash: String,
    /// Entries, ranked under their own budgets.
    pub entries: Vec<Entry>,
}

/// A board that cannot be used, or an entry that it does not accept.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BoardError {
    /// Not a board.
    #[error("{0}")]
    Unreadable(String),
    /// Another version, seed set or scene.
    #[error("the board has {what} {found}, not {own}; choose another --board")]
    OtherBoard {
        /// Name of the field that differs.
        what: &'static str,
        /// Value on the board.
        found: String,
        /// Requested value.
        own: String,
    },
    /// An entry that contradicts itself.
    #[error("entry {name}: {problem}")]
    Entry {
        /// Name.
        name: String,
        /// Problem.
        problem: String,
    },
    /// The board already holds this result.
    #[error("the board already holds the same records under the same budget, as {name}")]
    Twice {
        /// Name of the entry on the board.
        name: String,
    },
}

/// Result of adding an entry to the board.
#[derive(Debug, Clone, PartialEq)]
pub enum Added {
    /// The entry has a new name.
    New,
    /// The entry replaced one of the same name.
    InPlaceOf(Box<Entry>),
}

impl Board {
    /// An empty board for a scenario's scene under any controller.
    pub fn new(config_version: &str, seed_set: SeedSetName, scenario: &Scenario) -> Self {
        Self {
            schema_version: SCHEMA_VERSION,
            config_version: config_version.to_owned(),
            seed_set,
            scene: scenario.names().scene.clone(),
            scene_hash: scenario.scene_hash(),
            entries: Vec::new(),
        }
    }

    /// Reads a board and checks it.
    ///
    /// # Errors
    /// The text is not a board or has another layout, an entry contradicts itself, or a name occurs twice.
    pub fn from_json(text: &str) -> Result<Self, BoardError> {
        let value: serde_json::Value =
            serde_json::from_str(text).map_err(|e| BoardError::Unreadable(e.to_string()))?;
        let schema = value.get("schema_version").map_or_else(|| "none".to_owned(), ToString::to_string);
        if schema != SCHEMA_VERSION.to_string() {
            let (what, own) = ("schema_version", SCHEMA_VERSION.to_string());
            return Err(BoardError::OtherBoard { what, found: schema, own });
        }
        let board: Self = serde_json::from_value(value).map_err(|e| BoardError::Unreadable(e.to_string()))?;
        for (i, entry) in board.entries.iter().enumerate() {
            let wrong =
                |problem: &str| BoardError::Entry { name: entry.name.clone(), problem: problem.to_owned() };
            if board.entries[..i].iter().any(|other| other.name == entry.name) {
                return Err(wrong("the name occurs twice"));
            }
            if entry.budget.admits(entry.snapped_per_tree, entry.dropped_per_tree) != entry.within_budget {
                return Err(wrong("within_budget contradicts its figures"));
            }
        }
        Ok(board)
    }

    /// Checks that the board has the given version, seed set and scene.
    ///
    /// # Errors
    /// The board has another version, seed set or scene.
    pub fn check(
        &self,
        config_version: &str,
        seed_set: SeedSetName,
        scenario: &Scenario,
    ) -> Result<(), BoardError> {
        let other = |what, found: String, own: String| Err(BoardError::OtherBoard { what, found, own });
        if self.config_version != config_version {
            return other("config_version", self.config_version.clone(), config_version.to_owned());
        }
        if self.seed_set != seed_set {
            return other("seed set", format!("{:?}", self.seed_set), format!("{seed_set:?}"));
        }
        for ((what, found), (_, own)) in self.scene.list().into_iter().zip(scenario.names().scene.list()) {
            if found != own {
                return other(what, found.to_owned(), own.to_owned());
            }
        }
        let scene_hash = scenario.scene_hash();
        if self.scene_hash != scene_hash {
            return other("scene_hash", self.scene_hash.clone(), scene_hash);
        }
        Ok(())
    }

    /// Adds an entry; it replaces one of the same name.
    ///
    /// # Errors
    /// The board already holds the same records under the same budget.
    pub fn add(&mut self, entry: Entry) -> Result<Added, BoardError> {
        let same = |other: &&Entry| {
            other.records_sha256 == entry.records_sha256
                && (other.budget.snapped, other.budget.dropped)
                    == (entry.budget.snapped, entry.budget.dropped)
        };
        if let Some(other) = self.entries.iter().find(same) {
            return Err(BoardError::Twice { name: other.name.clone() });
        }
        let old = self.entries.iter().position(|other| other.name == entry.name);
        let added = old.map_or(Added::New, |i| Added::InPlaceOf(Box::new(self.entries.remove(i))));
        self.entries.push(entry);
        self.entries = ranking(&self.entries, None).into_iter().map(|ranked| ranked.entry.clone()).collect();
        Ok(added)
    }
}
