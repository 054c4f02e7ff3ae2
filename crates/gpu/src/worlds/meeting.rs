//! Contacts and loads that a world keeps.

use orchard_geometry::Vec3;

use crate::layout::{contact, meeting, pair};

/// Contacts of a world: those of its latest substep, and counts and loads since its reset.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Meeting {
    /// Contact points of the latest substep, in the order of their colliders; an open one has no force.
    pub contacts: Vec<ContactPoint>,
    /// Number of pairs of colliders, and of contact points, that were left out for want of room.
    pub lost: u32,
    /// Number of solves that did not converge.
    pub unsolved: u32,
    /// Number of Newton iterations of the latest substep.
    pub iterations: u32,
    /// Largest number of contact points of a substep.
    pub most: u32,
    /// Impulse of the robot on live wood: sum of the sizes of all forces over time [N s].
    pub contact_impulse: f32,
    /// Largest sum of these sizes in a substep \[N\].
    pub peak_contact_force: f32,
}

/// A contact point of two colliders of a world, as numbers: its segments, its fruit, the colliders of the robot in the order in which it adds them to a model, those that stand still in that of the model, the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactPoint {
    /// Numbers of the two, the smaller one first.
    pub pair: [usize; 2],
    /// Point halfway between the surfaces \[m\], world.
    pub p_world: Vec3,
    /// Unit normal from the second to the first.
    pub n_world: Vec3,
    /// Distance of the surfaces at the start of the substep \[m\]; negative while they overlap.
    pub gap: f64,
    /// Mean force on the first over the substep \[N\]; the other one feels the opposite.
    pub force_world: Vec3,
}

impl Meeting {
    /// Numbers of the record that it is made of.
    pub(super) const NUMBERS: usize = meeting::FIELDS + meeting::MOST_CONTACTS * contact::FIELDS;

    /// From the numbers of a record; `h` is the length of a substep \[s\].
    pub(super) fn of(numbers: &[f32], h: f32) -> Self {
        let count = |field: usize| numbers[field].to_bits();
        let known = (count(meeting::LAST) as usize).min(meeting::MOST_CONTACTS);
        let of_contacts = numbers[meeting::FIELDS..].chunks_exact(contact::FIELDS).take(known);
        // The force of a suction cup is no contact of surfaces.
        let contacts = of_contacts.filter(|own| own[contact::GIVEN] == 0.0).map(|own| {
            let vector = |field: usize| Vec3::from_fn(|k, _| f64::from(own[field + k]));
            let both = own[contact::PAIR].to_bits() as usize;
            ContactPoint {
                pair: [both >> pair::FIRST, both & pair::NUMBER],
                p_world: vector(contact::P),
                n_world: vector(contact::N),
                gap: f64::from(own[contact::GAP]),
                force_world: vector(contact::IMPULSE) / f64::from(h),
            }
        });
        Self {
            contacts: contacts.collect(),
            lost: count(meeting::LOST),
            unsolved: count(meeting::UNSOLVED),
            iterations: count(meeting::ITERATIONS),
            most: count(meeting::MOST),
            contact_impulse: numbers[meeting::IMPULSE],
            peak_contact_force: numbers[meeting::PEAK],
        }
    }
}
