//! Compliant, convex frictional contact: Castro, Permenter, Han, "An Unconstrained Convex Formulation of
//! Compliant Contact" (2022), on the articulated-body factor.
//!
//! `broad` finds pairs of colliders, `narrow` their contact points (`core`, `polytope`: solids with corners; `terrain`:
//! height fields), `rows` writes the problem, `law` is the contact law, `paths` propagates impulses at contacts
//! through the factor. `newton` solves for the impulses, with the linear algebra of `matrix_free`, of `delassus`
//! where rows are few, or of `assembled` as a cross-check.

#[cfg(feature = "cholesky")]
mod assembled;
mod block;
mod broad;
mod core;
mod delassus;
mod gap;
mod law;
mod matrix_free;
mod narrow;
#[cfg(test)]
mod narrow_tests;
mod newton;
mod paths;
mod polytope;
pub(crate) mod report;
mod root;
mod rows;
pub(crate) mod scratch;
mod shared;
mod terrain;
mod touch;

use orchard_geometry::{Mat3, Pose, Vec3};

use crate::data::Data;
use crate::kinematics::Kinematics;
use crate::model::{Collider, ColliderId, Groups, Model, Owner};
pub use crate::settings::ContactPath;
use crate::settings::{StepReport, StepSettings};
use crate::solver::{self, LinearSolve, Solver};
use crate::spatial::Wrench;
use delassus::Direct;
pub use gap::{Gap, GapFinder};
use matrix_free::MatrixFree;
use newton::Outcome;
pub use report::ContactReport;
use rows::Guess;
use scratch::ContactScratch;
pub(crate) use scratch::WarmStart;

/// Rows up to which [`ContactPath::ByRows`] takes the direct path: where the dense factor and the iterations were
/// measured to cost the same (`docs/computation/dynamics.md`, "Which path").
pub const DIRECT_ROWS: usize = 450;

/// Stiffness of a contact [N/m]: the stiffnesses of its two surfaces act in series.
pub fn in_series(a: f64, b: f64) -> f64 {
    1.0 / (1.0 / a + 1.0 / b)
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

/// Lets point bodies overlap by as much as they do in a state: such a pair has grown flat where it touches, and is pushed apart where it overlaps more.
pub fn accept_overlaps(model: &mut Model, data: &Data) {
    model.overlaps.clear();
    let mut scratch = ContactScratch::default();
    scratch.collide(model, data, 0.0);
    let is_point = |id: ColliderId| matches!(model.collider(id).owner, Owner::Point(_));
    let found = scratch.contacts.iter().map(|(contact, _)| contact);
    let found = found.filter(|c| c.gap < 0.0 && is_point(c.a) && is_point(c.b));
    model.overlaps = found.map(|c| ((c.a, c.b), -c.gap)).collect();
}

/// Finds if colliders of some groups come near each other, without a step.
#[derive(Debug, Clone, Default)]
pub struct Vicinity(ContactScratch);

impl Vicinity {
    /// True if two colliders that `groups` (one a collider, in the model's order) lets touch are less apart than `within` of the two, which is at most the sum of their reaches \[m\].
    pub fn any(
        &mut self,
        model: &Model,
        data: &Data,
        groups: &[Groups],
        reach: impl Fn(ColliderId) -> f64,
        within: impl Fn(ColliderId, ColliderId) -> f64,
    ) -> bool {
        let Self(scratch) = self;
        scratch.collide_groups(model, data, groups, reach, within);
        !scratch.contacts.is_empty()
    }
}

/// Adds the velocity change by contacts and couplings to the free one in `Data::change`.
pub(crate) fn solve_contacts(
    model: &Model,
    data: &mut Data,
    settings: &StepSettings,
    report: &mut StepReport,
) {
    let mut scratch = std::mem::take(&mut data.contact);
    report.contacts.clear();
    report.newton_iterations = 0;
    report.cg_iterations = 0;
    report.residual = 0.0;
    report.converged = true;
    report.response = LinearSolve::default();
    scratch.collide(model, data, settings.contact_margin);
    scratch.assemble(model, data, settings);
    if !scratch.blocks.is_empty() {
        let outcome = scratch.solve(model, data, settings);
        report.newton_iterations = outcome.iterations;
        report.cg_iterations = outcome.linear_iterations;
        report.residual = outcome.residual;
        report.converged = outcome.converged;
        scratch.apply(model, data, settings, report);
    } else {
        scratch.last.clear();
    }
    data.contact = scratch;
}

impl ContactScratch {
    /// Finds the contact points of this step.
    fn collide(&mut self, model: &Model, data: &Data, margin: f64) {
        // Half the margin on each side of a pair.
        self.collide_groups(model, data, &data.groups, |_| 0.5 * margin, |_, _| margin);
    }

    /// As [`Self::collide`], with other groups than the state's, a reach for each collider, and a margin for each pair, at most the sum of the reaches.
    fn collide_groups(
        &mut self,
        model: &Model,
        data: &Data,
        groups: &[Groups],
        reach: impl Fn(ColliderId) -> f64,
        within: impl Fn(ColliderId, ColliderId) -> f64,
    ) {
        self.contacts.clear();
        self.broad.find_pairs(model, &data.kinematics, &data.point_p_world, groups, &reach);
        for &(a, b) in &self.broad.pairs {
            let margin = within(a, b);
            let (collider_a, collider_b) = (model.collider(a), model.collider(b));
            self.touches.clear();
            narrow::touches(
                (&collider_a.shape, self.broad.pose(a)),
                (&collider_b.shape, self.broad.pose(b)),
                margin,
                &mut self.narrow,
                &mut self.touches,
            );
            let accepted = model.overlaps.get(&(a, b)).copied().unwrap_or(0.0);
            for touch in self.touches.iter().filter(|touch| touch.gap + accepted <= margin) {
                let report = ContactReport {
                    a,
                    b,
                    p_world: touch.p_world,
                    n_world: touch.n_world,
                    gap: touch.gap + accepted,
                    force_world: Vec3::zeros(),
                };
                self.contacts.push((report, contact_frame(&touch.n_world)));
            }
        }
    }

    /// Writes the blocks and their paths: contacts first, then couplings.
    fn assemble(&mut self, model: &Model, data: &Data, settings: &StepSettings) {
        self.blocks.clear();
        let guess = Guess { contacts: &self.last, couplings: &self.last_couplings };
        rows::push_contacts(model, data, settings.h, &self.contacts, &guess, &mut self.blocks);
        rows::push_couplings(model, data, settings.h, &guess, &mut self.blocks);
        if self.blocks.is_empty() {
            return;
        }
        self.paths.assemble(model, &data.kinematics, &data.factor, &self.blocks);
        rows::regularise(settings, &self.paths, &mut self.blocks);
    }

    /// Finds the impulses of all blocks.
    #[cfg_attr(not(feature = "cholesky"), expect(unused_variables))]
    fn solve(&mut self, model: &Model, data: &Data, settings: &StepSettings) -> Outcome {
        #[cfg(feature = "cholesky")]
        if settings.solver == Solver::Cholesky {
            let mut unknown = assembled::Assembled::new(model, data, &self.blocks);
            return self.newton.solve(&self.blocks, &mut unknown);
        }
        let is_direct = match settings.contact_path {
            ContactPath::ByRows => settings.solver == Solver::Aba && 3 * self.blocks.len() <= DIRECT_ROWS,
            ContactPath::MatrixFree => false,
            ContactPath::Delassus => true,
        };
        if is_direct {
            let mut unknown = Direct { paths: &self.paths, delassus: &mut self.delassus };
            self.newton.solve(&self.blocks, &mut unknown)
        } else {
            let mut unknown = MatrixFree { paths: &self.paths, coordinates: &mut self.coordinates };
            self.newton.solve(&self.blocks, &mut unknown)
        }
    }

    /// Applies the impulses of the solve and reports the contact forces.
    fn apply(&mut self, model: &Model, data: &mut Data, settings: &StepSettings, report: &mut StepReport) {
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
                        let r = contact.p_world - data.point_p_world[index];
                        if let Some(link) = data.turns_with(model, index) {
                            impulse.body[link.index()] +=
                                Wrench { torque: r.cross(&on), force: Vec3::zeros() };
                        } else if data.spins(model, index) {
                            data.point_w_world[index] += r.cross(&on) / model.points[index].spin_inertia;
                        }
                    }
                    Owner::Body(id) => {
                        let origin = data.kinematics.links[id.index()].origin();
                        impulse.body[id.index()] += Wrench::of_force_at(on, &(contact.p_world - origin));
                    }
                }
            }
            report.contacts.push(ContactReport { force_world: on_a / settings.h, ..*contact });
        }
        self.last.clone_from(&report.contacts);
        self.last_couplings.clear();
        self.last_couplings.extend_from_slice(of_couplings);
        for (coupling, p) in model.couplings().iter().zip(of_couplings) {
            impulse.dof[coupling.dof_a] += p.x;
            impulse.dof[coupling.dof_b] -= coupling.ratio * p.x;
        }
        let Data { kinematics, factor, linear, change, correction, .. } = data;
        let system = (&*kinematics, &*factor);
        report.response = solver::solve(settings.solver, model, system, linear, &mut impulse, correction);
        for (dv, added) in change.dof.iter_mut().zip(&correction.dof) {
            *dv += added;
        }
        for (dv, added) in change.point.iter_mut().zip(&correction.point) {
            *dv += added;
        }
        data.impulse = impulse;
    }
}
