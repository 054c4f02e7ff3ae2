//! Hashes over files and configs.

use serde::Serialize;
use sha2::{Digest, Sha256};

/// SHA-256 over named files. Names and lengths are hashed too, so that moving bytes from one file to another changes the hash.
#[derive(Debug, Clone, Default)]
pub struct FilesDigest(Sha256);

impl FilesDigest {
    /// Adds the next file.
    pub fn add(&mut self, name: &str, bytes: &[u8]) {
        for part in [name.as_bytes(), bytes] {
            self.0.update((part.len() as u64).to_le_bytes());
            self.0.update(part);
        }
    }

    /// Returns the hash.
    pub fn finish(self) -> [u8; 32] {
        self.0.finalize().into()
    }
}

/// SHA-256 of some bytes, hexadecimal, as `sha256sum` prints it.
pub fn sha256(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

/// A hash as text, in hexadecimal.
pub fn hex(hash: &[u8]) -> String {
    hash.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// SHA-256 over named config texts, hexadecimal. Names and lengths are hashed too, so that moving text from one file to another
/// changes the hash.
pub fn config_hash(texts: &[(&str, &str)]) -> String {
    let mut digest = FilesDigest::default();
    for (name, text) in texts {
        digest.add(name, text.as_bytes());
    }
    hex(&digest.finish())
}

/// A config as JSON text for [`config_hash`], the same on every platform: fields in the order of the struct, numbers with the
/// fewest digits that identify them.
///
/// # Panics
/// If the config cannot be written as JSON, for example a map whose keys are not text.
pub fn config_text(config: &impl Serialize) -> String {
    serde_json::to_string(config).unwrap_or_else(|e| unreachable!("config from TOML is also JSON: {e}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hash_tells_texts_and_places_apart() {
        let hashes = [
            config_hash(&[("a", "xy"), ("b", "z")]),
            config_hash(&[("a", "x"), ("b", "yz")]),
            config_hash(&[("b", "xy"), ("a", "z")]),
        ];
        assert_ne!(hashes[0], hashes[1]);
        assert_ne!(hashes[0], hashes[2]);
        // SHA-256 of nothing.
        assert!(config_hash(&[]).starts_with("e3b0c44298fc1c14"));
    }
}
