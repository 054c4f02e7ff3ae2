//! What a path carries on its way.

use crate::spatial::Wrench;

/// Impulses on their way to the root.
#[derive(Clone, Copy)]
pub(super) struct Carrier {
    pub body: Option<usize>,
    pub wrenches: [Wrench; 3],
}

impl Carrier {
    /// Takes over what the other one carries.
    pub fn merge(&mut self, other: &mut Carrier) {
        for (sum, wrench) in self.wrenches.iter_mut().zip(&other.wrenches) {
            *sum += *wrench;
        }
        other.body = None;
    }
}
