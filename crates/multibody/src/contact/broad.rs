//! Broad phase: which pairs of colliders may touch in this step.

use orchard_geometry::{Aabb, Pose, Vec3};

use super::x_world_shape;
use crate::data::Data;
use crate::model::{ColliderId, Groups, Model, Owner};

/// Colliders of the same groups, with their common bounding box.
#[derive(Debug, Clone)]
struct Cluster {
    groups: Groups,
    members: Vec<ColliderId>,
    aabb: Aabb,
}

/// Candidate pairs, and buffers to find them.
#[derive(Debug, Clone, Default)]
pub(super) struct BroadPhase {
    /// Pairs (a, b), a < b, in ascending order.
    pub pairs: Vec<(ColliderId, ColliderId)>,
    /// The groups that the clusters were made for.
    groups: Vec<Groups>,
    clusters: Vec<Cluster>,
    poses: Vec<Pose>,
    boxes: Vec<Aabb>,
    near: [Vec<ColliderId>; 2],
}

const EMPTY: Aabb = Aabb {
    min: Vec3::new(f64::INFINITY, f64::INFINITY, f64::INFINITY),
    max: Vec3::new(f64::NEG_INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY),
};

impl BroadPhase {
    /// Pose in the world of a collider that is in a pair.
    pub fn pose(&self, id: ColliderId) -> &Pose {
        &self.poses[id.index()]
    }

    /// Finds the pairs whose bounding boxes come within `margin`.
    pub fn find_pairs(&mut self, model: &Model, data: &Data, margin: f64) {
        self.pairs.clear();
        if self.groups != data.groups || self.poses.len() != model.colliders.len() {
            self.cluster(model, data);
        }
        for cluster in &mut self.clusters {
            cluster.aabb = EMPTY;
            for id in &cluster.members {
                let collider = model.collider(*id);
                let pose = x_world_shape(&data.kinematics, &data.point_p_world, collider);
                // Half the margin on each side of a pair.
                let aabb = collider.shape.aabb(&pose).grown(0.5 * margin);
                self.poses[id.index()] = pose;
                self.boxes[id.index()] = aabb;
                cluster.aabb = cluster.aabb.union(&aabb);
            }
        }
        for (index, one) in self.clusters.iter().enumerate() {
            for other in &self.clusters[index..] {
                if !one.groups.may_touch(other.groups) || !one.aabb.overlaps(&other.aabb) {
                    continue;
                }
                for (near, (cluster, partner)) in self.near.iter_mut().zip([(one, other), (other, one)]) {
                    near.clear();
                    let reaches = |id: &&ColliderId| self.boxes[id.index()].overlaps(&partner.aabb);
                    near.extend(cluster.members.iter().filter(reaches));
                }
                let is_same = std::ptr::eq(one, other);
                for &a in &self.near[0] {
                    for &b in &self.near[1] {
                        if (is_same && b <= a) || !self.boxes[a.index()].overlaps(&self.boxes[b.index()]) {
                            continue;
                        }
                        if can_respond(model, a, b) {
                            self.pairs.push((a.min(b), a.max(b)));
                        }
                    }
                }
            }
        }
        self.pairs.sort_unstable();
    }

    /// Sorts the colliders by their groups; those that may touch nothing are left out.
    fn cluster(&mut self, model: &Model, data: &Data) {
        self.groups.clone_from(&data.groups);
        self.poses.resize(model.colliders.len(), Pose::identity());
        self.boxes.resize(model.colliders.len(), EMPTY);
        self.clusters.clear();
        for (index, &groups) in data.groups.iter().enumerate() {
            if !data.groups.iter().any(|&other| groups.may_touch(other)) {
                continue;
            }
            let id = ColliderId(index as u32);
            match self.clusters.iter_mut().find(|cluster| cluster.groups == groups) {
                Some(cluster) => cluster.members.push(id),
                None => self.clusters.push(Cluster { groups, members: vec![id], aabb: EMPTY }),
            }
        }
    }
}

/// Whether a contact of two colliders could change a velocity: different owners, and one of them movable.
fn can_respond(model: &Model, a: ColliderId, b: ColliderId) -> bool {
    let (owner_a, owner_b) = (model.collider(a).owner, model.collider(b).owner);
    let is_movable = |owner| match owner {
        Owner::World => false,
        Owner::Body(id) => model.is_movable(id),
        Owner::Point(_) => true,
    };
    owner_a != owner_b && (is_movable(owner_a) || is_movable(owner_b))
}
