//! Breaking: hysteresis on the bending moment, a free hinge in place, friction that ramps up until it seizes.

use crate::TreeBody;
use orchard_geometry::{Vec3, transform};
use orchard_multibody::{Data, Model};
use orchard_spec::wood::WoodSpec;
use serde::{Deserialize, Serialize};

/// A joint that has broken.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Break {
    /// Segment whose base joint broke.
    pub segment: usize,
    /// Time since it broke \[s\].
    pub age: f64,
    /// Friction moment at the break before the ramp [N m].
    pub friction: f64,
    /// Residual viscous damping [N m s/rad].
    pub residual_damping: f64,
    /// Inertia of the sub-tree about the joint when it broke [kg m^2].
    pub inertia: f64,
    /// Rate of the joint at the start of the latest substep [rad/s].
    pub rate: f64,
}

/// Rupture state of one tree.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Rupture {
    frames_over: Vec<u32>,
    debris: Vec<bool>,
    breaks: Vec<Break>,
    peak_ratio: f64,
}

impl Rupture {
    /// An unbroken tree.
    pub fn new(tree: &TreeBody) -> Self {
        Self {
            frames_over: vec![0; tree.len()],
            debris: vec![false; tree.len()],
            breaks: Vec::new(),
            peak_ratio: 0.0,
        }
    }

    /// True if this is the state of a tree with as many segments.
    pub fn fits(&self, tree: &TreeBody) -> bool {
        let Self { frames_over, debris, breaks, peak_ratio: _ } = self;
        frames_over.len() == tree.len()
            && debris.len() == tree.len()
            && breaks.iter().all(|b| b.segment < tree.len())
    }

    /// The joints that broke, in the order in which they did.
    pub fn breaks(&self) -> &[Break] {
        &self.breaks
    }

    /// True if a segment belongs to a broken sub-tree.
    pub fn is_debris(&self, segment: usize) -> bool {
        self.debris[segment]
    }

    /// True if no joint has broken or counts frames over its rupture moment.
    pub fn is_calm(&self) -> bool {
        self.breaks.is_empty() && self.frames_over.iter().all(|frames| *frames == 0)
    }

    /// Largest |M| / M_max of any live joint so far.
    pub fn peak_ratio(&self) -> f64 {
        self.peak_ratio
    }

    /// Removes applied forces from broken sub-trees, and sets the dampers of broken joints for the next substep: the residual damper, and Coulomb friction of the
    /// ramped moment tau as the secant damper tau / omega, which the step takes implicitly, so that it
    /// dissipates at any rate and on any axis, however little inertia that axis has. omega is the rate expected at the end of
    /// the substep, by extrapolation, and at least `friction_regularisation`. A brake that grows with the fourth
    /// power of the rate keeps whipping twigs about the configured limit, against the joint before them; a falling
    /// limb does not feel it. The step stays bounded at any rate without it (decision 10).
    ///
    /// If the dampers hold modal ratios, the springs are first led by the present rates, see [`TreeBody::lead_springs`].
    pub fn begin_substep(
        &mut self,
        tree: &TreeBody,
        model: &Model,
        data: &mut Data,
        wood: &WoodSpec,
        substep: f64,
    ) {
        if tree.is_modal {
            tree.lead_springs(model, data, substep);
        }
        if !self.breaks.is_empty() {
            for (body, _) in tree.bodies.iter().zip(&self.debris).filter(|(_, debris)| **debris) {
                data.body_force_world[body.index()] = Vec3::zeros();
                data.body_torque_world[body.index()] = Vec3::zeros();
            }
        }
        let ramp_time = wood.broken_friction_ramp_time.si();
        let slow = wood.friction_regularisation.si();
        for b in &mut self.breaks {
            let ramp = if ramp_time > 0.0 { (b.age / ramp_time).min(1.0) } else { 1.0 };
            let moment = b.friction * (1.0 + (wood.broken_friction_ramp.si() - 1.0) * ramp);
            let dofs = model.dofs(tree.bodies[b.segment]);
            let rate = joint_rate(tree, model, data, b.segment);
            let expected = rate + (rate - b.rate).max(0.0);
            let speeding = expected / wood.broken_rate_limit.si();
            let brake = wood.broken_rate_brake.si() * b.inertia * speeding * speeding * speeding * speeding;
            let damping = b.residual_damping + brake + moment / expected.max(slow);
            data.damping[dofs].fill(damping);
            b.rate = rate;
            b.age += substep;
        }
    }

    /// Counts some time whose motion was computed elsewhere, by the law of [`Self::begin_substep`]; the state is that at its end. The next substep takes a broken joint's rate as it is then, without
    /// extrapolation.
    pub fn pass(&mut self, tree: &TreeBody, model: &Model, data: &Data, time: f64) {
        for b in &mut self.breaks {
            b.age += time;
            b.rate = joint_rate(tree, model, data, b.segment);
        }
    }

    /// Tests every live joint once a frame and breaks those that were over their rupture moment for the
    /// configured number of frames in a row. The moment is the quasi-static one, Kp |theta|: the damper's
    /// share of a whip is left out. Returns the segments whose base joint broke.
    pub fn end_frame(
        &mut self,
        tree: &TreeBody,
        model: &Model,
        data: &mut Data,
        wood: &WoodSpec,
        gravity: f64,
    ) -> Vec<usize> {
        let mut broken = Vec::new();
        for i in 0..tree.len() {
            // The root's joint models the soil's grip on the trunk: it bends and cannot break.
            if self.debris[i] || tree.parent[i].is_none() {
                continue;
            }
            let ratio = tree.stiffness[i] * tree.bending_angle(model, data, i) / tree.rupture_moment[i];
            self.peak_ratio = self.peak_ratio.max(ratio);
            self.frames_over[i] = if ratio > 1.0 { self.frames_over[i] + 1 } else { 0 };
            if self.frames_over[i] >= wood.rupture_frames.get() {
                self.break_joint(tree, model, data, wood, gravity, i);
                broken.push(i);
            }
        }
        broken
    }

    /// Breaks a joint in place: spring and damper go, the sub-tree becomes debris with less drag. Its fruit
    /// count towards its gravity moment and inertia.
    pub fn break_joint(
        &mut self,
        tree: &TreeBody,
        model: &Model,
        data: &mut Data,
        wood: &WoodSpec,
        gravity: f64,
        segment: usize,
    ) {
        let members = tree.subtree(segment);
        let p_joint = data.x_world_body(tree.bodies[segment]).translation.vector;
        let (mut first_moment, mut inertia) = (Vec3::zeros(), 0.0);
        for &i in &members {
            let body = tree.bodies[i];
            let link = &model.body(body).inertia;
            let arm = transform(data.x_world_body(body), &link.p_com) - p_joint;
            first_moment += arm * link.mass;
            inertia += link.mass * arm.norm_squared() + link.i_com.trace() / 3.0;
            for (index, point) in model.points().iter().enumerate() {
                let hangs_here = |link| link == body || model.body(link).parent == Some(body);
                let tether = point.tether.as_ref().filter(|_| data.tethered[index]);
                if tether.is_some_and(|t| if t.turns { hangs_here(t.body) } else { t.body == body }) {
                    let arm = data.point_p_world[index] - p_joint;
                    first_moment += arm * point.mass;
                    inertia += point.mass * arm.norm_squared();
                }
            }
            self.debris[i] = true;
            data.linear_drag[body.index()] = wood.linear_drag.si() * wood.broken_linear_drag_scale.si();
            data.angular_drag[body.index()] = wood.angular_drag.si() * wood.broken_angular_drag_scale.si();
            data.groups[tree.colliders[i].index()] = tree.groups.debris;
        }
        for dof in model.dofs(tree.bodies[segment]) {
            data.stiffness[dof] = 0.0;
        }
        self.breaks.push(Break {
            segment,
            age: 0.0,
            friction: wood.broken_friction_ratio.si() * gravity * first_moment.norm(),
            residual_damping: (wood.broken_residual_damping.si() * inertia)
                .min(wood.broken_residual_damping_max.si()),
            inertia,
            rate: 0.0,
        });
    }
}

/// Rate of a segment's joint [rad/s].
fn joint_rate(tree: &TreeBody, model: &Model, data: &Data, segment: usize) -> f64 {
    data.v[model.dofs(tree.bodies[segment])].iter().map(|v| v * v).sum::<f64>().sqrt()
}
