//! A world as one number: equal only where every bit is equal.

use orchard_robot::Observation;
use orchard_world::World;
use sha2::{Digest, Sha256};

/// SHA-256 over a world's complete output after its robot has sensed: the snapshot, the observation with its
/// depth image, and the truth.
pub fn fingerprint(world: &World, observation: &Observation) -> [u8; 32] {
    let mut hash = Sha256::new();
    if let Some(image) = &observation.depth {
        image.pixels().iter().for_each(|depth| hash.update(depth.to_bits().to_le_bytes()));
    }
    hash.update(world.snapshot().to_bytes());
    let proprioception = Observation { depth: None, ..observation.clone() };
    let visible = world.camera_truth().map(|truth| (truth.sight.frame, truth.fruit()));
    // Rust writes every digit of a number.
    hash.update(format!("{proprioception:?} {visible:?} {:?}", world.fruit_truth()));
    hash.finalize().into()
}

/// [`World::state_digest`] in hexadecimal.
pub fn state_hash(world: &World) -> String {
    world.state_digest().iter().map(|byte| format!("{byte:02x}")).collect()
}
