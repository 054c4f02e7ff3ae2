//! The order in which the recursions visit links: parents first, and independent links side by side.

use std::ops::Range;

use crate::parts::{Body, JointKind};

/// Links that a recursion visits together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Slot {
    /// One link, any joint.
    One([usize; 1]),
    /// Two links on universal joints (the wood of a tree), neither between the other and the root.
    Two([usize; 2]),
}

impl Slot {
    /// Links of the slot.
    pub fn links(&self) -> &[usize] {
        match self {
            Slot::One(links) => links,
            Slot::Two(links) => links,
        }
    }
}

/// Orders links by their distance from the root, which has parents before their children forwards and after
/// them backwards, and keeps the two far apart: no visit has to wait for the one before it.
pub(crate) fn schedule(bodies: &[Body]) -> Vec<Slot> {
    let mut depth: Vec<usize> = Vec::with_capacity(bodies.len());
    for body in bodies {
        depth.push(body.parent.map_or(0, |parent| depth[parent.index()] + 1));
    }
    let is_universal = |index: usize| bodies[index].joint == JointKind::Universal;
    let mut order: Vec<usize> = (0..bodies.len()).collect();
    order.sort_by_key(|&index| (depth[index], is_universal(index)));
    let mut slots = Vec::new();
    let mut rest = order.as_slice();
    while let [first, after @ ..] = rest {
        let can_join = |second: &usize| {
            is_universal(*first)
                && is_universal(*second)
                && bodies[*second].parent.is_none_or(|parent| parent.index() != *first)
        };
        let (slot, after) = match after {
            [second, after @ ..] if can_join(second) => (Slot::Two([*first, *second]), after),
            _ => (Slot::One([*first]), after),
        };
        slots.push(slot);
        rest = after;
    }
    slots
}

/// Joints in a row whose coordinates are the integrals of their velocities: all but those with quaternions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Run {
    q_start: usize,
    v_start: usize,
    len: usize,
}

impl Run {
    /// Range of the run in q.
    pub fn qs(&self) -> Range<usize> {
        self.q_start..self.q_start + self.len
    }

    /// Range of the run in v.
    pub fn dofs(&self) -> Range<usize> {
        self.v_start..self.v_start + self.len
    }
}

/// The runs between the joints with quaternions.
pub(crate) fn runs(bodies: &[Body]) -> Vec<Run> {
    let mut runs = Vec::new();
    let mut run = Run { q_start: 0, v_start: 0, len: 0 };
    for body in bodies {
        if body.joint.has_quaternion() {
            runs.push(run);
            let (nq, nv) = (body.joint.nq(), body.joint.nv());
            run = Run { q_start: run.qs().end + nq, v_start: run.dofs().end + nv, len: 0 };
        } else {
            run.len += body.joint.nv();
        }
    }
    runs.push(run);
    runs
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parts::{BodyId, SpatialInertia};
    use orchard_geometry::{Mat3, Pose, Vec3};

    #[test]
    fn independent_links_share_a_slot_and_parents_come_first() {
        let body = |parent: Option<u32>, joint| Body {
            parent: parent.map(BodyId),
            joint,
            x_parent_joint: Pose::identity(),
            inertia: SpatialInertia { mass: 1.0, p_com: Vec3::zeros(), i_com: Mat3::identity() },
        };
        let bodies = [
            body(None, JointKind::Universal),
            body(Some(0), JointKind::Universal),
            body(Some(1), JointKind::Universal),
            body(Some(0), JointKind::Weld),
            body(Some(0), JointKind::Universal),
            body(Some(4), JointKind::Free),
            body(Some(4), JointKind::Universal),
        ];
        let expected = [Slot::One([0]), Slot::One([3]), Slot::Two([1, 4]), Slot::One([5]), Slot::Two([2, 6])];
        assert_eq!(schedule(&bodies), expected);
        let runs: Vec<_> = runs(&bodies).iter().map(|run| (run.qs(), run.dofs())).collect();
        assert_eq!(runs, [(0..8, 0..8), (15..17, 14..16)]);
    }
}
