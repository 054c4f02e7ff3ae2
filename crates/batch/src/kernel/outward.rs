//! Kinematics and right-hand side, root to leaf.

use super::instructions::Instructions;
use super::lane::{
    Lane, Lane3, add, axmy, axpy, cross, cross_add, dot, load3, scale, sin_cos_pair, store3, sub,
};
use super::motion::Here;
use super::{Step, View, gather, stem};
use crate::layout::{air, fruit, fruit_work, link, tip, tip_motion, work};
use crate::schedule::NO_SLOT;

/// When the pass runs.
#[derive(Clone, Copy)]
pub(super) struct Moment {
    /// True after [`super::advance`]: stems are still to move.
    pub after_advance: bool,
    /// True at the start of a frame: the air acts anew.
    pub start_of_frame: bool,
}

/// Returns true if a stem bears a load from which its wear counts.
#[inline(always)]
pub(super) fn run<S: Instructions, const STEMS: bool>(
    simd: S,
    view: &mut View<S>,
    step: Step,
    is: Moment,
) -> bool {
    let View { rows, sources, masks, links, work, fruit, fruit_work, tips, tip_motion, air, .. } = view;
    let (stems, stem_work) = (&mut view.stems, &mut view.stem_work);
    let zero = Lane::splat(simd, 0.0);
    let mut largest = zero;
    // Two slots beyond those of the schedule.
    let Some((scratch, tips)) = tips.split_last_mut() else { return false };
    let childless = tips.len() - 1;
    for (k, ((row, link), work)) in rows.iter().zip(links.iter_mut()).zip(work.iter_mut()).enumerate() {
        let has_children = row.slot != NO_SLOT;
        let (first, count) = row.sources;
        let (own_sources, own_masks) = (&sources[first..first + count], &masks[first..first + count]);
        if count > 1 {
            gather(simd, own_sources, own_masks, tips, scratch);
        }
        let own = if has_children { row.slot } else { childless };
        let Ok([parent, own]) = tips.get_disjoint_mut([sources[first].slot, own]) else { continue };
        let parent = if count > 1 { &*scratch } else { &*parent };
        // Stems move before the kinematics of their link take the place of the old.
        if STEMS && is.after_advance && row.fruit.0 < row.fruit.1 {
            let before = stem::Before::of(simd, link, work);
            for k in row.fruit.0..row.fruit.1 {
                let (left, kept) = (&fruit_work[k], &stem_work[k]);
                stem::advance(simd, &mut fruit[k], &mut stems[k], left, kept, &before, step);
            }
        }
        let here = link_outward(simd, link, work, parent);
        let mut force = None;
        if let Some(air) = air {
            if is.start_of_frame {
                let here_air = air.at(simd, k, row, own_sources, own_masks);
                air.press(simd, k, here_air, link, &here, step);
                for k in row.fruit.0..row.fruit.1 {
                    air.press_fruit(simd, k, here_air, &mut fruit[k]);
                }
            }
            force = Some(load3(simd, &air.links[k][air::H_FORCE..]));
        }
        resist(simd, link, work, &here, force, step);
        if let Some(motion) = tip_motion.get_mut(k) {
            motion[tip_motion::Z] = (here.p[2] + here.d[2]).value;
            store3::<S>(&mut motion[tip_motion::V..], add(here.v, here.v_d));
        }
        if has_children {
            let Here { axes, w, v, p, b_w, b_v, d, v_d, b_d, .. } = here;
            store3::<S>(&mut own[tip::AXES..], axes[0]);
            store3::<S>(&mut own[tip::AXES + 3..], axes[1]);
            store3::<S>(&mut own[tip::AXES + 6..], axes[2]);
            store3::<S>(&mut own[tip::W..], w);
            store3::<S>(&mut own[tip::V..], add(v, v_d));
            store3::<S>(&mut own[tip::B_W..], b_w);
            store3::<S>(&mut own[tip::B_V..], add(b_v, b_d));
            store3::<S>(&mut own[tip::P..], add(p, d));
        }
        for k in row.fruit.0..row.fruit.1 {
            if STEMS {
                let (left, kept) = (&mut fruit_work[k], &mut stem_work[k]);
                let over = stem::outward(simd, &fruit[k], &stems[k], left, kept, work, &here, step);
                largest = over.if_above(largest, over, largest);
            } else {
                fruit_outward(simd, &fruit[k], &mut fruit_work[k], work, &here, step);
            }
        }
    }
    STEMS && largest.any_above(zero)
}

/// Kinematics of one link from its parent's tip.
#[inline(always)]
fn link_outward<S: Instructions>(
    simd: S,
    link: &[S::Vector; link::FIELDS],
    work: &mut [S::Vector; work::FIELDS],
    parent: &[S::Vector; tip::FIELDS],
) -> Here<S> {
    let number = |field: usize| Lane::load(simd, link[field]);
    let axis = |k: usize| load3(simd, &parent[tip::AXES + 3 * k..]);

    // Joint frame: the smallest turn that carries z onto the direction c, with u = z + (c_x x + c_y y) / (1 + c_z).
    let c = load3(simd, &link[link::DIRECTION..]);
    let (parent_x, parent_y, parent_z) = (axis(0), axis(1), axis(2));
    let across = axpy(c[0], parent_x, scale(c[1], parent_y));
    let u = axpy(number(link::FOLD), across, parent_z);
    let (a_1, frame_y) = (axmy(c[0], u, parent_x), axmy(c[1], u, parent_y));
    let frame_z = axpy(c[2], parent_z, across);

    // Then the turns about x and the turned y.
    let [(s_1, c_1), (s_2, c_2)] = sin_cos_pair(number(link::Q), number(link::Q + 1));
    let a_2 = axpy(c_1, frame_y, scale(s_1, frame_z));
    let turned_z = axmy(s_1, frame_y, scale(c_1, frame_z));
    let x = axmy(s_2, turned_z, scale(c_2, a_1));
    let z = axpy(s_2, a_1, scale(c_2, turned_z));
    store3::<S>(&mut work[work::AXES..], a_1);
    store3::<S>(&mut work[work::AXES + 3..], a_2);

    let (v_1, v_2) = (number(link::V), number(link::V + 1));
    let s_w = axpy(v_1, a_1, scale(v_2, a_2));
    let w_parent = load3(simd, &parent[tip::W..]);
    let w = add(w_parent, s_w);
    let b_w = cross_add(w_parent, s_w, axpy(v_1 * v_2, turned_z, load3(simd, &parent[tip::B_W..])));

    // At the tip.
    let length = number(link::LENGTH);
    let d = scale(length, z);
    store3::<S>(&mut work[work::D..], d);
    let w_cross_z = cross(w, z);
    let v_d = scale(length, w_cross_z);
    let b_d = cross_add(b_w, d, cross(w, v_d));
    let (v, b_v) = (load3(simd, &parent[tip::V..]), load3(simd, &parent[tip::B_V..]));
    Here { axes: [x, a_2, z], w, v, p: load3(simd, &parent[tip::P..]), b_w, b_v, d, v_d, b_d, w_cross_z }
}

/// Resistance of a link: the impulse on it with the sign turned; `h_force` is that of the wind at its centre of mass.
#[inline(always)]
fn resist<S: Instructions>(
    simd: S,
    link: &[S::Vector; link::FIELDS],
    work: &mut [S::Vector; work::FIELDS],
    here: &Here<S>,
    h_force: Option<Lane3<S>>,
    step: Step,
) {
    let number = |field: usize| Lane::load(simd, link[field]);
    let Here { axes: [_, _, z], w, v, b_w, b_v, d, v_d, b_d, w_cross_z, .. } = *here;
    // Halfway at the centre of mass.
    let half = Lane::splat(simd, 0.5);
    let a_com = axpy(half, b_d, b_v);
    let v_com = axpy(half, v_d, v);

    // Resistance about the centre of mass, then about the link's origin.
    let h_mass = number(link::H_MASS);
    let mut f = axpy(number(link::LINEAR_DRAG), v_com, a_com);
    f[2] = f[2] + Lane::splat(simd, step.gravity);
    let mut f = scale(h_mass, f);
    if let Some(h_force) = h_force {
        f = sub(f, h_force);
    }
    let turning = axpy(number(link::ANGULAR_DRAG), w, b_w);
    let spinning = axpy(dot(z, turning), z, scale(dot(w, z), w_cross_z));
    let n = axpy(number(link::H_ACROSS), turning, scale(number(link::H_EXCESS), spinning));
    let n = cross_add(scale(half, d), f, n);
    store3::<S>(&mut work[work::RESISTANCE..], n);
    store3::<S>(&mut work[work::RESISTANCE + 3..], f);
}

/// One fruit: eliminated as a leaf, its impulse goes to the link.
#[inline(always)]
fn fruit_outward<S: Instructions>(
    simd: S,
    fruit: &[S::Vector; fruit::FIELDS],
    left: &mut [S::Vector; fruit_work::FIELDS],
    work: &mut [S::Vector; work::FIELDS],
    here: &Here<S>,
    step: Step,
) {
    let number = |field: usize| Lane::load(simd, fruit[field]);
    let constant = |number: f32| Lane::splat(simd, number);
    let h = constant(step.h);
    let anchor = load3(simd, &fruit[fruit::ANCHOR..]);
    let r = axpy(anchor[0], here.axes[0], axpy(anchor[1], here.axes[1], scale(anchor[2], here.axes[2])));
    let u = load3(simd, &fruit[fruit::V..]);
    let mut stretch = sub(load3(simd, &fruit[fruit::P..]), add(here.p, r));
    stretch[2] = stretch[2] - number(fruit::DROP);
    let u_relative = sub(u, cross_add(here.w, r, here.v));

    // The stem's impulse with the sign turned.
    let kappa = number(fruit::KAPPA);
    let pull = axpy(number(fruit::H_STIFFNESS), stretch, scale(kappa, u_relative));
    let drag = number(fruit::AIR_DRAG) * dot(u, u).sqrt();
    let mass = h.mul_add(drag, number(fruit::MASS));
    let inverse_mass = constant(1.0) / (mass + kappa);
    let share = kappa * inverse_mass;
    let applied = axmy(drag, u, load3(simd, &fruit[fruit::FORCE..]));
    let mut impulse = axpy(h, applied, [-pull[0], -pull[1], -pull[2]]);
    impulse[2] = impulse[2] - number(fruit::H_WEIGHT);

    // Reaction on the anchor; above the cap it has the size of the cap and the fruit adds no mass.
    let mut reaction = axpy(share, impulse, pull);
    reaction[2] = reaction[2] + number(fruit::H_BIAS);
    let size = dot(reaction, reaction).sqrt();
    let largest = number(fruit::H_CAP);
    let reaction = scale(size.if_above(largest, largest / size, constant(1.0)), reaction);
    let added_mass = size.if_above(largest, constant(0.0), mass * share);

    let n = load3(simd, &work[work::RESISTANCE..]);
    let f = load3(simd, &work[work::RESISTANCE + 3..]);
    store3::<S>(&mut work[work::RESISTANCE..], cross_add(reaction, r, n));
    store3::<S>(&mut work[work::RESISTANCE + 3..], sub(f, reaction));
    left[fruit_work::ADDED_MASS] = added_mass.value;
    left[fruit_work::INVERSE_MASS] = inverse_mass.value;
    store3::<S>(&mut left[fruit_work::R_TIP..], sub(r, here.d));
    store3::<S>(&mut left[fruit_work::IMPULSE..], impulse);
    store3::<S>(&mut left[fruit_work::STRETCH..], stretch);
}
