//! The file of a board, with its table and figure beside it.

use std::fs;
use std::path::{Path, PathBuf};

use orchard_bench::store::{remove_half_written, write_bytes};
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
        let bytes = match orchard_input::bytes(&self.path, orchard_input::RESULT) {
            Ok(bytes) => bytes,
            Err(e) if e.is_missing() => return Ok(None),
            Err(e) => return Err(self.bad(&e)),
        };
        let board = Board::from_file(&bytes).map_err(|e| self.bad(&e))?;
        board.check(&protocol.version, self.seed_set, scenario).map_err(|e| self.bad(&e))?;
        Ok(Some(board))
    }

    /// Waits until no other process changes the board, and locks it. Read, change and save it under one lock. Incomplete files of earlier
    /// processes are removed.
    ///
    /// # Errors
    /// The folder cannot be made, the lock file cannot be written, or an incomplete file cannot be removed.
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
        for path in [self.table(), self.figure(), self.path.clone()] {
            remove_half_written(&path).map_err(|e| Failure::Failed(e.to_string()))?;
        }
        Ok(BoardLock { _file: file })
    }

    fn table(&self) -> PathBuf {
        self.path.with_extension("md")
    }

    fn figure(&self) -> PathBuf {
        self.path.with_extension("svg")
    }

    /// Writes the table, the figure and the board, each atomically. The board comes last: a change that is cut short before leaves the old
    /// board, and the same change can be made again.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn save(&self, board: &Board) -> Result<(), Failure> {
        let failed = |e: &dyn std::fmt::Display| Failure::Failed(e.to_string());
        let figure = orchard_report::pareto(board).map_err(|e| failed(&e))?;
        let text = format!("# Leaderboard\n\n{}", table::whole(board));
        let bytes = board.to_file().map_err(|e| failed(&e))?;
        for (path, bytes) in [
            (self.table(), text.as_bytes()),
            (self.figure(), figure.svg.as_bytes()),
            (self.path.clone(), &bytes),
        ] {
            write_bytes(&path, bytes).map_err(|e| failed(&e))?;
        }
        Ok(())
    }
}
