//! The rows of a step's contact problem: blocks of three for each contact, then one for each coupling.

use orchard_geometry::{Mat3, Vec3};

use super::block::{Block, Load, Turns};
use super::law::Law;
use super::paths::Paths;
use super::{ContactReport, in_series};
use crate::data::Data;
use crate::model::{Model, Owner};
use crate::settings::StepSettings;
use crate::spatial::Wrench;

/// Source of the first guess: contacts of the last step, sorted by pair, and impulses of couplings.
pub(super) struct Guess<'a> {
    pub contacts: &'a [ContactReport],
    pub couplings: &'a [Vec3],
}

/// Appends a block for each contact with its contact frame (columns: two tangents, then the normal).
pub(super) fn push_contacts(
    model: &Model,
    data: &Data,
    h: f64,
    contacts: &[(ContactReport, Mat3)],
    guess: &Guess,
    blocks: &mut Vec<Block>,
) {
    let mut last = guess.contacts.iter().peekable();
    for (contact, frame) in contacts {
        // Both lists are sorted by pair; the points of a pair are matched in their order.
        while last.next_if(|old| (old.a, old.b) < (contact.a, contact.b)).is_some() {}
        let guess = last.next_if(|old| (old.a, old.b) == (contact.a, contact.b));
        let mut v_free = Vec3::zeros();
        let mut loads = [Load::None, Load::None];
        for (load, (id, sign)) in loads.iter_mut().zip([(contact.a, 1.0), (contact.b, -1.0)]) {
            let owner = model.collider(id).owner;
            *load = contact_load(model, data, owner, &contact.p_world, &(frame * sign));
            v_free += frame.tr_mul(&(free_velocity(model, data, owner, &contact.p_world) * sign));
        }
        let (a, b) = (model.collider(contact.a), model.collider(contact.b));
        blocks.push(Block {
            law: Law::Open {
                friction: (a.friction * b.friction).sqrt(),
                stiffness: in_series(a.stiffness, b.stiffness),
                gap: contact.gap,
            },
            v_free,
            guess: guess.map_or(Vec3::zeros(), |old| frame.tr_mul(&old.force_world) * h),
            w: 0.0,
            loads,
        });
    }
}

/// Appends a block for each coupling.
pub(super) fn push_couplings(model: &Model, data: &Data, h: f64, guess: &Guess, blocks: &mut Vec<Block>) {
    for (index, coupling) in model.couplings().iter().enumerate() {
        let [(q_a, v_a), (q_b, v_b)] = [coupling.dof_a, coupling.dof_b].map(|dof| {
            let body = model.body_of_dof(dof);
            let q = data.q[model.qs(body).start + dof - model.dofs(body).start];
            (q, data.v[dof] + data.change.dof[dof])
        });
        let loads = [(coupling.dof_a, 1.0), (coupling.dof_b, -coupling.ratio)]
            .map(|(dof, factor)| Load::Dof { body: model.body_of_dof(dof).index(), dof, factor });
        let offset = q_a - coupling.ratio * q_b;
        blocks.push(Block {
            law: Law::spring(coupling.stiffness, coupling.damping, offset, h),
            v_free: Vec3::new(v_a - coupling.ratio * v_b, 0.0, 0.0),
            guess: guess.couplings.get(index).copied().unwrap_or_default(),
            w: 0.0,
            loads,
        });
    }
}

/// Chooses the regularisation of each block from its own inverse inertia, which needs only its own path.
pub(super) fn regularise(settings: &StepSettings, paths: &Paths, blocks: &mut [Block]) {
    for (index, block) in blocks.iter_mut().enumerate() {
        block.w = paths.inverse_inertia(index, index).norm() / 3.0;
        block.law.regularise(settings.h, settings.contact_dissipation_time, block.w);
    }
}

/// Unit impulses along the columns of `directions` on an owner, at `p_world`.
fn contact_load(model: &Model, data: &Data, owner: Owner, p_world: &Vec3, directions: &Mat3) -> Load {
    match owner {
        Owner::World => Load::None,
        Owner::Point(id) => {
            let point = id.index();
            let turns = match data.turns_with(model, point) {
                Some(link) => Turns::Link(link.index()),
                None if data.spins(model, point) => Turns::Ball,
                None => Turns::Nothing,
            };
            Load::Point { point, impulses: *directions, r: p_world - data.point_p_world[point], turns }
        }
        Owner::Body(id) => {
            let r = p_world - data.kinematics.links[id.index()].origin();
            let wrenches = [0, 1, 2].map(|k| Wrench::of_force_at(directions.column(k).into_owned(), &r));
            Load::Body { body: id.index(), wrenches }
        }
    }
}

/// Velocity that a point of an owner would have after the step without contacts [m/s].
fn free_velocity(model: &Model, data: &Data, owner: Owner, p_world: &Vec3) -> Vec3 {
    match owner {
        Owner::World => Vec3::zeros(),
        Owner::Point(id) => {
            let index = id.index();
            let r = p_world - data.point_p_world[index];
            let added = data.turns_with(model, index).map(|link| data.change.body[link.index()].angular);
            let omega = data.point_w_world[index] + added.unwrap_or_else(Vec3::zeros);
            data.point_v_world[index] + data.change.point[index] + omega.cross(&r)
        }
        Owner::Body(id) => {
            let link = &data.kinematics.links[id.index()];
            (link.velocity + data.change.body[id.index()]).linear_at(&(p_world - link.origin()))
        }
    }
}
