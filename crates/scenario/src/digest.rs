//! Hashes of scenarios.

use serde::Serialize;
use sha2::{Digest, Sha256};

use crate::Scenario;

impl Scenario {
    /// SHA-256, hexadecimal, over all inputs of a scenario's results except code and protocol. File names and the option that gave a value
    /// are not included.
    pub fn hash(&self) -> String {
        let mut parts = self.scene_parts();
        parts.push(("controller".to_owned(), self.controller.name().to_owned()));
        parts.extend(self.controller.configs());
        hash(&parts)
    }

    /// SHA-256, hexadecimal, over all parts except the controller, for results without a controller.
    pub fn scene_hash(&self) -> String {
        hash(&self.scene_parts())
    }

    fn scene_parts(&self) -> Vec<(String, String)> {
        let parts = [
            ("world", text(&*self.spec)),
            ("tree", text(&self.tree.as_deref())),
            ("robot.urdf", self.robot.urdf().to_owned()),
            ("robot", text(self.robot.config())),
            ("robot.meshes", text(&self.robot_files.as_ref().map(|files| &files.meshes))),
            ("detector", text(&self.detector)),
            ("rules", text(&self.rules)),
        ];
        parts.map(|(name, text)| (name.to_owned(), text)).into()
    }
}

/// A value as JSON text, the same on every platform: fields in the order of the struct, numbers with the fewest digits that identify them.
fn text(value: &impl Serialize) -> String {
    serde_json::to_string(value).unwrap_or_else(|e| unreachable!("config from TOML is also JSON: {e}"))
}

/// Names and lengths are hashed too, so that moving text from one part to another changes the hash.
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
