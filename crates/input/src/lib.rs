//! Input files, read whole and within a stated size.
//!
//! A file decides how much memory a program takes to read it, so every file is read through [`text`] or [`bytes`] with the largest size of
//! its kind. A device such as `/dev/zero`, a pipe or a folder is refused, and so is a file that is larger or that grows while it is read.
//!
//! The sizes are our own choice: at least ten times the largest file of the kind that this project writes or has seen, and small enough
//! that the parsed form stays below 1 GiB. The densest JSON, a list of 16.7 million zeros in 32 MiB, took 548 MiB as values of any kind
//! (measured); `SECURITY.md` has the figures of whole commands.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::Path;

/// Largest config, scenario or intrinsics file \[bytes\]. The largest config of this project has 20 kB.
pub const CONFIG: u64 = 1 << 20;
/// Largest digitised tree, as JSON or MTG \[bytes\]: 100,000 segments of 300 bytes.
pub const TREE: u64 = 32 << 20;
/// Largest robot description \[bytes\]. That of preset `paper` has 12 kB; descriptions of humanoids have 200 kB.
pub const ROBOT: u64 = 4 << 20;
/// Largest mesh of a robot \[bytes\]: a million triangles of binary STL have 50 MB.
pub const MESH: u64 = 64 << 20;
/// Largest image file \[bytes\]: 100 million pixels of 32 bits, uncompressed, and 1 % for headers.
pub const IMAGE: u64 = 385 << 20;
/// Largest file of one result: record, plan, summary, leaderboard or manifest \[bytes\]. Records of 600 s have 3 MB.
pub const RESULT: u64 = 32 << 20;
/// Largest trajectory, as CSV or JSON lines \[bytes\]: 60 rows a second of 500 bytes for half an hour.
pub const TRAJECTORY: u64 = 54 << 20;

/// Largest recording, which is read piece by piece \[bytes\]: 600 s have 160 MB.
pub const RECORDING: u64 = 4 << 30;

/// A file that cannot be read. The message does not name the file: the caller knows the option that gave it.
#[derive(Debug, thiserror::Error)]
pub enum InputError {
    /// No such file, or none that may be read.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// A folder, a device, a pipe or a socket.
    #[error("is no regular file")]
    NotRegular,
    /// Larger than its kind may be.
    #[error("has more than {most} bytes, the largest size that is read")]
    TooLarge {
        /// Largest size \[bytes\].
        most: u64,
    },
    /// Not text.
    #[error("is not text in UTF-8: byte {at} cannot be read")]
    NotText {
        /// Place of the first byte that is no text, from 0.
        at: usize,
    },
}

impl InputError {
    /// True if there is no such file.
    pub fn is_missing(&self) -> bool {
        matches!(self, Self::Io(e) if matches!(e.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory))
    }
}

/// Opens a regular file of at most `most` bytes to read it piece by piece; returns its size \[bytes\] as well.
///
/// # Errors
/// There is no such file, it cannot be read, is no regular file, or is larger.
pub fn open(path: &Path, most: u64) -> Result<(File, u64), InputError> {
    // Opening a pipe would wait for its writer, so its kind is looked at first.
    if !fs::metadata(path)?.is_file() {
        return Err(InputError::NotRegular);
    }
    let file = File::open(path)?;
    let about = file.metadata()?;
    if !about.is_file() {
        return Err(InputError::NotRegular);
    }
    if about.len() > most {
        return Err(InputError::TooLarge { most });
    }
    Ok((file, about.len()))
}

/// Reads a file of at most `most` bytes.
///
/// # Errors
/// As [`open`].
pub fn bytes(path: &Path, most: u64) -> Result<Vec<u8>, InputError> {
    let (file, _) = open(path, most)?;
    let mut bytes = Vec::new();
    // The stated size can be wrong: files of the kernel have a size of 0, and another program may write meanwhile.
    file.take(most + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most {
        return Err(InputError::TooLarge { most });
    }
    Ok(bytes)
}

/// Reads a text file of at most `most` bytes in UTF-8.
///
/// # Errors
/// As [`bytes`], or the file is not text.
pub fn text(path: &Path, most: u64) -> Result<String, InputError> {
    String::from_utf8(bytes(path, most)?)
        .map_err(|e| InputError::NotText { at: e.utf8_error().valid_up_to() })
}

/// Reads a text file of at most `most` bytes in UTF-8 or, if its bytes are not UTF-8, in Latin-1 (ISO 8859-1), in which every byte is a character.
///
/// # Errors
/// As [`bytes`].
pub fn latin_text(path: &Path, most: u64) -> Result<String, InputError> {
    let text = String::from_utf8(bytes(path, most)?);
    Ok(text.unwrap_or_else(|e| e.into_bytes().into_iter().map(char::from).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_read_up_to_its_largest_size() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        fs::write(&path, "12345").unwrap();
        assert_eq!(text(&path, 5).unwrap(), "12345");
        assert_eq!(bytes(&path, 100).unwrap(), b"12345");
        let e = text(&path, 4).unwrap_err().to_string();
        assert_eq!(e, "has more than 4 bytes, the largest size that is read");
        fs::write(&path, b"ab\xff").unwrap();
        assert_eq!(text(&path, 5).unwrap_err().to_string(), "is not text in UTF-8: byte 2 cannot be read");
        assert_eq!(latin_text(&path, 5).unwrap(), "ab\u{ff}");
        let missing = text(&folder.path().join("b.toml"), 5).unwrap_err();
        assert!(missing.is_missing());
        assert!(matches!(text(folder.path(), 5), Err(InputError::NotRegular)));
    }

    #[cfg(unix)]
    #[test]
    fn a_device_is_refused() {
        for device in ["/dev/zero", "/dev/null", "/dev/full"] {
            assert!(matches!(bytes(Path::new(device), CONFIG), Err(InputError::NotRegular)), "{device}");
        }
        if let Ok(text) = text(Path::new("/proc/self/status"), CONFIG) {
            assert!(!text.is_empty());
        }
    }
}
