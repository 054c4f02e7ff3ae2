//! Conversion of a skeleton to links of a multibody model.

use crate::{Timber, section, stiffness, subtree, sway};
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
    /// Rupture moment of the joint at the segment's base [N m]: that of the section, or of the union with the parent where it is weaker.
    pub rupture_moment: Vec<f64>,
    /// True where the union with the parent is weaker than the section.
    pub union_fails: Vec<bool>,
    /// True if the dampers hold damping ratios: the springs then act without the numerical damping of the step ([`crate::Rupture::begin_substep`]).
    pub is_modal: bool,
    /// Collision groups.
    pub groups: TreeGroups,
}

impl TreeBody {
    /// Adds one link a segment to the model, of the mean wood. Every joint, the trunk base included, bends about two axes (none in
    /// the rigid mode); its
    /// placement reproduces the skeleton at q = 0.
    pub fn add_to(
        builder: &mut ModelBuilder,
        skeleton: &Skeleton,
        wood: &WoodSpec,
        groups: TreeGroups,
    ) -> Self {
        Self::of_timber(builder, skeleton, wood, &Timber::mean(skeleton, wood), groups)
    }

    /// Adds the links as [`Self::add_to`] does, of given wood.
    pub fn of_timber(
        builder: &mut ModelBuilder,
        skeleton: &Skeleton,
        wood: &WoodSpec,
        timber: &Timber,
        groups: TreeGroups,
    ) -> Self {
        let segments = &skeleton.segments;
        let (stiffness_min, stiffness_max) = (wood.stiffness_min.si(), wood.stiffness_max.si());
        let stiffness: Vec<f64> = (0..segments.len())
            .map(|i| stiffness::of_joint(skeleton, timber, i, wood).clamp(stiffness_min, stiffness_max))
            .collect();
        let inertia = sway::inertias(skeleton, &timber.density);
        let times = match &wood.modal_damping {
            Some(law) => sway::damping_times(skeleton, &inertia, &stiffness, law),
            None => vec![wood.damping_time.si(); segments.len()],
        };
        let union: Vec<f64> = (0..segments.len()).map(|i| union_strength(skeleton, i, wood)).collect();
        let mut tree = Self {
            bodies: Vec::with_capacity(segments.len()),
            colliders: Vec::with_capacity(segments.len()),
            parent: segments.iter().map(|s| s.parent).collect(),
            damping: times.iter().zip(&stiffness).map(|(time, stiffness)| time * stiffness).collect(),
            stiffness,
            rupture_moment: (segments.iter().zip(&timber.rupture_stress).zip(&union))
                .map(|((s, stress), union)| section::rupture_moment(*stress, s.radius) * union)
                .collect(),
            union_fails: union.iter().map(|&strength| strength < 1.0).collect(),
            is_modal: wood.modal_damping.is_some(),
            groups,
        };
        for (segment, inertia) in segments.iter().zip(inertia) {
            let x_parent_joint = match segment.parent {
                None => segment.x_world_segment(),
                Some(p) => {
                    let parent = &segments[p];
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
                inertia,
            });
            tree.colliders.push(builder.add_collider(Collider {
                owner: Owner::Body(body),
                shape: Shape::Capsule { radius: segment.radius, length: segment.length },
                x_owner_shape: Pose::identity(),
                groups: groups.wood,
                friction: wood.friction.si(),
                stiffness: wood.contact_stiffness.si(),
            }));
            tree.bodies.push(body);
        }
        tree
    }

    /// Raises the strength of joints that bear more than `wood.scatter.rest_load` of their rupture moment in the state of a tree at rest. Where no
    /// wood scatters, nothing changes.
    pub fn strengthen_to_stand(&mut self, model: &Model, data: &Data, wood: &WoodSpec) {
        let Some(scatter) = &wood.scatter else { return };
        // The trunk's base is held by the soil and does not break.
        for i in (0..self.len()).filter(|&i| self.parent[i].is_some()) {
            let least = self.stiffness[i] * self.bending_angle(model, data, i) / scatter.rest_load.si();
            self.rupture_moment[i] = self.rupture_moment[i].max(least);
        }
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

    /// Sets the angles at which the springs are at rest to `h v` for the next substep h of
    /// [`orchard_multibody::Integrator::LinearlyImplicitEuler`]. The step takes springs at `q + h v'`; less `h v` this is `q + h dv`, so that
    ///
    /// `(M + h D + h^2 K) dv = -h (K q + D v)`,  `q' = q + h v'`.
    ///
    /// Without dampers a mode then keeps its amplitude at any h: it turns by `cos(theta) = (1 + z^2 / 2) / (1 + z^2)` a substep, z = omega h.
    /// With `D = c K` its square shrinks by `(1 + z^2) / (1 + z^2 + c z^2 / h)`. Derived in docs/computation/dynamics.md.
    pub fn lead_springs(&self, model: &Model, data: &mut Data, h: f64) {
        for &body in &self.bodies {
            for dof in model.dofs(body) {
                data.rest[dof] = h * data.v[dof];
            }
        }
    }

    /// Bending angle |theta| of a segment's joint \[rad\].
    pub fn bending_angle(&self, model: &Model, data: &Data, segment: usize) -> f64 {
        let dofs = model.qs(self.bodies[segment]);
        data.q[dofs].iter().map(|q| q * q).sum::<f64>().sqrt()
    }

    /// Segments of the sub-tree that starts at `root`, in index order.
    pub fn subtree(&self, root: usize) -> Vec<usize> {
        subtree::members(&self.parent, root)
    }
}

/// Strength of the union at a segment's base over that of its section; 1 within an axis.
fn union_strength(skeleton: &Skeleton, index: usize, wood: &WoodSpec) -> f64 {
    let segment = &skeleton.segments[index];
    let bearer = segment.parent.map(|p| &skeleton.segments[p]).filter(|p| p.order != segment.order);
    match (&wood.union, bearer) {
        (Some(union), Some(bearer)) => union.strength(segment.radius / bearer.radius),
        _ => 1.0,
    }
}
