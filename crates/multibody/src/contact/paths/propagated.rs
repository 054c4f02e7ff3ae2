//! Impulses propagated along a path.

use crate::spatial::Wrench;

/// Unit impulses of a block, propagated towards the root as far as a link.
#[derive(Clone, Copy)]
pub(super) struct Propagated {
    /// Link that they have reached; `None` past the root.
    pub body: Option<usize>,
    /// Wrench of each unit impulse at the link's origin.
    pub wrenches: [Wrench; 3],
}

impl Propagated {
    /// Adds the wrenches of the other one, which ends there.
    pub fn merge(&mut self, other: &mut Propagated) {
        for (sum, wrench) in self.wrenches.iter_mut().zip(&other.wrenches) {
            *sum += *wrench;
        }
        other.body = None;
    }
}
