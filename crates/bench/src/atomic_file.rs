//! A file that is written piece by piece and gets its final name when it is complete.

use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::disk;
use crate::store::StoreError;

/// A temporary file in the folder of its final path; it is deleted when dropped before [`AtomicFile::finish`].
#[derive(Debug)]
pub struct AtomicFile {
    file: BufWriter<NamedTempFile>,
    path: PathBuf,
}

impl AtomicFile {
    /// Creates the temporary file, and its folder if needed, but no parent of that folder: a result folder that was moved is not
    /// created again.
    ///
    /// # Errors
    /// The folder or the file cannot be created.
    pub fn begin(path: &Path) -> Result<Self, StoreError> {
        let begin = || {
            disk::create_folder(disk::folder_of(path))?;
            disk::begin(path)
        };
        let file = begin().map_err(|e| StoreError::new(path, e))?;
        Ok(Self { file: BufWriter::new(file), path: path.to_owned() })
    }

    /// Writes the rest and gives the file its final name.
    ///
    /// # Errors
    /// The file cannot be written or renamed.
    pub fn finish(self) -> Result<(), StoreError> {
        let Self { file, path } = self;
        let finish = || {
            let file = file.into_inner().map_err(io::IntoInnerError::into_error)?;
            disk::finish(file, &path)
        };
        finish().map_err(|e| StoreError::new(&path, e))
    }
}

impl Write for AtomicFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Seek for AtomicFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_has_its_name_only_when_it_is_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("deeper/file");
        let mut dropped = AtomicFile::begin(&path).unwrap();
        dropped.write_all(b"half").unwrap();
        assert!(!path.exists());
        drop(dropped);
        assert_eq!(std::fs::read_dir(path.parent().unwrap()).unwrap().count(), 0);

        let mut whole = AtomicFile::begin(&path).unwrap();
        whole.write_all(b"?bc").unwrap();
        whole.seek(SeekFrom::Start(0)).unwrap();
        whole.write_all(b"a").unwrap();
        whole.finish().unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"abc");
        // A folder cannot be made where a file is.
        let below = path.join("x");
        assert!(AtomicFile::begin(&below).unwrap_err().to_string().contains("file"));
    }

    /// A socket stands for a device here: `/dev/null` is not for tests to lose.
    #[cfg(unix)]
    #[test]
    fn a_device_is_not_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("socket");
        let _socket = std::os::unix::net::UnixListener::bind(&path).unwrap();
        let refused = AtomicFile::begin(&path).unwrap_err().to_string();
        assert!(refused.contains("socket") && refused.contains("give a file"), "{refused}");
        assert!(!std::fs::metadata(&path).unwrap().is_file());
    }
}
