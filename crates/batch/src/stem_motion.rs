//! Motion of stems that bend, in the axes that batches keep it in.

use crate::tree_world::Plant;
use nalgebra::Quaternion;
use orchard_geometry::{Rotation, Vec3};
use orchard_multibody::Data;

/// Rotation and rate of a fruit's stem in the axes of the link that bears it: there a turn about the rate leaves the rate as it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StemMotion {
    /// Direction at rest.
    pub rest: Vec3,
    /// Rotation from the rest, as a quaternion (x, y, z, w).
    pub rotation: [f64; 4],
    /// Rate of turning [rad/s].
    pub rate: Vec3,
}

impl StemMotion {
    /// Motion in the state of a world; `None` on a tether.
    pub fn of(plant: &Plant, data: &Data, fruit: usize) -> Option<Self> {
        let id = plant.fruit.stem(fruit)?;
        let (dofs, frame) = (plant.model.dofs(id), plant.model.body(id).x_parent_joint.rotation);
        let own = turn_of(&data.q[plant.model.qs(id)]);
        let turn = frame * own * frame.inverse();
        Some(Self {
            rest: frame * Vec3::z(),
            rotation: [0, 1, 2, 3].map(|k| turn.coords[k]),
            rate: frame * (own * Vec3::from_column_slice(&data.v[dofs])),
        })
    }

    /// Writes rotation (of any size but 0) and rate [rad/s] into the state of a world; does nothing on a tether.
    pub fn store(plant: &Plant, data: &mut Data, fruit: usize, rotation: [f64; 4], rate: Vec3) {
        let Some(id) = plant.fruit.stem(fruit) else { return };
        let frame = plant.model.body(id).x_parent_joint.rotation;
        let own = frame.inverse() * turn_of(&rotation) * frame;
        data.q[plant.model.qs(id)].copy_from_slice(own.coords.as_slice());
        let of_link = own.inverse() * (frame.inverse() * rate);
        data.v[plant.model.dofs(id)].copy_from_slice(of_link.as_slice());
    }
}

/// The rotation of a quaternion (x, y, z, w).
fn turn_of(q: &[f64]) -> Rotation {
    Rotation::new_normalize(Quaternion::new(q[3], q[0], q[1], q[2]))
}
