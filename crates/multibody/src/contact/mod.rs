//! Compliant, convex frictional contact: Castro, Permenter, Han, "An Unconstrained Convex Formulation of
//! Compliant Contact" (2022), solved in impulse space on the articulated-body factor.
//!
//! `broad` finds pairs of colliders, `narrow` their contact points, `delassus` how impulses at contacts
//! change velocities at contacts, `law` is the contact law, `newton` solves for the impulses.

mod broad;
mod delassus;
mod law;
mod narrow;
mod newton;

use orchard_geometry::{Mat3, Pose, Vec3};
use serde::{Deserialize, Serialize};

use crate::aba;
use crate::data::Data;
use crate::kinematics::Kinematics;
use crate::model::{Collider, ColliderId, Model, Owner};
use crate::spatial::Wrench;
use crate::step::{StepReport, StepSettings};
use broad::BroadPhase;
use delassus::{Delassus, Load};
use law::{Compliance, Law};
use narrow::{NarrowScratch, Touch};
use newton::Newton;

/// A contact of a step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ContactReport {
    /// First collider.
    pub a: ColliderId,
    /// Second collider.
    pub b: ColliderId,
    /// Where they touch [m], halfway between the surfaces.
    pub p_world: Vec3,
    /// Unit normal from b to a.
    pub n_world: Vec3,
    /// Distance of the surfaces at the start of the step [m]; negative while they overlap.
    pub gap: f64,
    /// Mean force on a over the step [N]; b feels the opposite.
    pub force_world: Vec3,
}

/// Three rows of the contact problem.
#[derive(Debug, Clone)]
pub(crate) struct Block {
    law: Law,
    /// Velocity of the rows before any contact impulse.
    v_free: Vec3,
    /// Impulse to start the solve from.
    guess: Vec3,
    /// Root mean square of the block's own inverse inertia [1/kg], which scales the residual.
    w: f64,
}

/// Buffers of the contact solve.
#[derive(Debug, Clone, Default)]
pub(crate) struct ContactScratch {
    broad: BroadPhase,
    narrow: NarrowScratch,
    touches: Vec<Touch>,
    /// Contact points with their contact frames (columns: two tangents, then the normal).
    contacts: Vec<(ContactReport, Mat3)>,
    /// Contacts of the last step, whose forces are the first guess of the next. They change how fast the
    /// solve converges, and its result only below its tolerance.
    last: Vec<ContactReport>,
    last_couplings: Vec<Vec3>,
    blocks: Vec<Block>,
    delassus: Delassus,
    newton: Newton,
}

/// Where the next contact solve starts from: all that outlives a step in [`ContactScratch`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct WarmStart {
    contacts: Vec<ContactReport>,
    couplings: Vec<Vec3>,
}

/// Pose of a collider in the world.
fn x_world_shape(kinematics: &Kinematics, point_p_world: &[Vec3], collider: &Collider) -> Pose {
    match collider.owner {
        Owner::World => collider.x_owner_shape,
        Owner::Body(id) => kinematics.links[id.index()].x_world_body * collider.x_owner_shape,
        Owner::Point(id) => {
            let mut pose = collider.x_owner_shape;
            pose.translation.vector += point_p_world[id.index()];
            pose
        }
    }
}

/// Two tangents and the normal as columns. The first tangent is square to the axis that the normal is least
/// along, so that the frame follows from the normal alone.
fn contact_frame(normal: &Vec3) -> Mat3 {
    let first = normal.cross(&Vec3::ith(normal.iamin(), 1.0)).normalize();
    Mat3::from_columns(&[first, normal.cross(&first), *normal])
}

/// Adds what contacts and couplings change to the free velocity change in `Data::change`.
pub(crate) fn solve_contacts(
    model: &Model,
    data: &mut Data,
    settings: &StepSettings,
    report: &mut StepReport,
) {
    let mut scratch = std::mem::take(&mut data.contact);
    report.contacts.clear();
    report.newton_iterations = 0;
    report.residual = 0.0;
    report.converged = true;
    scratch.collide(model, data, settings.contact_margin);
    scratch.assemble(model, data, settings);
    if !scratch.blocks.is_empty() {
        let outcome = scratch.newton.solve(&scratch.blocks, &scratch.delassus);
        report.newton_iterations = outcome.iterations;
        report.residual = outcome.residual;
        report.converged = outcome.converged;
        scratch.apply(model, data, settings.h, report);
    } else {
        scratch.last.clear();
    }
    data.contact = scratch;
}

impl ContactScratch {
    pub fn warm_start(&self) -> WarmStart {
        WarmStart { contacts: self.last.clone(), couplings: self.last_couplings.clone() }
    }

    pub fn set_warm_start(&mut self, warm_start: &WarmStart) {
        self.last.clone_from(&warm_start.contacts);
        self.last_couplings.clone_from(&warm_start.couplings);
    }

    /// Finds the contact points of this step.
    fn collide(&mut self, model: &Model, data: &Data, margin: f64) {
        self.contacts.clear();
        self.broad.find_pairs(model, data, margin);
        for &(a, b) in &self.broad.pairs {
            let (collider_a, collider_b) = (model.collider(a), model.collider(b));
            self.touches.clear();
            narrow::touches(
                (&collider_a.shape, self.broad.pose(a)),
                (&collider_b.shape, self.broad.pose(b)),
                margin,
                &mut self.narrow,
                &mut self.touches,
            );
            for touch in &self.touches {
                let report = ContactReport {
                    a,
                    b,
                    p_world: touch.p_world,
                    n_world: touch.n_world,
                    gap: touch.gap,
                    force_world: Vec3::zeros(),
                };
                self.contacts.push((report, contact_frame(&touch.n_world)));
            }
        }
    }

    /// Writes the blocks and their Delassus matrix: contacts first, then couplings.
    fn assemble(&mut self, model: &Model, data: &Data, settings: &StepSettings) {
        self.blocks.clear();
        self.delassus.clear();
        let mut last = self.last.iter().peekable();
        for (contact, frame) in &self.contacts {
            // Both lists are sorted by pair; the points of a pair are matched in their order.
            while last.next_if(|old| (old.a, old.b) < (contact.a, contact.b)).is_some() {}
            let guess = last.next_if(|old| (old.a, old.b) == (contact.a, contact.b));
            let mut v_free = Vec3::zeros();
            let mut loads = [Load::None, Load::None];
            for (load, (id, sign)) in loads.iter_mut().zip([(contact.a, 1.0), (contact.b, -1.0)]) {
                let owner = model.collider(id).owner;
                *load = contact_load(data, owner, &contact.p_world, &(frame * sign));
                v_free += frame.tr_mul(&(free_velocity(data, owner, &contact.p_world) * sign));
            }
            self.delassus.push(model, data, loads);
            let friction = model.collider(contact.a).friction * model.collider(contact.b).friction;
            self.blocks.push(Block {
                law: Law::Open { friction: friction.sqrt(), gap: contact.gap },
                v_free,
                guess: guess.map_or(Vec3::zeros(), |old| frame.tr_mul(&old.force_world) * settings.h),
                w: 0.0,
            });
        }
        for (index, coupling) in model.couplings().iter().enumerate() {
            let [(q_a, v_a), (q_b, v_b)] = [coupling.dof_a, coupling.dof_b].map(|dof| {
                let body = model.body_of_dof(dof);
                let q = data.q[model.qs(body).start + dof - model.dofs(body).start];
                (q, data.v[dof] + data.change.dof[dof])
            });
            let loads = [(coupling.dof_a, 1.0), (coupling.dof_b, -coupling.ratio)]
                .map(|(dof, factor)| Load::Dof { body: model.body_of_dof(dof).index(), dof, factor });
            self.delassus.push(model, data, loads);
            let offset = q_a - coupling.ratio * q_b;
            self.blocks.push(Block {
                law: Law::spring(coupling.stiffness, coupling.damping, offset, settings.h),
                v_free: Vec3::new(v_a - coupling.ratio * v_b, 0.0, 0.0),
                guess: self.last_couplings.get(index).copied().unwrap_or_default(),
                w: 0.0,
            });
        }
        self.delassus.assemble();
        let compliance = Compliance {
            h: settings.h,
            stiffness: settings.contact_stiffness,
            dissipation_time: settings.contact_dissipation_time,
        };
        for (index, block) in self.blocks.iter_mut().enumerate() {
            block.w = self.delassus.block(index, index).norm() / 3.0;
            block.law.regularise(&compliance, block.w);
        }
    }

    /// Applies the impulses of the solve and reports the contact forces.
    fn apply(&mut self, model: &Model, data: &mut Data, h: f64, report: &mut StepReport) {
        let mut impulse = std::mem::take(&mut data.impulse);
        impulse.clear();
        let (of_contacts, of_couplings) = self.newton.impulses.split_at(self.contacts.len());
        for ((contact, frame), p) in self.contacts.iter().zip(of_contacts) {
            let on_a = frame * p;
            for (id, on) in [(contact.a, on_a), (contact.b, -on_a)] {
                match model.collider(id).owner {
                    Owner::World => {}
                    Owner::Point(id) => {
                        let index = id.index();
                        impulse.point[index] += on;
                        if data.spins(model, index) {
                            let r = contact.p_world - data.point_p_world[index];
                            data.point_w_world[index] += r.cross(&on) / model.points[index].spin_inertia;
                        }
                    }
                    Owner::Body(id) => {
                        let origin = data.kinematics.links[id.index()].origin();
                        impulse.body[id.index()] += Wrench::of_force_at(on, &(contact.p_world - origin));
                    }
                }
            }
            report.contacts.push(ContactReport { force_world: on_a / h, ..*contact });
        }
        self.last.clone_from(&report.contacts);
        self.last_couplings.clear();
        self.last_couplings.extend_from_slice(of_couplings);
        for (coupling, p) in model.couplings().iter().zip(of_couplings) {
            impulse.dof[coupling.dof_a] += p.x;
            impulse.dof[coupling.dof_b] -= coupling.ratio * p.x;
        }
        let Data { kinematics, factor, change, correction, .. } = data;
        aba::solve_with(model, kinematics, factor, &mut impulse, correction);
        for (dv, added) in change.dof.iter_mut().zip(&correction.dof) {
            *dv += added;
        }
        for (dv, added) in change.point.iter_mut().zip(&correction.point) {
            *dv += added;
        }
        data.impulse = impulse;
    }
}

/// Unit impulses along the columns of `directions` on an owner, at `p_world`.
fn contact_load(data: &Data, owner: Owner, p_world: &Vec3, directions: &Mat3) -> Load {
    match owner {
        Owner::World => Load::None,
        Owner::Point(id) => {
            let r = p_world - data.point_p_world[id.index()];
            Load::Point { point: id.index(), impulses: *directions, r }
        }
        Owner::Body(id) => {
            let r = p_world - data.kinematics.links[id.index()].origin();
            let wrenches = [0, 1, 2].map(|k| Wrench::of_force_at(directions.column(k).into_owned(), &r));
            Load::Body { body: id.index(), wrenches }
        }
    }
}

/// Velocity that a point of an owner would have after the step without contacts [m/s].
fn free_velocity(data: &Data, owner: Owner, p_world: &Vec3) -> Vec3 {
    match owner {
        Owner::World => Vec3::zeros(),
        Owner::Point(id) => {
            let index = id.index();
            let r = p_world - data.point_p_world[index];
            data.point_v_world[index] + data.change.point[index] + data.point_w_world[index].cross(&r)
        }
        Owner::Body(id) => {
            let link = &data.kinematics.links[id.index()];
            (link.velocity + data.change.body[id.index()]).linear_at(&(p_world - link.origin()))
        }
    }
}
