//! A frame as one number.

use orchard_robot::{Command, Observation};
use orchard_world::World;
use sha2::{Digest, Sha256};

/// SHA-256 of a frame: equal only where every bit that the controller saw, that it commanded, and of the world after the step is equal.
pub type FrameDigest = [u8; 32];

/// The digest of a frame: the bits of the depth image if the frame had one, of the command, and [`World::state_digest`] after the step.
pub(crate) fn frame_digest(
    observation: Option<&Observation>,
    command: &Command,
    world: &World,
) -> FrameDigest {
    let mut hash = Sha256::new();
    if let Some(image) = observation.and_then(|seen| seen.depth.as_ref()) {
        let bits: Vec<u8> = image.pixels().iter().flat_map(|depth| depth.to_bits().to_le_bytes()).collect();
        hash.update(bits);
    }
    let Command { arm_q, arm_v, base_velocity, finger_q, finger_force, vacuum } = command;
    let numbers =
        arm_q.iter().chain(arm_v.iter()).chain(base_velocity).chain([finger_q, finger_force, vacuum]);
    numbers.for_each(|number| hash.update(number.to_bits().to_le_bytes()));
    hash.update(world.state_digest());
    hash.finalize().into()
}
