//! Broad phase: finds the pairs of colliders that may touch in this step.

use orchard_geometry::{Aabb, Pose, Vec3, transform};

use super::x_world_shape;
use crate::kinematics::Kinematics;
use crate::model::{Collider, ColliderId, Groups, Model, Owner};

/// Colliders of the same groups, with their common bounding box.
#[derive(Debug, Clone)]
struct Cluster {
    groups: Groups,
    members: Vec<ColliderId>,
    aabb: Aabb,
}

/// A sphere on the owner of a collider.
#[derive(Debug, Clone, Copy)]
struct Sphere {
    p_owner: Vec3,
    radius: f64,
}

impl Sphere {
    fn about(collider: &Collider) -> Option<Sphere> {
        let Aabb { min, max } = collider.shape.aabb(&Pose::identity());
        let sphere = Sphere {
            p_owner: transform(&collider.x_owner_shape, &(0.5 * (min + max))),
            radius: 0.5 * (max - min).norm(),
        };
        sphere.radius.is_finite().then_some(sphere)
    }

    fn aabb(&self, kinematics: &Kinematics, point_p_world: &[Vec3], owner: Owner) -> Aabb {
        let p_world = match owner {
            Owner::World => self.p_owner,
            Owner::Body(id) => {
                let link = &kinematics.links[id.index()];
                link.origin() + link.turned(&self.p_owner)
            }
            Owner::Point(id) => point_p_world[id.index()] + self.p_owner,
        };
        Aabb { min: p_world, max: p_world }.grown(self.radius)
    }
}

/// Candidate pairs, and buffers to find them.
#[derive(Debug, Clone, Default)]
pub(super) struct BroadPhase {
    /// Pairs (a, b), a < b, in ascending order.
    pub pairs: Vec<(ColliderId, ColliderId)>,
    /// The groups that the clusters were made for.
    groups: Vec<Groups>,
    clusters: Vec<Cluster>,
    /// Box around each collider; `None` for unbounded shapes.
    spheres: Vec<Option<Sphere>>,
    /// Poses of the colliders that were placed in this search.
    poses: Vec<Pose>,
    is_placed: Vec<bool>,
    /// Bounding boxes, of the sphere until the collider is placed.
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

    /// Finds the pairs whose bounding boxes are less apart than the sum of the colliders' reaches.
    pub fn find_pairs(
        &mut self,
        model: &Model,
        kinematics: &Kinematics,
        point_p_world: &[Vec3],
        groups: &[Groups],
        reach: impl Fn(ColliderId) -> f64,
    ) {
        self.pairs.clear();
        if self.groups != groups || self.poses.len() != model.colliders.len() {
            self.cluster(model, groups);
        }
        let BroadPhase { pairs, clusters, spheres, poses, is_placed, boxes, near, .. } = self;
        is_placed.fill(false);
        let mut place = |id: ColliderId, boxes: &mut [Aabb]| {
            if !std::mem::replace(&mut is_placed[id.index()], true) {
                let collider = model.collider(id);
                let pose = x_world_shape(kinematics, point_p_world, collider);
                boxes[id.index()] = collider.shape.aabb(&pose).grown(reach(id));
                poses[id.index()] = pose;
            }
        };
        for cluster in &mut *clusters {
            cluster.aabb = EMPTY;
            for &id in &cluster.members {
                match &spheres[id.index()] {
                    Some(sphere) => {
                        boxes[id.index()] =
                            sphere.aabb(kinematics, point_p_world, model.collider(id).owner).grown(reach(id));
                    }
                    None => place(id, boxes),
                }
                cluster.aabb = cluster.aabb.union(&boxes[id.index()]);
            }
        }
        for (index, one) in clusters.iter().enumerate() {
            for other in &clusters[index..] {
                if !one.groups.may_touch(other.groups) || !one.aabb.overlaps(&other.aabb) {
                    continue;
                }
                // The fewer first: their own boxes are tight.
                let (few, many) =
                    if one.members.len() <= other.members.len() { (one, other) } else { (other, one) };
                let mut partner = many.aabb;
                for (near, cluster) in near.iter_mut().zip([few, many]) {
                    near.clear();
                    let reaches = |id: &&ColliderId| boxes[id.index()].overlaps(&partner);
                    near.extend(cluster.members.iter().filter(reaches));
                    near.iter().for_each(|&id| place(id, boxes));
                    partner = near.iter().fold(EMPTY, |all, id| all.union(&boxes[id.index()]));
                }
                let is_same = std::ptr::eq(one, other);
                for &a in &near[0] {
                    for &b in &near[1] {
                        if (is_same && b <= a) || !boxes[a.index()].overlaps(&boxes[b.index()]) {
                            continue;
                        }
                        if can_respond(model, a, b) {
                            pairs.push((a.min(b), a.max(b)));
                        }
                    }
                }
            }
        }
        pairs.sort_unstable();
    }

    /// Sorts the colliders by their groups; those that may touch no other are left out.
    fn cluster(&mut self, model: &Model, all: &[Groups]) {
        self.groups.clear();
        self.groups.extend_from_slice(all);
        self.poses.resize(model.colliders.len(), Pose::identity());
        self.is_placed.resize(model.colliders.len(), false);
        self.boxes.resize(model.colliders.len(), EMPTY);
        self.spheres.clear();
        self.spheres.extend(model.colliders.iter().map(Sphere::about));
        self.clusters.clear();
        for (index, &groups) in all.iter().enumerate() {
            if !all.iter().any(|&other| groups.may_touch(other)) {
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

/// True if a contact of two colliders could change a velocity: different owners, and one of them movable.
fn can_respond(model: &Model, a: ColliderId, b: ColliderId) -> bool {
    let (owner_a, owner_b) = (model.collider(a).owner, model.collider(b).owner);
    let is_movable = |owner| match owner {
        Owner::World => false,
        Owner::Body(id) => model.is_movable(id),
        Owner::Point(_) => true,
    };
    owner_a != owner_b && (is_movable(owner_a) || is_movable(owner_b))
}
