//! Articulated-body algorithm on the linearly implicit system: factor once, solve for many right-hand sides.
//!
//! The system matrix is `A = M + h (D + C) + h^2 K`: drag C scales each link's inertia, and damping D and
//! stiffness K add a diagonal in joint space, so Featherstone's recursion (Rigid Body Dynamics Algorithms,
//! 2008, chapter 7) factors it exactly in O(n). Tethered point bodies are eliminated as leaves.

pub(crate) mod factors;
mod joint;
pub(crate) mod vectors;

use nalgebra::Vector3;
use orchard_geometry::Vec3;

use crate::data::Data;
use crate::kinematics::Kinematics;
use crate::lanes::{Packed, Pair, Real, each, pack_rows};
use crate::model::{BodyId, JointKind, Model};
use crate::schedule::Slot;
use crate::spatial::{ArticulatedInertia, Twist, Wrench};
use crate::symmetric::Symmetric3;
use factors::{Factor, PointFactor};
use joint::{factor_joint, for_slot, solve_joint_down, solve_joint_up};
pub use vectors::{Change, Impulse};

/// Factors the system matrix for the substep `h` at the last kinematics, with the stiffness, damping, drag and
/// tethers that `data` holds. [`solve`] then works until the next call.
pub fn factor(model: &Model, data: &mut Data, h: f64) {
    data.factor.singular = None;
    for index in 0..model.points.len() {
        factor_point(model, data, h, index);
    }
    for slot in model.schedule.iter().rev() {
        for_slot!(model, slot, eliminate(model, data, h));
    }
}

/// Eliminates a point body: what its tether adds to the anchor's link.
fn factor_point(model: &Model, data: &mut Data, h: f64, index: usize) {
    let point = &model.points[index];
    let factor = &mut data.factor;
    let drag = data.point_quadratic_drag[index] * data.point_v_world[index].norm();
    let mass = point.mass + h * drag;
    let tether = point.tether.as_ref().filter(|_| data.tethered[index]);
    let kappa = tether.map_or(0.0, |tether| h * (tether.damping + h * tether.stiffness));
    let inverse_mass = if data.point_carried[index] { 0.0 } else { 1.0 / (mass + kappa) };
    let mut entry = PointFactor { inverse_mass, kappa, share: 0.0, r_anchor: Vec3::zeros() };
    if let Some(tether) = tether {
        entry.r_anchor = data.kinematics.links[tether.body.index()].turned(&tether.p_body);
        if !data.capped[index] {
            entry.share = kappa * inverse_mass;
            factor.inertia[tether.body.index()] +=
                ArticulatedInertia::of_rigid(mass * entry.share, &entry.r_anchor, Symmetric3::ZERO);
        }
    }
    factor.points[index] = entry;
}

/// Eliminates the joints of some links: what their parents feel of them.
#[inline(always)]
fn eliminate<S: Real, const T: usize, const N: usize>(
    links: &[usize],
    model: &Model,
    data: &mut Data,
    h: f64,
) {
    let Data { kinematics, factor, stiffness, damping, linear_drag, angular_drag, .. } = data;
    let bodies = each(links, |link| &model.bodies[link]);
    let poses = each(links, |link| &kinematics.links[link]);
    let hanging = each(links, |link| &factor.inertia[link]);
    let dofs = each(links, |link| model.dof_range(link));
    let (one, step) = (S::one(), S::splat(h));

    let mass_gain = one + step * S::pack(|l| linear_drag[links[l]]);
    let mass = S::pack(|l| bodies[l].inertia.mass) * mass_gain;
    let i_gain = one + step * S::pack(|l| angular_drag[links[l]]);
    let i_com = Symmetric3::pack(|l| poses[l].i_com).scaled(i_gain);
    let own = ArticulatedInertia::of_rigid(mass, &Vector3::pack(|l| poses[l].r_com), i_com);
    let mut inertia = ArticulatedInertia::pack(|l| *hanging[l]) + own;
    for link in links {
        factor.inertia[*link] = ArticulatedInertia::ZERO;
    }

    let row = |l: usize| dofs[l].clone();
    let axes = pack_rows::<Vector3<S>, N>([&kinematics.axes[row(0)], &kinematics.axes[row(1)]]);
    let stiffness = pack_rows::<S, N>([&stiffness[row(0)], &stiffness[row(1)]]);
    let mut armature = pack_rows::<S, N>([&damping[row(0)], &damping[row(1)]]);
    let spring = if matches!(bodies[0].joint, JointKind::Free) { S::zero() } else { step * step };
    for (armature, stiffness) in armature.iter_mut().zip(stiffness) {
        *armature = step * *armature + spring * stiffness;
    }
    let joint = factor_joint::<S, T, N>(&mut inertia, &axes, &armature);
    let shifted = inertia.shifted(&Vector3::pack(|l| poses[l].r_parent));

    for (l, &index) in links.iter().enumerate() {
        let g = &mut factor.g[dofs[l].clone()][..N];
        let d_inverse = &mut factor.d_inverse[factor.d_start[index]..][..N * N];
        for k in 0..N {
            g[k] = joint.g[k].lane(l);
            for j in 0..N {
                d_inverse[k * N + j] = joint.d_inverse[k][j].lane(l);
            }
            if joint.pivot_inverse[k].lane(l) == 0.0 {
                factor.singular = Some(BodyId(index as u32));
            }
        }
        if let Some(parent) = bodies[l].parent {
            factor.inertia[parent.index()] += shifted.lane(l);
        }
    }
}

/// Solves `A change = impulse` with the last [`factor`]. The body impulses are used as scratch: afterwards
/// they are spoilt.
pub fn solve(model: &Model, data: &Data, impulse: &mut Impulse, change: &mut Change) {
    solve_with(model, &data.kinematics, &data.factor, impulse, change);
}

pub(crate) fn solve_with(
    model: &Model,
    kinematics: &Kinematics,
    factor: &Factor,
    impulse: &mut Impulse,
    change: &mut Change,
) {
    for (index, point) in model.points.iter().enumerate() {
        let entry = &factor.points[index];
        if let Some(tether) = &point.tether
            && entry.share != 0.0
        {
            let reaction = Wrench::of_force_at(impulse.point[index] * entry.share, &entry.r_anchor);
            impulse.body[tether.body.index()] += reaction;
        }
    }
    for slot in model.schedule.iter().rev() {
        // Most links of a contact's solve: no impulse on the sub-tree, none to pass on.
        if slot.links().iter().all(|&link| impulse.is_zero(link, model.dof_range(link))) {
            slot.links().iter().for_each(|&link| change.dof[model.dof_range(link)].fill(0.0));
        } else {
            for_slot!(model, slot, solve_up(model, kinematics, factor, impulse, change));
        }
    }
    for slot in &model.schedule {
        for_slot!(model, slot, solve_down(model, kinematics, factor, change));
    }
    for (index, point) in model.points.iter().enumerate() {
        let entry = &factor.points[index];
        let mut total = impulse.point[index];
        if let Some(tether) = &point.tether
            && entry.share != 0.0
        {
            total += change.body[tether.body.index()].linear_at(&entry.r_anchor) * entry.kappa;
        }
        change.point[index] = total * entry.inverse_mass;
    }
}

/// Passes the impulses on some links to their parents.
#[inline(always)]
fn solve_up<S: Real, const T: usize, const N: usize>(
    links: &[usize],
    model: &Model,
    kinematics: &Kinematics,
    factor: &Factor,
    impulse: &mut Impulse,
    change: &mut Change,
) {
    let dofs = each(links, |link| model.dof_range(link));
    let row = |l: usize| dofs[l].clone();
    let d_starts = each(links, |link| factor.d_start[link]);
    let mut d_inverse = [[S::zero(); N]; N];
    for (k, d_inverse) in d_inverse.iter_mut().enumerate() {
        let row = |l: usize| &factor.d_inverse[d_starts[l] + k * N..];
        *d_inverse = pack_rows([row(0), row(1)]);
    }
    let mut wrench = Wrench::pack(|l| impulse.body[links[l]]);
    let x = solve_joint_up::<S, T, N>(
        &mut wrench,
        &pack_rows([&kinematics.axes[row(0)], &kinematics.axes[row(1)]]),
        &pack_rows([&factor.g[row(0)], &factor.g[row(1)]]),
        &d_inverse,
        &pack_rows([&impulse.dof[row(0)], &impulse.dof[row(1)]]),
    );
    let shifted = wrench.shifted(&Vector3::pack(|l| kinematics.links[links[l]].r_parent));
    for (l, &index) in links.iter().enumerate() {
        for (dv, x) in change.dof[row(l)].iter_mut().zip(&x) {
            *dv = x.lane(l);
        }
        if let Some(parent) = model.bodies[index].parent {
            impulse.body[parent.index()] += shifted.lane(l);
        }
    }
}

/// Gives some links their velocity change from that of their parents.
#[inline(always)]
fn solve_down<S: Real, const T: usize, const N: usize>(
    links: &[usize],
    model: &Model,
    kinematics: &Kinematics,
    factor: &Factor,
    change: &mut Change,
) {
    let dofs = each(links, |link| model.dof_range(link));
    let row = |l: usize| dofs[l].clone();
    let parents = each(links, |link| {
        model.bodies[link].parent.map_or(&Twist::ZERO, |parent| &change.body[parent.index()])
    });
    let parent = Twist::<S>::pack(|l| *parents[l]);
    let mut x = pack_rows([&change.dof[row(0)], &change.dof[row(1)]]);
    let own = solve_joint_down::<S, T, N>(
        &parent.shifted(&Vector3::pack(|l| kinematics.links[links[l]].r_parent)),
        &pack_rows([&kinematics.axes[row(0)], &kinematics.axes[row(1)]]),
        &pack_rows([&factor.g[row(0)], &factor.g[row(1)]]),
        &mut x,
    );
    for (l, &index) in links.iter().enumerate() {
        change.body[index] = own.lane(l);
        for (dv, x) in change.dof[row(l)].iter_mut().zip(&x) {
            *dv = x.lane(l);
        }
    }
}
