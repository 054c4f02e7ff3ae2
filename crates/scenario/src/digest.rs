//! Hashes of scenarios.

use serde::Serialize;
use sha2::{Digest, Sha256};

use crate::Scenario;

impl Scenario {
    /// SHA-256, hexadecimal, over everything that a scenario's results depend on besides code and protocol. Names of files do not count,
    /// nor which option gave a value.
    pub fn hash(&self) -> String {
        let mut parts = self.scene_parts();
        parts.push(("controller".to_owned(), self.controller.name().to_owned()));
        parts.extend(self.controller.configs());
        hash(&parts)
    }

    /// SHA-256, hexadecimal, over all parts but the controller: for results without a controller.
    pub fn scene_hash(&self) -> String {
        hash(&self.scene_parts())
    }

    fn scene_parts(&self) -> Vec<(String, String)> {
        let parts = [
            ("world", text(&*self.spec)),
            ("tree", text(&self.tree.as_deref())),
            ("robot.urdf", self.robot.urdf().to_owned()),
            ("robot", text(self.robot.config())),
            ("detector", text(&self.detector)),
            ("rules", text(&self.rules)),
        ];
        parts.map(|(name, text)| (name.to_owned(), text)).into()
    }
}

/// A value as JSON: the order of fields and the shortest digits that give a number back are the same everywhere.
fn text(value: &impl Serialize) -> String {
    serde_json::to_string(value).unwrap_or_else(|e| unreachable!("config from TOML is also JSON: {e}"))
}

/// Names and lengths are hashed too, so that text cannot move from one part to another unnoticed.
fn hash(parts: &[(String, String)]) -> String {
    let mut hash = Sha256::new();
    for (name, text) in parts {
        for bytes in [name.as_bytes(), text.as_bytes()] {
            hash.update((bytes.len() as u64).to_le_bytes());
            hash.update(bytes);
        }
    }
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}
