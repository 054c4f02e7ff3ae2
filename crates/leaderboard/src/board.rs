//! The board's file.

use std::io;

use orchard_bench::SCHEMA_VERSION;
use orchard_bench::checksum::{Damage, checked, encode};
use orchard_scenario::{Scenario, SceneNames};
use orchard_tasks::seeds::SeedSetName;
use serde::{Deserialize, Serialize};

use crate::entry::Entry;
use crate::rank::ranking;

/// A leaderboard: entries on one seed set under one version of the configs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Board {
    /// Layout version.
    pub schema_version: u32,
    /// Version of protocol and configs.
    pub config_version: String,
    /// The set whose seeds all entries are on.
    pub seed_set: SeedSetName,
    /// Names of the scene that all entries are of.
    pub scene: SceneNames,
    /// [`orchard_scenario::Scenario::scene_hash`].
    pub scene_hash: String,
    /// Entries, by place under their own budgets.
    pub entries: Vec<Entry>,
}

/// The field that every version of a board has; other fields take no memory.
#[derive(Deserialize)]
struct Head {
    schema_version: Option<serde_json::Value>,
}

/// A board that cannot be used, or an entry that it does not take.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BoardError {
    /// Not a board.
    #[error("{0}")]
    Unreadable(String),
    /// The file has no checksum, or one of other content.
    #[error("the board {0}; take a copy that nobody edited, or add the results to a new board")]
    Damaged(Damage),
    /// Another version, seed set or scene.
    #[error("the board has {what} {found}, not {own}: give another --board")]
    OtherBoard {
        /// Name of the figure that differs.
        what: &'static str,
        /// Figure of the board.
        found: String,
        /// Figure of the request.
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
    /// The board already holds these records.
    #[error(
        "the same records stand on the board as {name}; another name or budget makes no new result of them"
    )]
    Twice {
        /// Name of the entry on the board.
        name: String,
    },
    /// The board already holds an entry of this name.
    #[error("the board has an entry {name}; --replace puts the new result in its place")]
    NameTaken {
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

    /// Reads a board's file and checks it, its checksum first.
    ///
    /// # Errors
    /// The checksum is missing or wrong; or as [`Board::from_json`].
    pub fn from_file(bytes: &[u8]) -> Result<Self, BoardError> {
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        match checked(bytes) {
            Ok(content) => Self::from_json(&text(&content)),
            // Boards of older code have no checksum; what else has none was edited.
            Err(Damage::NoChecksum) => {
                Self::from_json(&text(bytes)).and(Err(BoardError::Damaged(Damage::NoChecksum)))
            }
            Err(damage) => Err(BoardError::Damaged(damage)),
        }
    }

    /// Returns the bytes of a board's file, with their checksum.
    ///
    /// # Errors
    /// The board does not encode; numbers and text do, so this does not happen.
    pub fn to_file(&self) -> io::Result<Vec<u8>> {
        encode(self)
    }

    /// Reads a board from its content without checksum, and checks it.
    ///
    /// # Errors
    /// Not a board, of another layout, an entry that contradicts itself, a name twice.
    pub fn from_json(text: &str) -> Result<Self, BoardError> {
        let unreadable = |e: serde_json::Error| BoardError::Unreadable(e.to_string());
        let head: Head = serde_json::from_str(text).map_err(unreadable)?;
        let schema = head.schema_version.map_or_else(|| "none".to_owned(), |found| found.to_string());
        if schema != SCHEMA_VERSION.to_string() {
            let (what, own) = ("schema_version", SCHEMA_VERSION.to_string());
            return Err(BoardError::OtherBoard { what, found: schema, own });
        }
        let board: Self = serde_json::from_str(text).map_err(unreadable)?;
        for (i, entry) in board.entries.iter().enumerate() {
            let wrong =
                |problem: &str| BoardError::Entry { name: entry.name.clone(), problem: problem.to_owned() };
            if board.entries[..i].iter().any(|other| other.name == entry.name) {
                return Err(wrong("the name is there twice"));
            }
            entry.check().map_err(|problem| wrong(&problem))?;
            if board.entries[..i].iter().any(|other| other.records_sha256 == entry.records_sha256) {
                return Err(wrong("its records are there twice"));
            }
        }
        Ok(board)
    }

    /// Checks that it is of a version, a seed set and a scene.
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

    /// Adds an entry. With `replace`, it takes the place of one of the same name.
    ///
    /// # Errors
    /// The board holds the same records under another name, or an entry of the same name that is not to be replaced.
    pub fn add(&mut self, entry: Entry, replace: bool) -> Result<Added, BoardError> {
        let old = self.entries.iter().position(|other| other.name == entry.name);
        let same = |other: &&Entry| other.records_sha256 == entry.records_sha256;
        match self.entries.iter().find(same) {
            Some(other) if !(replace && other.name == entry.name) => {
                return Err(BoardError::Twice { name: other.name.clone() });
            }
            _ => {}
        }
        if old.is_some() && !replace {
            return Err(BoardError::NameTaken { name: entry.name });
        }
        let added = old.map_or(Added::New, |i| Added::InPlaceOf(Box::new(self.entries.remove(i))));
        self.entries.push(entry);
        self.entries = ranking(&self.entries, None).into_iter().map(|ranked| ranked.entry.clone()).collect();
        Ok(added)
    }
}
