//! The file of a board, with its table and figure beside it.

use std::fs;
use std::path::{Path, PathBuf};

use orchard_bench::store::{write_bytes, write_json};
use orchard_leaderboard::Board;
use orchard_scenario::Scenario;
use orchard_tasks::protocol::Protocol;
use orchard_tasks::seeds::SeedSetName;

use super::table;
use crate::failure::Failure;

/// Place of a board.
pub struct BoardFile {
    path: PathBuf,
    seed_set: SeedSetName,
}

/// Lock of a board: no other process changes it until this is dropped.
pub struct BoardLock {
    _file: fs::File,
}

impl BoardFile {
    /// A board of a seed set in a file.
    ///
    /// # Errors
    /// The name does not end in `.json`.
    pub fn new(path: PathBuf, seed_set: SeedSetName) -> Result<Self, Failure> {
        let file = Self { path, seed_set };
        if file.path.extension().is_some_and(|extension| extension == "json") {
            Ok(file)
        } else {
            Err(Failure::BadInput(format!(
                "--board {}: a name that ends in .json is needed",
                file.path.display()
            )))
        }
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The failure of a file with a problem.
    pub fn bad(&self, problem: &dyn std::fmt::Display) -> Failure {
        Failure::BadInput(format!("{}: {problem}", self.path.display()))
    }

    /// Reads the board and checks it; none where there is no file.
    ///
    /// # Errors
    /// The file is no board, or a board of another scene.
    pub fn read(&self, protocol: &Protocol, scenario: &Scenario) -> Result<Option<Board>, Failure> {
        let text = match orchard_input::text(&self.path, orchard_input::RESULT) {
            Ok(text) => text,
            Err(e) if e.is_missing() => return Ok(None),
            Err(e) => return Err(self.bad(&e)),
        };
        let board = Board::from_json(&text).map_err(|e| self.bad(&e))?;
        board.check(&protocol.version, self.seed_set, scenario).map_err(|e| self.bad(&e))?;
        Ok(Some(board))
    }

    /// Waits until no other process changes the board, and locks it. Read, change and save it under one lock.
    ///
    /// # Errors
    /// The folder cannot be made, or the lock file cannot be written.
    pub fn lock(&self) -> Result<BoardLock, Failure> {
        if let Some(folder) = self.path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
            fs::create_dir_all(folder)
                .map_err(|e| Failure::of_file(&e).at(format_args!("--board {}", folder.display())))?;
        }
        let path = self.path.with_extension("lock");
        let failed = |e: std::io::Error| Failure::Failed(format!("{}: {e}", path.display()));
        let file =
            fs::File::options().create(true).truncate(false).write(true).open(&path).map_err(failed)?;
        file.lock().map_err(failed)?;
        Ok(BoardLock { _file: file })
    }

    /// Writes the board, its table and its figure, each atomically.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn save(&self, board: &Board) -> Result<(), Failure> {
        let failed = |e: &dyn std::fmt::Display| Failure::Failed(e.to_string());
        let figure = orchard_report::pareto(board).map_err(|e| failed(&e))?;
        write_json(&self.path, board).map_err(|e| failed(&e))?;
        let text = format!("# Leaderboard\n\n{}", table::whole(board));
        write_bytes(&self.path.with_extension("md"), text.as_bytes()).map_err(|e| failed(&e))?;
        write_bytes(&self.path.with_extension("svg"), figure.svg.as_bytes()).map_err(|e| failed(&e))
    }
}
