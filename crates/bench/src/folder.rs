//! A folder that a run writes into, held open so that a move, removal or replacement is noticed.

use std::path::{Path, PathBuf};
use std::{fs, io};

/// A folder and, on Unix, an open handle of it. While the handle is open, no other folder gets the same device and inode.
#[derive(Debug)]
pub(crate) struct HeldFolder {
    path: PathBuf,
    #[cfg(unix)]
    handle: fs::File,
}

impl HeldFolder {
    /// Opens a folder.
    ///
    /// # Errors
    /// There is no such folder, or it cannot be read.
    pub fn open(path: &Path) -> io::Result<Self> {
        if !fs::metadata(path)?.is_dir() {
            return Err(io::ErrorKind::NotADirectory.into());
        }
        Ok(Self {
            path: path.to_owned(),
            #[cfg(unix)]
            handle: fs::File::open(path)?,
        })
    }

    /// Checks that the path still leads to this folder. Elsewhere than on Unix a folder with an open file, such as the lock, cannot
    /// be moved, so that its existence is enough.
    ///
    /// # Errors
    /// The folder was moved, removed or replaced.
    pub fn check(&self) -> io::Result<()> {
        let there = fs::metadata(&self.path);
        #[cfg(unix)]
        let is_same = {
            use std::os::unix::fs::MetadataExt;
            let held = self.handle.metadata()?;
            there.is_ok_and(|there| (there.dev(), there.ino()) == (held.dev(), held.ino()))
        };
        #[cfg(not(unix))]
        let is_same = there.is_ok_and(|there| there.is_dir());
        if is_same {
            return Ok(());
        }
        let folder = self.path.display();
        Err(io::Error::other(format!("{folder} was moved, removed or replaced while this run wrote into it")))
    }
}
