//! Identity of the world that a snapshot belongs to, by hashes of its content.

use crate::build::Parts;
use orchard_geometry::HeightField;
use orchard_robot::RobotModel;
use orchard_spec::Spec;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

type Hash = [u8; 32];

/// Hashes of a world's inputs and of the model built from them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Identity {
    spec: Hash,
    robot: Hash,
    pub start: Start,
    /// Bodies and ground: other code may grow another tree from the same seed. Includes the repeat if it is not 0.
    model: Hash,
}

/// Key of a world's random numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Start {
    pub seed: u64,
    pub world: u32,
    pub episode: u32,
}

/// Difference between a snapshot's world and the world to be restored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Difference {
    /// Other config.
    #[error("it was saved under another spec")]
    Spec,
    /// Other robot.
    #[error("it was saved with another robot")]
    Robot,
    /// Other seed.
    #[error("it was saved under seed {saved}, this is seed {here}")]
    Seed {
        /// Of the snapshot.
        saved: u64,
        /// Of this world.
        here: u64,
    },
    /// Other index under the same seed.
    #[error("it is a snapshot of world {saved}, this is world {here}")]
    World {
        /// Of the snapshot.
        saved: u32,
        /// Of this world.
        here: u32,
    },
    /// Another episode of the same world, with another draw of the randomisation.
    #[error("it is a snapshot of episode {saved}, this is episode {here}")]
    Episode {
        /// Of the snapshot.
        saved: u32,
        /// Of this world.
        here: u32,
    },
    /// Equal inputs, from which this version of the code builds other bodies.
    #[error(
        "it was saved with another start pose of the robot, or by another version of the code, which built other bodies from this config and seed"
    )]
    Model,
}

impl Identity {
    pub fn new(spec: &Spec, robot: &RobotModel, start: Start, repeat: u32, parts: &Parts) -> Self {
        let model = &parts.model;
        let ground = parts.ground.field().map(HeightField::heights);
        let bodies = bytes(&(model.bodies(), model.points(), model.couplings(), ground));
        Self {
            spec: hash(&[&json(spec)]),
            robot: hash(&[robot.urdf().as_bytes(), &json(robot.config())]),
            start,
            model: if repeat == 0 { hash(&[&bodies]) } else { hash(&[&bodies, &repeat.to_le_bytes()]) },
        }
    }

    /// The first difference of a saved world from this one.
    pub fn check(&self, saved: &Self) -> Result<(), Difference> {
        let (there, here) = (saved.start, self.start);
        let found = if saved.spec != self.spec {
            Difference::Spec
        } else if saved.robot != self.robot {
            Difference::Robot
        } else if there.seed != here.seed {
            Difference::Seed { saved: there.seed, here: here.seed }
        } else if there.world != here.world {
            Difference::World { saved: there.world, here: here.world }
        } else if there.episode != here.episode {
            Difference::Episode { saved: there.episode, here: here.episode }
        } else if saved.model != self.model {
            Difference::Model
        } else {
            return Ok(());
        };
        Err(found)
    }
}

/// SHA-256 over some parts, each with its length.
fn hash(parts: &[&[u8]]) -> Hash {
    let mut hash = Sha256::new();
    for part in parts {
        hash.update((part.len() as u64).to_le_bytes());
        hash.update(part);
    }
    hash.finalize().into()
}

/// A config as text: the order of fields and the shortest digits that give a number back are the same everywhere.
fn json(config: &impl Serialize) -> Vec<u8> {
    serde_json::to_vec(config).unwrap_or_else(|e| unreachable!("config from TOML is also JSON: {e}"))
}

/// Numbers with all their bits.
fn bytes(value: &impl Serialize) -> Vec<u8> {
    postcard::to_stdvec(value).unwrap_or_else(|e| unreachable!("numbers, lists and options serialise: {e}"))
}
