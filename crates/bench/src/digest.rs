//! One hash over several files.

use sha2::{Digest, Sha256};

/// SHA-256 over named files. Names and lengths are hashed too, so that bytes cannot move from one file to another unnoticed.
#[derive(Debug, Clone, Default)]
pub(crate) struct FilesDigest(Sha256);

impl FilesDigest {
    /// Takes the next file.
    pub fn add(&mut self, name: &str, bytes: &[u8]) {
        for part in [name.as_bytes(), bytes] {
            self.0.update((part.len() as u64).to_le_bytes());
            self.0.update(part);
        }
    }

    /// The hash.
    pub fn finish(self) -> [u8; 32] {
        self.0.finalize().into()
    }
}

/// A hash in hexadecimal.
pub(crate) fn hex(hash: &[u8]) -> String {
    hash.iter().map(|byte| format!("{byte:02x}")).collect()
}
