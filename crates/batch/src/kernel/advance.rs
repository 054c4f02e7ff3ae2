//! Velocity changes and the new state, root to leaf.

use super::instructions::Instructions;
use super::lane::{Lane, Lane3, axpy, cross_add, dot, load3, store3};
use super::{Step, View, gather};
use crate::layout::{change, fruit, fruit_work, link, tip_motion, work};
use crate::schedule::NO_SLOT;

#[inline(always)]
pub(super) fn run<S: Instructions, const STEMS: bool>(simd: S, view: &mut View<S>, step: Step) {
    let View { rows, sources, masks, links, work, fruit, fruit_work, changes, tip_motion, .. } = view;
    // Two slots beyond those of the schedule.
    let Some((scratch, changes)) = changes.split_last_mut() else { return };
    let childless = changes.len() - 1;
    for (k, ((row, link), work)) in rows.iter().zip(links.iter_mut()).zip(work.iter_mut()).enumerate() {
        let (first, count) = row.sources;
        if count > 1 {
            gather(simd, &sources[first..first + count], &masks[first..first + count], changes, scratch);
        }
        let own = if row.slot == NO_SLOT { childless } else { row.slot };
        let Ok([parent, own]) = changes.get_disjoint_mut([sources[first].slot, own]) else { continue };
        let moved = Moved::new(simd, link, work, if count > 1 { scratch } else { parent }, step);
        store3::<S>(&mut own[change::TURN..], moved.turn);
        store3::<S>(&mut own[change::SHIFT..], moved.shift);
        if let Some(motion) = tip_motion.get_mut(k) {
            motion[tip_motion::LIFT] = moved.shift[2].value;
        }
        if STEMS {
            // Their state is for the next pass, which reads it anyway.
            if row.fruit.0 < row.fruit.1 {
                store3::<S>(&mut work[work::CHANGE..], moved.turn);
                store3::<S>(&mut work[work::CHANGE + 3..], moved.shift);
            }
        } else {
            for k in row.fruit.0..row.fruit.1 {
                fruit_advance(simd, &mut fruit[k], &fruit_work[k], &moved, step);
            }
        }
    }
}

/// Change of a link's velocity in the substep, at its tip.
struct Moved<S: Instructions> {
    turn: Lane3<S>,
    shift: Lane3<S>,
}

impl<S: Instructions> Moved<S> {
    /// The joint's new rates and angles.
    #[inline(always)]
    fn new(
        simd: S,
        link: &mut [S::Vector; link::FIELDS],
        work: &[S::Vector; work::FIELDS],
        parent: &[S::Vector; change::FIELDS],
        step: Step,
    ) -> Self {
        let h = Lane::splat(simd, step.h);
        let left = |field: usize| Lane::load(simd, work[field]);
        let (turn, shift) = (load3(simd, &parent[change::TURN..]), load3(simd, &parent[change::SHIFT..]));
        // L^-1 (y - U^T a), then L^-T of it.
        let factor = |k: usize| load3(simd, &work[work::G + 3 * k..]);
        let rest_1 = (left(work::Y) - dot(factor(0), turn)) - dot(factor(1), shift);
        let rest_2 = (left(work::Y + 1) - dot(factor(2), turn)) - dot(factor(3), shift);
        let dv_2 = left(work::SCALE + 1) * rest_2;
        let dv_1 = left(work::SHARE).take_from(dv_2, left(work::SCALE) * rest_1);
        for (k, dv) in [dv_1, dv_2].into_iter().enumerate() {
            let v = Lane::load(simd, link[link::V + k]) + dv;
            link[link::V + k] = v.value;
            link[link::Q + k] = h.mul_add(v, Lane::load(simd, link[link::Q + k])).value;
        }
        let turn = axpy(dv_1, load3(simd, &work[work::AXES..]), turn);
        let turn = axpy(dv_2, load3(simd, &work[work::AXES + 3..]), turn);
        Self { turn, shift: cross_add(turn, load3(simd, &work[work::D..]), shift) }
    }
}

/// The new state of a fruit after its anchor has moved with the link.
#[inline(always)]
fn fruit_advance<S: Instructions>(
    simd: S,
    fruit: &mut [S::Vector; fruit::FIELDS],
    left: &[S::Vector; fruit_work::FIELDS],
    moved: &Moved<S>,
    step: Step,
) {
    let anchor = cross_add(moved.turn, load3(simd, &left[fruit_work::R_TIP..]), moved.shift);
    let kappa = Lane::load(simd, fruit[fruit::KAPPA]);
    let impulse = axpy(kappa, anchor, load3(simd, &left[fruit_work::IMPULSE..]));
    let inverse_mass = Lane::load(simd, left[fruit_work::INVERSE_MASS]);
    let u = axpy(inverse_mass, impulse, load3(simd, &fruit[fruit::V..]));
    let p = axpy(Lane::splat(simd, step.h), u, load3(simd, &fruit[fruit::P..]));
    store3::<S>(&mut fruit[fruit::V..], u);
    store3::<S>(&mut fruit[fruit::P..], p);
}
