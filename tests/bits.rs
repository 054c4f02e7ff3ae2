//! A world as one number: equal only where every bit is equal.

use orchard_geometry::Vec3;
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
    let visible = world.camera_truth().map(|truth| (truth.frame, &truth.fruit));
    // Rust writes every digit of a number.
    hash.update(format!("{proprioception:?} {visible:?} {:?}", world.fruit_truth()));
    hash.finalize().into()
}

/// SHA-256 over the bits of all coordinates and velocities, little-endian: q, v, then position, velocity and angular
/// velocity of each fruit. Hexadecimal.
pub fn state_hash(world: &World) -> String {
    let data = world.data();
    let mut hash = Sha256::new();
    let mut add = |x: &f64| hash.update(x.to_bits().to_le_bytes());
    data.q.iter().chain(&data.v).for_each(&mut add);
    let vectors: [&Vec<Vec3>; 3] = [&data.point_p_world, &data.point_v_world, &data.point_w_world];
    vectors.into_iter().flatten().flat_map(|vector| vector.iter()).for_each(add);
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}
