//! Conversion of a skeleton to links of a multibody model.

use crate::{section, stiffness};
use orchard_geometry::{Pose, Shape, Vec3};
use orchard_multibody::{
    Body, BodyId, Collider, ColliderId, Data, Groups, JointKind, Model, ModelBuilder, Owner,
};
use orchard_spec::wood::WoodSpec;
use orchard_treegen::Skeleton;

/// Collision groups of live wood and of broken sub-trees.
#[derive(Debug, Clone, Copy)]
pub struct TreeGroups {
    /// Live wood.
    pub wood: Groups,
    /// Broken sub-trees.
    pub debris: Groups,
}

/// The links of one tree in a model, with the constants of their joints. Arrays are per segment.
#[derive(Debug, Clone)]
pub struct TreeBody {
    /// Link of each segment.
    pub bodies: Vec<BodyId>,
    /// Collider of each segment.
    pub colliders: Vec<ColliderId>,
    /// Parent segment.
    pub parent: Vec<Option<usize>>,
    /// Bending stiffness Kp of the joint at the segment's base [N m/rad].
    pub stiffness: Vec<f64>,
    /// Bending damping Kd [N m s/rad].
    pub damping: Vec<f64>,
    /// Rupture moment of the joint at the segment's base [N m].
    pub rupture_moment: Vec<f64>,
    /// Collision groups.
    pub groups: TreeGroups,
}

impl TreeBody {
    /// Adds one link a segment to the model. Every joint, the trunk base included, bends about two axes (none in
    /// the rigid mode); its
    /// placement reproduces the skeleton at q = 0.
    pub fn add_to(
        builder: &mut ModelBuilder,
        skeleton: &Skeleton,
        wood: &WoodSpec,
        groups: TreeGroups,
    ) -> Self {
        let n = skeleton.segments.len();
        let mut tree = Self {
            bodies: Vec::with_capacity(n),
            colliders: Vec::with_capacity(n),
            parent: skeleton.segments.iter().map(|s| s.parent).collect(),
            stiffness: Vec::with_capacity(n),
            damping: Vec::with_capacity(n),
            rupture_moment: Vec::with_capacity(n),
            groups,
        };
        let (stiffness_min, stiffness_max) = (wood.stiffness_min.si(), wood.stiffness_max.si());
        for (index, segment) in skeleton.segments.iter().enumerate() {
            let x_parent_joint = match segment.parent {
                None => segment.x_world_segment(),
                Some(p) => {
                    let parent = &skeleton.segments[p];
                    Pose::from_parts(
                        Vec3::new(0.0, 0.0, parent.length).into(),
                        parent.r_world_segment.inverse() * segment.r_world_segment,
                    )
                }
            };
            let body = builder.add_body(Body {
                parent: segment.parent.map(|p| tree.bodies[p]),
                joint: if wood.rigid { JointKind::Weld } else { JointKind::Universal },
                x_parent_joint,
                inertia: section::capsule_inertia(wood.density.si(), segment.radius, segment.length),
            });
            let stiffness = stiffness::of_joint(skeleton, index, wood).clamp(stiffness_min, stiffness_max);
            tree.colliders.push(builder.add_collider(Collider {
                owner: Owner::Body(body),
                shape: Shape::Capsule { radius: segment.radius, length: segment.length },
                x_owner_shape: Pose::identity(),
                groups: groups.wood,
                friction: wood.friction.si(),
                stiffness: wood.contact_stiffness.si(),
            }));
            tree.bodies.push(body);
            tree.stiffness.push(stiffness);
            tree.damping.push(wood.damping_time.si() * stiffness);
            tree.rupture_moment.push(section::rupture_moment(wood.rupture_stress.si(), segment.radius));
        }
        tree
    }

    /// Number of segments.
    pub fn len(&self) -> usize {
        self.bodies.len()
    }

    /// True if the tree has no segment.
    pub fn is_empty(&self) -> bool {
        self.bodies.is_empty()
    }

    /// Writes the unbroken tree's springs, dampers and drag into the inputs of the next step.
    pub fn reset(&self, model: &Model, data: &mut Data, wood: &WoodSpec) {
        for (i, &body) in self.bodies.iter().enumerate() {
            for dof in model.dofs(body) {
                data.stiffness[dof] = self.stiffness[i];
                data.damping[dof] = self.damping[i];
                data.rest[dof] = 0.0;
            }
            data.linear_drag[body.index()] = wood.linear_drag.si();
            data.angular_drag[body.index()] = wood.angular_drag.si();
            data.groups[self.colliders[i].index()] = self.groups.wood;
        }
    }

    /// Bending angle |theta| of a segment's joint \[rad\].
    pub fn bending_angle(&self, model: &Model, data: &Data, segment: usize) -> f64 {
        let dofs = model.qs(self.bodies[segment]);
        data.q[dofs].iter().map(|q| q * q).sum::<f64>().sqrt()
    }

    /// Segments of the sub-tree that starts at `root`, in index order.
    pub fn subtree(&self, root: usize) -> Vec<usize> {
        let mut inside = vec![false; self.len()];
        inside[root] = true;
        let mut members = vec![root];
        for i in root + 1..self.len() {
            if self.parent[i].is_some_and(|p| inside[p]) {
                inside[i] = true;
                members.push(i);
            }
        }
        members
    }
}
