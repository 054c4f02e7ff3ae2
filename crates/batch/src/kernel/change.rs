//! Velocity changes and the new state, root to tips.

use super::lane::{Lane, axpy, cross_add, dot, load3, scale, store3};
use super::{Step, View, keep, resume};
use crate::layout::{change, fruit, fruit_work, link, work};
use pulp::Simd;

#[inline(always)]
pub(super) fn run<S: Simd>(simd: S, view: &mut View<S>, step: Step) {
    let h = Lane::splat(simd, step.h);
    let mut tip = [simd.splat_f32s(0.0); change::FIELDS];
    for row in 0..view.schedule.rows {
        resume::<S, _>(view.schedule, row, view.changes, &mut tip);
        let (link, work) = (&mut view.links[row], &view.work[row]);
        let (alpha, a) = (load3(simd, &tip), load3(simd, &tip[3..]));
        let mut turn = alpha;
        for k in 0..2 {
            let g_n = load3(simd, &work[work::G + 6 * k..]);
            let g_f = load3(simd, &work[work::G + 6 * k + 3..]);
            let dv = Lane::load(simd, work[work::X + k]) - (dot(g_n, alpha) + dot(g_f, a));
            turn = axpy(dv, load3(simd, &work[work::AXES + 3 * k..]), turn);
            let v = Lane::load(simd, link[link::V + k]) + dv;
            link[link::V + k] = v.value;
            link[link::Q + k] = h.mul_add(v, Lane::load(simd, link[link::Q + k])).value;
        }
        for k in view.fruit_start[row]..view.fruit_start[row + 1] {
            let (fruit, left) = (&mut view.fruit[k], &view.fruit_work[k]);
            let anchor = cross_add(turn, load3(simd, &left[fruit_work::R_ANCHOR..]), a);
            let kappa = Lane::load(simd, left[fruit_work::KAPPA]);
            let impulse = axpy(kappa, anchor, load3(simd, &left[fruit_work::IMPULSE..]));
            let inverse_mass = Lane::load(simd, left[fruit_work::INVERSE_MASS]);
            let u = axpy(inverse_mass, impulse, load3(simd, &fruit[fruit::V..]));
            let p = axpy(h, u, load3(simd, &fruit[fruit::P..]));
            store3::<S>(&mut fruit[fruit::V..], u);
            store3::<S>(&mut fruit[fruit::P..], p);
        }
        let length = Lane::load(simd, link[link::LENGTH]);
        let d = scale(length, load3(simd, &work[work::Z..]));
        store3::<S>(&mut tip, turn);
        store3::<S>(&mut tip[3..], cross_add(turn, d, a));
        keep::<S, _>(view.schedule, row, view.changes, &tip);
    }
}
