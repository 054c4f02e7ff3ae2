//! The constant part of a world: its parts ([`Body`] and the others), and the order in which the recursions visit them.

use std::collections::BTreeMap;
use std::ops::Range;

pub use crate::parts::{
    Body, BodyId, Collider, ColliderId, Coupling, Groups, JointKind, Owner, PointBody, PointId,
    SpatialInertia, Tether,
};
use crate::schedule::{Run, Slot};

/// The constant part of a world. Built by [`crate::ModelBuilder`]; parents come before their children.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    pub(crate) bodies: Vec<Body>,
    pub(crate) points: Vec<PointBody>,
    pub(crate) couplings: Vec<Coupling>,
    pub(crate) colliders: Vec<Collider>,
    /// First coordinate of each body's joint, and nq at the end.
    pub(crate) q_start: Vec<usize>,
    /// First degree of freedom of each body's joint, and nv at the end.
    pub(crate) v_start: Vec<usize>,
    /// True if a force can move the body: some joint between it and the world has a degree of freedom.
    pub(crate) movable: Vec<bool>,
    /// Links whose joints have quaternions.
    pub(crate) turning: Vec<BodyId>,
    /// Coordinates with a spring, in runs.
    pub(crate) runs: Vec<Run>,
    /// The order of the recursions.
    pub(crate) schedule: Vec<Slot>,
    /// Overlap of each pair of colliders that counts as touching \[m\]; the smaller id is first.
    pub(crate) overlaps: BTreeMap<(ColliderId, ColliderId), f64>,
}

impl Model {
    /// Coordinates of all joints: length of `Data::q`.
    pub fn nq(&self) -> usize {
        self.q_start[self.bodies.len()]
    }

    /// Degrees of freedom of all joints: length of `Data::v`. Point bodies are apart.
    pub fn nv(&self) -> usize {
        self.v_start[self.bodies.len()]
    }

    /// The links, parents first; `BodyId` is the index.
    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    /// The point bodies; `PointId` is the index.
    pub fn points(&self) -> &[PointBody] {
        &self.points
    }

    /// The couplings.
    pub fn couplings(&self) -> &[Coupling] {
        &self.couplings
    }

    /// Pairs of point bodies that have grown into each other ([`accept_overlaps`](crate::accept_overlaps)), with the depth \[m\].
    pub fn overlaps(&self) -> impl Iterator<Item = (ColliderId, ColliderId, f64)> {
        self.overlaps.iter().map(|(&(a, b), &depth)| (a, b, depth))
    }

    /// Colliders in the order in which they were added.
    pub fn collider_ids(&self) -> impl Iterator<Item = ColliderId> + use<> {
        (0..self.colliders.len() as u32).map(ColliderId)
    }

    /// The colliders; `ColliderId` is the index.
    pub fn colliders(&self) -> &[Collider] {
        &self.colliders
    }

    /// A link.
    pub fn body(&self, id: BodyId) -> &Body {
        &self.bodies[id.index()]
    }

    /// A point body.
    pub fn point(&self, id: PointId) -> &PointBody {
        &self.points[id.index()]
    }

    /// A collider.
    pub fn collider(&self, id: ColliderId) -> &Collider {
        &self.colliders[id.index()]
    }

    /// Ids of all links, parents first.
    pub fn body_ids(&self) -> impl DoubleEndedIterator<Item = BodyId> + use<> {
        (0..self.bodies.len() as u32).map(BodyId)
    }

    /// Range of the joint of the link with an index in v.
    pub(crate) fn dof_range(&self, index: usize) -> Range<usize> {
        self.v_start[index]..self.v_start[index + 1]
    }

    /// Range of a link's joint in v.
    pub fn dofs(&self, id: BodyId) -> Range<usize> {
        self.dof_range(id.index())
    }

    /// Range of a link's joint in q.
    pub fn qs(&self, id: BodyId) -> Range<usize> {
        self.q_start[id.index()]..self.q_start[id.index() + 1]
    }

    /// True if some joint between a link and the world can move.
    pub fn is_movable(&self, id: BodyId) -> bool {
        self.movable[id.index()]
    }

    /// The link whose joint has a degree of freedom.
    pub fn body_of_dof(&self, dof: usize) -> BodyId {
        BodyId(self.v_start.partition_point(|&start| start <= dof) as u32 - 1)
    }
}
