//! Elimination of the joints, tips to root.

use super::lane::{Lane, Lane3, add, axmy, axpy, cross_add, dot, load3, scale, store3};
use super::{Step, View, collect, deliver};
use crate::layout::{fruit_work, link, load, work};
use pulp::Simd;

#[inline(always)]
pub(super) fn run<S: Simd>(simd: S, view: &mut View<S>, step: Step) {
    let mut load = [simd.splat_f32s(0.0); load::FIELDS];
    for row in (0..view.schedule.rows).rev() {
        collect(simd, view.schedule, row, view.loads, &mut load);
        let mut inertia = Inertia::at_origin(simd, &view.links[row], &view.work[row], &load, step);
        for k in view.fruit_start[row]..view.fruit_start[row + 1] {
            let left = &view.fruit_work[k];
            let mass = Lane::load(simd, left[fruit_work::ADDED_MASS]);
            inertia.add_point_mass(mass, load3(simd, &left[fruit_work::R_ANCHOR..]));
        }
        eliminate(simd, inertia, &view.links[row], &mut view.work[row], &mut load, step);
        deliver(simd, view.schedule, row, view.loads, &mut load);
    }
}

/// Articulated inertia of a link at its origin, and the impulse on it.
struct Inertia<S: Simd> {
    /// xx, xy, xz, yy, yz, zz.
    angular: [Lane<S>; 6],
    /// Columns.
    coupling: [Lane3<S>; 3],
    /// Like `angular`.
    linear: [Lane<S>; 6],
    n: Lane3<S>,
    f: Lane3<S>,
}

/// A symmetric matrix times a vector.
#[inline(always)]
fn symmetric<S: Simd>(m: &[Lane<S>; 6], v: Lane3<S>) -> Lane3<S> {
    [dot([m[0], m[1], m[2]], v), dot([m[1], m[3], m[4]], v), dot([m[2], m[4], m[5]], v)]
}

impl<S: Simd> Inertia<S> {
    /// The link's own inertia and what hangs on its tip, moved to its origin.
    #[inline(always)]
    fn at_origin(
        simd: S,
        link: &[S::f32s; link::FIELDS],
        work: &[S::f32s; work::FIELDS],
        load: &[S::f32s; load::FIELDS],
        step: Step,
    ) -> Self {
        let number = |field: usize| Lane::load(simd, link[field]);
        let constant = |number: f32| Lane::splat(simd, number);
        let borne = |field: usize| Lane::load(simd, load[field]);
        let (h, one, half) = (constant(step.h), constant(1.0), constant(0.5));
        let z = load3(simd, &work[work::Z..]);
        let length = number(link::LENGTH);
        let d = scale(length, z);

        // H' = H + [d] M, column by column; J' = J + [d] H^T - H' [d].
        let column = |k: usize| load3(simd, &load[load::COUPLING + 3 * k..]);
        // Spelt out: `array::map` is not inlined into code for other instructions.
        let old = [column(0), column(1), column(2)];
        let m = [
            borne(load::LINEAR),
            borne(load::LINEAR + 1),
            borne(load::LINEAR + 2),
            borne(load::LINEAR + 3),
            borne(load::LINEAR + 4),
            borne(load::LINEAR + 5),
        ];
        let mut new = [
            cross_add(d, [m[0], m[1], m[2]], old[0]),
            cross_add(d, [m[1], m[3], m[4]], old[1]),
            cross_add(d, [m[2], m[4], m[5]], old[2]),
        ];
        let row = |h: &[Lane3<S>; 3], i: usize| [h[0][i], h[1][i], h[2][i]];
        // Component i of d x r, added to c.
        let cross_at = |i: usize, r: Lane3<S>, c: Lane<S>| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            d[j].mul_add(r[k], d[k].take_from(r[j], c))
        };
        let entry = |k: usize, i: usize, j: usize| {
            cross_at(i, row(&old, j), cross_at(j, row(&new, i), borne(load::ANGULAR + k)))
        };
        let mut angular =
            [entry(0, 0, 0), entry(1, 0, 1), entry(2, 0, 2), entry(3, 1, 1), entry(4, 1, 2), entry(5, 2, 2)];
        let (torque, force) = (load3(simd, &load[load::TORQUE..]), load3(simd, &load[load::FORCE..]));
        let n = cross_add(d, force, add(torque, load3(simd, &work[work::IMPULSE..])));
        let f = add(force, load3(simd, &work[work::IMPULSE + 3..]));

        // The link itself, symmetric about z, its centre of mass halfway: across + along z z^T.
        let mass = number(link::MASS) * h.mul_add(number(link::LINEAR_DRAG), one);
        let turning = h.mul_add(number(link::ANGULAR_DRAG), one);
        let arm = half * length;
        let steiner = mass * arm * arm;
        let across = turning.mul_add(number(link::ACROSS), steiner);
        let along = scale(turning.mul_add(number(link::AXIAL_EXCESS), -steiner), z);
        for (k, (i, j)) in [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].into_iter().enumerate() {
            angular[k] = along[i].mul_add(z[j], angular[k]);
        }
        for k in [0, 3, 5] {
            angular[k] = angular[k] + across;
        }
        let mut linear = m;
        add_offset_mass(&mut new, &mut linear, mass, scale(mass * arm, z));
        Self { angular, coupling: new, linear, n, f }
    }

    /// `-m [r][r]`, `m [r]`, `m 1`.
    #[inline(always)]
    fn add_point_mass(&mut self, mass: Lane<S>, r: Lane3<S>) {
        let mr = scale(mass, r);
        let square = dot(mr, r);
        for (k, (i, j)) in [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].into_iter().enumerate() {
            self.angular[k] = mr[i].take_from(r[j], self.angular[k]);
        }
        for k in [0, 3, 5] {
            self.angular[k] = self.angular[k] + square;
        }
        add_offset_mass(&mut self.coupling, &mut self.linear, mass, mr);
    }
}

/// Coupling and linear block of a mass with the first moment `mr`.
#[inline(always)]
fn add_offset_mass<S: Simd>(
    coupling: &mut [Lane3<S>; 3],
    linear: &mut [Lane<S>; 6],
    mass: Lane<S>,
    mr: Lane3<S>,
) {
    coupling[0][1] = coupling[0][1] + mr[2];
    coupling[0][2] = coupling[0][2] - mr[1];
    coupling[1][0] = coupling[1][0] - mr[2];
    coupling[1][2] = coupling[1][2] + mr[0];
    coupling[2][0] = coupling[2][0] + mr[1];
    coupling[2][1] = coupling[2][1] - mr[0];
    for k in [0, 3, 5] {
        linear[k] = linear[k] + mass;
    }
}

/// Eliminates the joint: leaves G and D^-1 y in `work` and what the parent bears in `load`.
#[inline(always)]
fn eliminate<S: Simd>(
    simd: S,
    inertia: Inertia<S>,
    link: &[S::f32s; link::FIELDS],
    work: &mut [S::f32s; work::FIELDS],
    load: &mut [S::f32s; load::FIELDS],
    step: Step,
) {
    let number = |field: usize| Lane::load(simd, link[field]);
    let Inertia { angular, coupling, linear, n, f } = inertia;
    let a_1 = load3(simd, &work[work::AXES..]);
    let a_2 = load3(simd, &work[work::AXES + 3..]);
    let by_columns = |a: Lane3<S>| [dot(coupling[0], a), dot(coupling[1], a), dot(coupling[2], a)];
    let (u_1n, u_2n) = (symmetric(&angular, a_1), symmetric(&angular, a_2));
    let (u_1f, u_2f) = (by_columns(a_1), by_columns(a_2));

    let h = Lane::splat(simd, step.h);
    let (stiffness, damping) = (number(link::STIFFNESS), number(link::DAMPING));
    // h (d + h k): implicit armature, and the factor of -v in the impulse.
    let armature = h * h.mul_add(stiffness, damping);
    let h_stiffness = h * stiffness;
    let d_11 = dot(a_1, u_1n) + armature;
    let d_12 = dot(a_2, u_1n);
    let d_22 = dot(a_2, u_2n) + armature;
    let inverse = Lane::splat(simd, 1.0) / d_12.take_from(d_12, d_11 * d_22);
    let (i_11, i_12, i_22) = (d_22 * inverse, -(d_12 * inverse), d_11 * inverse);
    let impulse = |k: usize, a: Lane3<S>| {
        let spring = h_stiffness.take_from(number(link::Q + k), dot(a, n));
        armature.take_from(number(link::V + k), spring)
    };
    let (y_1, y_2) = (impulse(0, a_1), impulse(1, a_2));
    let (x_1, x_2) = (i_11.mul_add(y_1, i_12 * y_2), i_12.mul_add(y_1, i_22 * y_2));
    let g_1n = axpy(i_11, u_1n, scale(i_12, u_2n));
    let g_1f = axpy(i_11, u_1f, scale(i_12, u_2f));
    let g_2n = axpy(i_12, u_1n, scale(i_22, u_2n));
    let g_2f = axpy(i_12, u_1f, scale(i_22, u_2f));

    // A - U G^T and P - G y = P - U x.
    let less = |m: Lane<S>, u_1: Lane<S>, g_1: Lane<S>, u_2: Lane<S>, g_2: Lane<S>| {
        u_2.take_from(g_2, u_1.take_from(g_1, m)).value
    };
    for (k, (i, j)) in [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].into_iter().enumerate() {
        load[load::ANGULAR + k] = less(angular[k], u_1n[i], g_1n[j], u_2n[i], g_2n[j]);
        load[load::LINEAR + k] = less(linear[k], u_1f[i], g_1f[j], u_2f[i], g_2f[j]);
    }
    for column in 0..3 {
        for row in 0..3 {
            load[load::COUPLING + 3 * column + row] =
                less(coupling[column][row], u_1n[row], g_1f[column], u_2n[row], g_2f[column]);
        }
    }
    store3::<S>(&mut load[load::TORQUE..], axmy(x_1, u_1n, axmy(x_2, u_2n, n)));
    store3::<S>(&mut load[load::FORCE..], axmy(x_1, u_1f, axmy(x_2, u_2f, f)));
    store3::<S>(&mut work[work::G..], g_1n);
    store3::<S>(&mut work[work::G + 3..], g_1f);
    store3::<S>(&mut work[work::G + 6..], g_2n);
    store3::<S>(&mut work[work::G + 9..], g_2f);
    work[work::X] = x_1.value;
    work[work::X + 1] = x_2.value;
}
