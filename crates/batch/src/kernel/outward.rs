//! Kinematics and right-hand side, root to tips.

use super::lane::{Lane, Lane3, add, axmy, axpy, cross, cross_add, dot, load3, scale, store3, sub};
use super::{Step, View, keep, resume};
use crate::layout::{fruit, fruit_work, link, pose, work};
use pulp::Simd;

#[inline(always)]
pub(super) fn run<S: Simd>(simd: S, view: &mut View<S>, step: Step) {
    let mut tip = view.poses[0];
    for row in 0..view.schedule.rows {
        resume::<S, _>(view.schedule, row, view.poses, &mut tip);
        let here = link_outward(simd, &view.links[row], &mut view.work[row], &mut tip, step);
        for k in view.fruit_start[row]..view.fruit_start[row + 1] {
            fruit_outward(simd, &view.fruit[k], &mut view.fruit_work[k], &mut view.work[row], &here, step);
        }
        keep::<S, _>(view.schedule, row, view.poses, &tip);
    }
}

/// What a fruit needs to know about its link.
struct Here<S: Simd> {
    axes: [Lane3<S>; 3],
    w: Lane3<S>,
    v: Lane3<S>,
    p: Lane3<S>,
}

/// One link: `tip` is the parent's tip on entry and the link's own on return.
#[inline(always)]
fn link_outward<S: Simd>(
    simd: S,
    link: &[S::f32s; link::FIELDS],
    work: &mut [S::f32s; work::FIELDS],
    tip: &mut [S::f32s; pose::FIELDS],
    step: Step,
) -> Here<S> {
    let number = |field: usize| Lane::load(simd, link[field]);
    let constant = |number: f32| Lane::splat(simd, number);
    let axis = |k: usize| load3(simd, &tip[pose::AXES + 3 * k..]);
    let parent = [axis(0), axis(1), axis(2)];
    let w_parent = load3(simd, &tip[pose::W..]);
    let v = load3(simd, &tip[pose::V..]);
    let b_w_parent = load3(simd, &tip[pose::B_W..]);
    let b_v = load3(simd, &tip[pose::B_V..]);
    let p = load3(simd, &tip[pose::P..]);

    // Joint frame, then the turns about x and the turned y.
    let column = |k: usize| {
        let c = load3(simd, &link[link::REST + 3 * k..]);
        axpy(c[0], parent[0], axpy(c[1], parent[1], scale(c[2], parent[2])))
    };
    let (a_1, frame_y) = (column(0), column(1));
    let frame_z = cross(a_1, frame_y);
    let (s_1, c_1) = number(link::Q).sin_cos();
    let (s_2, c_2) = number(link::Q + 1).sin_cos();
    let a_2 = axpy(c_1, frame_y, scale(s_1, frame_z));
    let turned_z = axmy(s_1, frame_y, scale(c_1, frame_z));
    let x = axmy(s_2, turned_z, scale(c_2, a_1));
    let z = axpy(s_2, a_1, scale(c_2, turned_z));

    let (v_1, v_2) = (number(link::V), number(link::V + 1));
    let s_w = axpy(v_1, a_1, scale(v_2, a_2));
    let w = add(w_parent, s_w);
    let b_w = cross_add(w_parent, s_w, axpy(v_1 * v_2, turned_z, b_w_parent));

    // At the tip, and halfway at the centre of mass.
    let length = number(link::LENGTH);
    let d = scale(length, z);
    let w_cross_z = cross(w, z);
    let v_d = scale(length, w_cross_z);
    let b_d = cross_add(b_w, d, cross(w, v_d));
    let half = constant(0.5);
    let a_com = axpy(half, b_d, b_v);
    let v_com = axpy(half, v_d, v);

    // Impulse about the centre of mass, then about the link's origin.
    let h = constant(step.h);
    let h_mass = h * number(link::MASS);
    let linear_drag = number(link::LINEAR_DRAG);
    let mut f = scale(-h_mass, axpy(linear_drag, v_com, a_com));
    f[2] = h_mass.take_from(constant(step.gravity), f[2]);
    let (across, excess) = (number(link::ACROSS), number(link::AXIAL_EXCESS));
    let angular_drag = number(link::ANGULAR_DRAG);
    let w_z = dot(w, z);
    let turning = axpy(angular_drag, w, b_w);
    let axial = dot(z, turning);
    let n_com = scale(-h, axpy(across, turning, scale(excess, axpy(axial, z, scale(w_z, w_cross_z)))));
    let n = cross_add(scale(half, d), f, n_com);

    store3::<S>(&mut work[work::AXES..], a_1);
    store3::<S>(&mut work[work::AXES + 3..], a_2);
    store3::<S>(&mut work[work::Z..], z);
    store3::<S>(&mut work[work::IMPULSE..], n);
    store3::<S>(&mut work[work::IMPULSE + 3..], f);
    store3::<S>(&mut tip[pose::AXES..], x);
    store3::<S>(&mut tip[pose::AXES + 3..], a_2);
    store3::<S>(&mut tip[pose::AXES + 6..], z);
    store3::<S>(&mut tip[pose::W..], w);
    store3::<S>(&mut tip[pose::V..], add(v, v_d));
    store3::<S>(&mut tip[pose::B_W..], b_w);
    store3::<S>(&mut tip[pose::B_V..], add(b_v, b_d));
    store3::<S>(&mut tip[pose::P..], add(p, d));
    Here { axes: [x, a_2, z], w, v, p }
}

/// One fruit: eliminated as a leaf, its impulse goes to the link.
#[inline(always)]
fn fruit_outward<S: Simd>(
    simd: S,
    fruit: &[S::f32s; fruit::FIELDS],
    left: &mut [S::f32s; fruit_work::FIELDS],
    work: &mut [S::f32s; work::FIELDS],
    here: &Here<S>,
    step: Step,
) {
    let number = |field: usize| Lane::load(simd, fruit[field]);
    let constant = |number: f32| Lane::splat(simd, number);
    let zero = constant(0.0);
    let h = constant(step.h);
    let anchor = load3(simd, &fruit[fruit::ANCHOR..]);
    let r = axpy(anchor[0], here.axes[0], axpy(anchor[1], here.axes[1], scale(anchor[2], here.axes[2])));
    let u = load3(simd, &fruit[fruit::V..]);
    let mut stretch = sub(load3(simd, &fruit[fruit::P..]), add(here.p, r));
    stretch[2] = stretch[2] - number(fruit::DROP);
    let u_relative = sub(u, cross_add(here.w, r, here.v));

    let (stiffness, damping) = (number(fruit::STIFFNESS), number(fruit::DAMPING));
    let implicit_damping = h.mul_add(stiffness, damping);
    let kappa = h * implicit_damping;
    let pull = scale(-h, axpy(stiffness, stretch, scale(implicit_damping, u_relative)));
    let drag = number(fruit::AIR_DRAG) * dot(u, u).sqrt();
    let mass = h.mul_add(drag, number(fruit::MASS));
    let inverse_mass = constant(1.0) / (mass + kappa);
    let share = kappa * inverse_mass;
    let mut applied = axmy(drag, u, load3(simd, &fruit[fruit::FORCE..]));
    applied[2] = applied[2] - number(fruit::WEIGHT);
    let impulse = axpy(h, applied, pull);

    // What the anchor feels; above the cap its size is the cap's and the fruit adds no mass.
    let mut reaction = sub(scale(share, impulse), pull);
    reaction[2] = h.mul_add(number(fruit::BIAS), reaction[2]);
    let size = dot(reaction, reaction).sqrt();
    let largest = h * number(fruit::CAP);
    let reaction = scale(size.if_above(largest, largest / size, constant(1.0)), reaction);
    let added_mass = size.if_above(largest, zero, mass * share);

    let n = load3(simd, &work[work::IMPULSE..]);
    let f = load3(simd, &work[work::IMPULSE + 3..]);
    store3::<S>(&mut work[work::IMPULSE..], cross_add(r, reaction, n));
    store3::<S>(&mut work[work::IMPULSE + 3..], add(f, reaction));
    left[fruit_work::ADDED_MASS] = added_mass.value;
    left[fruit_work::KAPPA] = kappa.value;
    left[fruit_work::INVERSE_MASS] = inverse_mass.value;
    store3::<S>(&mut left[fruit_work::R_ANCHOR..], r);
    store3::<S>(&mut left[fruit_work::IMPULSE..], impulse);
    store3::<S>(&mut left[fruit_work::STRETCH..], stretch);
}
