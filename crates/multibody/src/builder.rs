//! Collects and checks the parts of a [`Model`].

use std::collections::BTreeMap;

use orchard_geometry::{Pose, Shape, Vec3};

use crate::model::{
    Body, BodyId, Collider, ColliderId, Coupling, JointKind, Model, Owner, PointBody, PointId,
    SpatialInertia, Tether,
};
use crate::schedule::{runs, schedule};
use crate::{Data, aba, forward_kinematics};

/// Asymmetry and negative eigenvalues of an inertia matrix that pass as round-off, relative to its norm.
const INERTIA_TOLERANCE: f64 = 1e-9;
/// Error of the length of a unit vector or quaternion that passes as round-off.
const UNIT_TOLERANCE: f64 = 1e-9;

/// Why a model cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ModelError {
    /// The parent of a link does not come before it.
    #[error("body {body}: parent {parent} does not come before it")]
    Parent {
        /// The link.
        body: usize,
        /// The parent that it names.
        parent: usize,
    },
    /// A number is not finite or out of its range.
    #[error("{what} {index}: {problem}")]
    Value {
        /// Kind of part: body, point, coupling or collider.
        what: &'static str,
        /// Index of the part.
        index: usize,
        /// Problem found.
        problem: &'static str,
    },
    /// A part names a link, point body or degree of freedom that does not exist.
    #[error("{what} {index}: names {target} {id}, which does not exist")]
    Reference {
        /// Kind of part: point, coupling or collider.
        what: &'static str,
        /// Index of the part.
        index: usize,
        /// Kind of part that it names.
        target: &'static str,
        /// The id that it names.
        id: usize,
    },
    /// A joint has a degree of freedom without inertia, at the zero pose.
    #[error("body {body}: its joint has a degree of freedom without inertia")]
    Singular {
        /// The link.
        body: usize,
    },
}

/// Collects bodies, point bodies, couplings and colliders, then builds a [`Model`].
#[derive(Debug, Clone, Default)]
pub struct ModelBuilder {
    bodies: Vec<Body>,
    points: Vec<PointBody>,
    couplings: Vec<Coupling>,
    colliders: Vec<Collider>,
}

impl ModelBuilder {
    /// An empty builder.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a link; its parent must have been added before.
    pub fn add_body(&mut self, body: Body) -> BodyId {
        self.bodies.push(body);
        BodyId(self.bodies.len() as u32 - 1)
    }

    /// Adds a point body.
    pub fn add_point(&mut self, point: PointBody) -> PointId {
        self.points.push(point);
        PointId(self.points.len() as u32 - 1)
    }

    /// Adds a coupling of two degrees of freedom.
    pub fn add_coupling(&mut self, coupling: Coupling) {
        self.couplings.push(coupling);
    }

    /// Adds a collider.
    pub fn add_collider(&mut self, collider: Collider) -> ColliderId {
        self.colliders.push(collider);
        ColliderId(self.colliders.len() as u32 - 1)
    }

    /// Degrees of freedom of the links added so far: the next link's first index into v.
    pub fn nv(&self) -> usize {
        self.bodies.iter().map(|body| body.joint.nv()).sum()
    }

    /// Checks every part and builds the model.
    ///
    /// # Errors
    /// A [`ModelError`] that names the first part that cannot be simulated.
    pub fn build(self) -> Result<Model, ModelError> {
        let mut q_start = vec![0];
        let mut v_start = vec![0];
        let mut movable: Vec<bool> = Vec::with_capacity(self.bodies.len());
        for (index, body) in self.bodies.iter().enumerate() {
            if let Some(parent) = body.parent
                && parent.index() >= index
            {
                return Err(ModelError::Parent { body: index, parent: parent.index() });
            }
            let value = |problem| ModelError::Value { what: "body", index, problem };
            check_pose(&body.x_parent_joint).map_err(value)?;
            check_axis(&body.joint).map_err(value)?;
            check_inertia(&body.inertia).map_err(value)?;
            movable.push(body.joint.nv() > 0 || body.parent.is_some_and(|parent| movable[parent.index()]));
            q_start.push(q_start[index] + body.joint.nq());
            v_start.push(v_start[index] + body.joint.nv());
        }
        let (bodies, points, nv) = (self.bodies.len(), self.points.len(), v_start[self.bodies.len()]);
        for (index, point) in self.points.iter().enumerate() {
            check_point(point).map_err(|problem| ModelError::Value { what: "point", index, problem })?;
            if let Some(tether) = &point.tether {
                check_id("point", index, "body", tether.body.index(), bodies)?;
            }
        }
        for (index, coupling) in self.couplings.iter().enumerate() {
            check_coupling(coupling).map_err(|problem| ModelError::Value {
                what: "coupling",
                index,
                problem,
            })?;
            for dof in [coupling.dof_a, coupling.dof_b] {
                check_id("coupling", index, "degree of freedom", dof, nv)?;
                if self.bodies[v_start.partition_point(|&start| start <= dof) - 1].joint.has_quaternion() {
                    let problem =
                        "it couples a free or ball joint, which has no coordinate for each velocity";
                    return Err(ModelError::Value { what: "coupling", index, problem });
                }
            }
        }
        for (index, collider) in self.colliders.iter().enumerate() {
            check_collider(collider).map_err(|problem| ModelError::Value {
                what: "collider",
                index,
                problem,
            })?;
            match collider.owner {
                Owner::World => {}
                Owner::Body(id) => check_id("collider", index, "body", id.index(), bodies)?,
                Owner::Point(id) => check_id("collider", index, "point", id.index(), points)?,
            }
        }
        let turning =
            (0..bodies as u32).map(BodyId).filter(|id| self.bodies[id.index()].joint.has_quaternion());
        let turning = turning.collect();
        let (schedule, runs) = (schedule(&self.bodies), runs(&self.bodies));
        let model = Model {
            overlaps: BTreeMap::new(),
            bodies: self.bodies,
            points: self.points,
            couplings: self.couplings,
            colliders: self.colliders,
            q_start,
            v_start,
            movable,
            turning,
            runs,
            schedule,
        };
        check_regular(&model)?;
        Ok(model)
    }
}

fn check_id(
    what: &'static str,
    index: usize,
    target: &'static str,
    id: usize,
    count: usize,
) -> Result<(), ModelError> {
    if id < count { Ok(()) } else { Err(ModelError::Reference { what, index, target, id }) }
}

fn is_finite(v: &Vec3) -> bool {
    v.iter().all(|x| x.is_finite())
}

fn is_non_negative(x: f64) -> bool {
    x.is_finite() && x >= 0.0
}

/// True if a length is 1 to round-off; NaN is not.
fn is_unit(length: f64) -> bool {
    (length - 1.0).abs() < UNIT_TOLERANCE
}

fn check_pose(pose: &Pose) -> Result<(), &'static str> {
    if is_finite(&pose.translation.vector) && is_unit(pose.rotation.as_ref().norm()) {
        Ok(())
    } else {
        Err("its pose is not finite or its quaternion not of unit length")
    }
}

fn check_axis(joint: &JointKind) -> Result<(), &'static str> {
    match joint {
        JointKind::Hinge(axis) | JointKind::Slide(axis) if !is_unit(axis.norm()) => {
            Err("its joint axis is not of unit length")
        }
        _ => Ok(()),
    }
}

fn check_inertia(inertia: &SpatialInertia) -> Result<(), &'static str> {
    let i_com = &inertia.i_com;
    if !is_non_negative(inertia.mass) {
        return Err("its mass is negative or not finite");
    }
    if !is_finite(&inertia.p_com) || !i_com.iter().all(|x| x.is_finite()) {
        return Err("its inertia is not finite");
    }
    let tolerance = INERTIA_TOLERANCE * i_com.norm();
    if (i_com - i_com.transpose()).norm() > tolerance {
        return Err("its inertia matrix is not symmetric");
    }
    if i_com.symmetric_eigenvalues().min() < -tolerance {
        return Err("its inertia matrix is not positive semi-definite");
    }
    Ok(())
}

fn check_point(point: &PointBody) -> Result<(), &'static str> {
    if !(point.mass.is_finite() && point.mass > 0.0) {
        return Err("its mass is not positive");
    }
    if point.spin_inertia.is_nan() || point.spin_inertia <= 0.0 {
        return Err("its spin inertia is not positive");
    }
    point.tether.as_ref().map_or(Ok(()), check_tether)
}

fn check_tether(tether: &Tether) -> Result<(), &'static str> {
    if ![tether.p_body, tether.offset_world, tether.anchor_bias_world].iter().all(is_finite) {
        return Err("its tether's geometry or bias is not finite");
    }
    if !is_non_negative(tether.stiffness) || !is_non_negative(tether.damping) {
        return Err("its tether's stiffness or damping is negative or not finite");
    }
    if tether.reaction_cap.is_nan() || tether.reaction_cap < 0.0 {
        return Err("its tether's reaction cap is negative");
    }
    if tether.turns && tether.reaction_cap.is_finite() {
        return Err(
            "its tether turns with the link and has a reaction cap, which only a point on a string has",
        );
    }
    Ok(())
}

fn check_coupling(coupling: &Coupling) -> Result<(), &'static str> {
    if !coupling.ratio.is_finite() {
        return Err("its ratio is not finite");
    }
    if !is_non_negative(coupling.stiffness) || !is_non_negative(coupling.damping) {
        return Err("its stiffness or damping is negative or not finite");
    }
    Ok(())
}

fn check_collider(collider: &Collider) -> Result<(), &'static str> {
    check_pose(&collider.x_owner_shape)?;
    if !is_non_negative(collider.friction) {
        return Err("its friction is negative or not finite");
    }
    if collider.stiffness.is_nan() || collider.stiffness <= 0.0 {
        return Err("its stiffness is not positive");
    }
    let size_is_good = match collider.shape {
        Shape::Sphere { radius } => radius.is_finite() && radius > 0.0,
        Shape::Capsule { radius, length } => radius.is_finite() && radius > 0.0 && is_non_negative(length),
        Shape::Box { half } => half.iter().all(|x| x.is_finite() && *x > 0.0),
        // Hulls and fields are checked when they are made.
        Shape::HalfSpace | Shape::ConvexHull(_) | Shape::HeightField(_) => true,
    };
    if size_is_good { Ok(()) } else { Err("its shape has a bad size") }
}

/// Factors the bare inertia at the zero pose: a pivot of zero is a joint that moves no inertia.
fn check_regular(model: &Model) -> Result<(), ModelError> {
    let mut data = Data::new(model);
    data.tethered.fill(false);
    forward_kinematics(model, &mut data);
    aba::factor(model, &mut data, 0.0);
    match data.factor.singular {
        Some(body) => Err(ModelError::Singular { body: body.index() }),
        None => Ok(()),
    }
}
