//! The state of a world as one number, by which machines are compared.

use orchard_geometry::Vec3;
use sha2::{Digest, Sha256};

use crate::World;

impl World {
    /// SHA-256 over the bits of all coordinates and velocities, little-endian: q, v, then positions, velocities and angular velocities of the fruit.
    pub fn state_digest(&self) -> [u8; 32] {
        let data = self.data();
        let mut hash = Sha256::new();
        let mut add = |x: &f64| hash.update(x.to_bits().to_le_bytes());
        data.q.iter().chain(&data.v).for_each(&mut add);
        let vectors: [&Vec<Vec3>; 3] = [&data.point_p_world, &data.point_v_world, &data.point_w_world];
        vectors.into_iter().flatten().flat_map(|vector| vector.iter()).for_each(add);
        hash.finalize().into()
    }
}
